// One unit of a partition: stamps in their order, lines looked up one a cycle, an operation when all lines are there.
//
// A stamp begins when it has arrived, the lookup port is free and the next stage's queue has room: at most `window` stamps
// have begun here and not there (in the last stage: not begun their operation). Each lookup takes a cycle of the port; a miss
// waits until fewer than cache_misses_max are pending and until whoever used the replaced line is done, writes the replaced
// line back, asks for its own, and goes on: data are waited for by the operation alone. Operations are in order, each when its
// lines are there, the unit is free and, by the interlock, no earlier one on the same sample is under way.
#include "clock.h"

#include <stdlib.h>
#include <string.h>

const char *const unit_names[UNIT_KINDS] = {"shader", "depth unit", "colour unit", "kernel unit"};

enum { STEP_STREAM, STEP_PENDING, STEP_SPILL, STEP_SPILL_EVICTED, STEP_FILL_EVICTED, STEP_FILL };
enum { INTERLOCK_NONE, INTERLOCK_EXACT, INTERLOCK_BUCKETS };  // machine.interlock

// ---- Making --------------------------------------------------------------------------------------------

static uint64_t window_of(const machine *m, unit_kind kind)
{
    return (uint64_t)(kind == UNIT_SHADER_STAGE ? m->shader_queue : kind == UNIT_COLOR_STAGE ? m->color_queue : m->depth_queue);
}

static uint64_t power_above(uint64_t value)
{
    uint64_t power = 1;
    while (power < value)
        power *= 2;
    return power;
}

bool units_make(clock_state *c, partition *p, const uint32_t slots[ACCESS_UNITS])
{
    const machine *m = c->machine;
    const uint64_t most = later((uint64_t)m->depth_queue, (uint64_t)m->color_queue);
    enum { JOBS_AT_FIRST = 16 };  // few are on their way as a rule: a small ring stays in the nearest cache
    p->job_mask = JOBS_AT_FIRST - 1;
    p->jobs = calloc(p->job_mask + 1, sizeof *p->jobs);
    bool good = p->jobs;
    for (int s = 0; good && s < STAGES_MAX; s++) {
        unit *u = &p->units[s];
        u->flight_mask = power_above(most + (uint64_t)m->rop_latency_cycles + 2) - 1;
        u->operations = calloc(most, sizeof *u->operations);
        u->flights = calloc(u->flight_mask + 1, sizeof *u->flights);
        u->buckets = calloc((size_t)m->interlock_buckets, sizeof *u->buckets);
        good = u->operations && u->flights && u->buckets;
    }
    for (int k = 0; good && k < ACCESS_UNITS; k++) {
        line_cache *cache = &p->caches[k];
        cache->ready = calloc(slots[k] + 1, sizeof *cache->ready);
        cache->last_use = calloc(slots[k] + 1, sizeof *cache->last_use);
        cache->used_in = calloc(slots[k] + 1, sizeof *cache->used_in);
        cache->misses = calloc((size_t)m->cache_misses_max, sizeof *cache->misses);
        good = cache->ready && cache->last_use && cache->used_in && cache->misses;
    }
    return good;
}

void units_free(partition *p)
{
    for (uint64_t i = 0; p->jobs && i <= p->job_mask; i++) {
        free(p->jobs[i].touches);
        free(p->jobs[i].moves);
    }
    free(p->jobs);
    for (int s = 0; s < STAGES_MAX; s++) {
        free(p->units[s].operations);
        free(p->units[s].flights);
        free(p->units[s].buckets);
    }
    for (int k = 0; k < ACCESS_UNITS; k++) {
        free(p->caches[k].ready);
        free(p->caches[k].last_use);
        free(p->caches[k].used_in);
        free(p->caches[k].misses);
    }
}

// At a pass's start everything is idle and drained.
void units_begin(clock_state *c, partition *p)
{
    p->pushed = 0;
    p->when = NEVER;
    for (int s = 0; s < c->stage_count; s++) {
        unit *u = &p->units[s];
        const unit old = *u;
        *u = (unit){.kind = c->stages[s], .partition = (int)(p - c->partitions), .when = NEVER, .window = window_of(c->machine, c->stages[s]), .port_free = c->drained,
                    .operation_free = c->drained * CYCLE_PARTS, .second_free = c->drained * CYCLE_PARTS,
                    .operations = old.operations, .flights = old.flights, .flight_mask = old.flight_mask, .buckets = old.buckets};
    }
}

// ---- When a stamp can begin ----------------------------------------------------------------------------

static job *job_at(const partition *p, uint64_t number)
{
    return &p->jobs[number & p->job_mask];
}

// Stamps that have arrived, or will at a known time.
static uint64_t arrived(const partition *p, int stage)
{
    return stage ? p->units[stage - 1].started - p->units[stage - 1].open : p->pushed;
}

// Whether the stamp finds room behind those that are here and not yet in the next stage. The shader counts quads; a stamp
// of more than it holds has it alone.
static bool has_room(const partition *p, int stage)
{
    const unit *u = &p->units[stage], *next = &p->units[stage + 1];
    if (u->kind != UNIT_SHADER_STAGE)
        return u->started - next->started < u->window;
    const uint64_t quads = u->quads_started - next->quads_started;
    return !quads || quads + job_at(p, u->started)->quads <= u->window;
}

void unit_next(clock_state *c, partition *p, int stage)
{
    unit *u = &p->units[stage];
    if (u->open)
        return;  // its next lookup is known
    u->when = NEVER;
    if (u->started == arrived(p, stage))
        return;
    uint64_t when = later(job_at(p, u->started)->ready, u->port_free);
    if (stage + 1 < c->stage_count) {
        if (!has_room(p, stage))
            return;  // asked again when the next unit begins one
    } else if (!u->window) {
        return;  // machine files have no such queue
    } else if (u->started >= u->window) {
        when = later(when, u->operations[u->operation]);
    }
    u->when = later(when, c->now);
}

// ---- Lookups -------------------------------------------------------------------------------------------

bool clock_write(clock_state *c, partition *p, uint64_t address, uint32_t bytes, uint64_t *when)
{
    return !bytes || channel_write(p->channel, c->now, address, bytes, when);
}

uint64_t clock_l2_move(clock_state *c, partition *p, uint32_t bytes)
{
    const uint64_t share = (uint64_t)bytes * (uint64_t)c->partition_count * CYCLE_PARTS;
    const uint64_t rate = (uint64_t)c->machine->l2_bytes_per_clock;
    p->l2_free = later(p->l2_free, c->now * CYCLE_PARTS) + (share + rate - 1) / rate;
    return cycles_up(p->l2_free) + (uint64_t)c->machine->l2_latency_cycles;
}

// Waits until `when`; counted under a cause.
static bool wait_until(clock_state *c, unit *u, uint64_t when, uint64_t *cause)
{
    const statistics *s = c->statistics;
    *cause += when - c->now;
    if (c->timeline)
        spans_note(c, u, true, cause == &s->unit_wait_misses ? "pending misses" : cause == &s->unit_wait_victim ? "line in use" : "memory takes no write",
                   c->now, when);
    u->when = when;
    return false;
}

// The bytes of a line on their way; when they are there.
static uint64_t fill_ready(clock_state *c, partition *p, const transfer *fill)
{
    uint64_t ready = c->now + 1;
    if (fill->bytes) {
        if (c->machine->l2_bytes)
            ready = clock_l2_move(c, p, fill->bytes);
        if (!fill->on_chip)
            ready = later(ready, channel_read(p->channel, c->now, fill->address, fill->bytes) +
                                     (c->machine->l2_bytes ? (uint64_t)c->machine->l2_latency_cycles : 0));
        ready += fill->compressed ? (uint64_t)c->machine->compression_cycles : 0;
    }
    return ready;
}

// When the users of the line to be replaced have ended. Behind stamps that were skipped the line may have been another then, used just
// now, which a stamp that came at once would not have met: it waits for the earliest of its set's uses instead, one use each.
static uint64_t victim_free(const clock_state *c, line_cache *cache, const queued_touch *touch, uint64_t stretch)
{
    const int64_t ways[ACCESS_UNITS] = {c->machine->texture_cache_ways, c->machine->depth_cache_ways, c->machine->color_cache_ways};
    const uint32_t slot = touch->slot, count = (uint32_t)ways[touch->cache], first = slot / count * count;
    uint32_t earliest = slot;
    if (cache->used_in[slot] == stretch || c->machine->tile_based)
        return cache->last_use[slot];
    for (uint32_t i = first; i < first + count; i++)
        if (cache->used_in[i] != stretch && cache->last_use[i] < cache->last_use[earliest])
            earliest = i;
    const uint64_t use = cache->last_use[earliest];
    cache->last_use[earliest] = cache->last_use[slot];
    return cache->last_use[slot] = use;
}

// The place of the pending fetch that is back first. They come back out of order: some from the second level, some after
// decompression.
static uint64_t *first_back(const clock_state *c, line_cache *cache)
{
    const uint64_t places = (uint64_t)c->machine->cache_misses_max;
    uint64_t *first = &cache->misses[cache->oldest_miss];
    for (uint64_t i = 0; *first > c->now && i < places; i++)
        first = cache->misses[i] < *first ? &cache->misses[i] : first;
    return first;
}

// As far as it can go now; false: it waits.
static bool look_up(clock_state *c, partition *p, unit *u, const job *job, const queued_touch *touch)
{
    const queued_move *line = &job->moves[touch->move];
    statistics *s = c->statistics;
    line_cache *cache = &p->caches[touch->cache];
    uint64_t *pending = line->fill.bytes ? first_back(c, cache) : NULL;
    uint64_t when;
    if (u->step <= STEP_PENDING) {
        if (pending && *pending > c->now)
            return wait_until(c, u, *pending, &s->unit_wait_misses);
        const uint64_t used = touch->replaces ? victim_free(c, cache, touch, job->stretch) : 0;
        if (used > c->now)
            return wait_until(c, u, used, &s->unit_wait_victim);
        u->step = STEP_SPILL;
    }
    if (u->step == STEP_SPILL) {
        if (line->spill.on_chip)
            clock_l2_move(c, p, line->spill.bytes);
        else if (!clock_write(c, p, line->spill.address, line->spill.bytes, &when))
            return wait_until(c, u, when, &s->unit_wait_memory);
        u->step = STEP_SPILL_EVICTED;
    }
    if (u->step == STEP_SPILL_EVICTED) {
        if (!clock_write(c, p, line->spill.evicted_address, line->spill.evicted_bytes, &when))
            return wait_until(c, u, when, &s->unit_wait_memory);
        u->step = STEP_FILL_EVICTED;
    }
    if (u->step == STEP_FILL_EVICTED) {
        if (!clock_write(c, p, line->fill.evicted_address, line->fill.evicted_bytes, &when))
            return wait_until(c, u, when, &s->unit_wait_memory);
        u->step = STEP_FILL;
    }
    if (touch->miss) {
        cache->ready[touch->slot] = fill_ready(c, p, &line->fill);
        if (pending) {
            *pending = cache->ready[touch->slot];
            cache->oldest_miss = cache->oldest_miss + 1 == (uint64_t)c->machine->cache_misses_max ? 0 : cache->oldest_miss + 1;
        }
    }
    u->data_ready = later(u->data_ready, cache->ready[touch->slot]);
    return true;
}

// Fragments appended to lists, or read back.
static bool stream(clock_state *c, partition *p, unit *u, const job *job)
{
    uint64_t when;
    if (job->stream_written && !clock_write(c, p, job->stream_address, job->stream_written, &when))
        return wait_until(c, u, when, &c->statistics->unit_wait_memory);
    if (job->stream_read)
        u->data_ready = later(u->data_ready, channel_read(p->channel, c->now, job->stream_address, job->stream_read));
    u->step = STEP_PENDING;
    return true;
}

// ---- Operations ----------------------------------------------------------------------------------------

static uint32_t bucket_of(const clock_state *c, uint32_t tile, int lane)
{
    const uint64_t hash = ((uint64_t)tile * TILE_LANES + (uint64_t)lane) * UINT64_C(0x9e3779b97f4a7c15);
    return (uint32_t)((hash >> 32) % (uint64_t)c->machine->interlock_buckets);
}

// When earlier operations on the same samples are done; by buckets, on quads of the same hash.
static uint64_t interlocked(const clock_state *c, const unit *u, uint32_t tile, uint64_t lanes, uint64_t from)
{
    uint64_t done = from;
    if (c->machine->interlock == INTERLOCK_BUCKETS) {
        for (uint64_t left = frame_quads(c->frame, lanes); left; left &= left - 1)
            done = later(done, u->buckets[bucket_of(c, tile, __builtin_ctzll(left))]);
    } else if (c->machine->interlock == INTERLOCK_EXACT) {
        // Done in order: the first one met that is done by then ends the search.
        for (uint64_t i = u->flight_count; i > 0 && u->flight_count - i <= u->flight_mask; i--) {
            const flight *flight = &u->flights[(i - 1) & u->flight_mask];
            if (flight->done <= from)
                break;
            if (flight->tile == tile && (flight->lanes & lanes)) {
                done = flight->done;
                break;
            }
        }
    }
    return done;
}

static void note_flight(const clock_state *c, unit *u, uint32_t tile, uint64_t lanes, uint64_t done)
{
    u->flights[u->flight_count++ & u->flight_mask] = (flight){tile, lanes, done};
    if (c->machine->interlock == INTERLOCK_BUCKETS)
        for (uint64_t left = frame_quads(c->frame, lanes); left; left &= left - 1)
            u->buckets[bucket_of(c, tile, __builtin_ctzll(left))] = done;
}

// The stamp's operation: when it begins, ends and is done. The last lookup was made in cycle `at`.
static void operate(clock_state *c, partition *p, unit *u, int stage, job *job, uint64_t at)
{
    const stage_work *work = &job->work[stage];
    const bool rop = u->kind != UNIT_SHADER_STAGE;
    statistics *s = c->statistics;
    const uint64_t looked_up = work->touch_count ? at + 1 : at;
    uint64_t begin = later(looked_up * CYCLE_PARTS, u->operation_free);
    begin = work->second_cost ? later(begin, u->second_free) : begin;
    if (u->data_ready * CYCLE_PARTS > begin) {
        s->unit_wait_data += u->data_ready - begin / CYCLE_PARTS;
        begin = u->data_ready * CYCLE_PARTS;
    }
    // A stamp that leaves the unit nothing to do neither waits nor keeps others waiting. So flights are done in order.
    const bool works = work->cost || work->second_cost || work->touch_count;
    const uint64_t lanes = rop && works ? work->lanes : 0;
    if (lanes) {
        const uint64_t free = interlocked(c, u, job->tile, lanes, begin / CYCLE_PARTS);
        if (free * CYCLE_PARTS > begin) {
            s->unit_wait_interlock += free - begin / CYCLE_PARTS;
            begin = free * CYCLE_PARTS;
        }
    }
    const uint64_t end = begin + later(work->cost, work->second_cost);
    if (c->timeline && works) {
        const uint64_t ready = later(looked_up, cycles_up(u->operation_free));
        spans_note(c, u, false, "waits for data", ready, u->data_ready);
        spans_note(c, u, false, "waits for a sample", later(ready, u->data_ready), begin / CYCLE_PARTS);
        spans_note(c, u, false, "works", begin / CYCLE_PARTS, cycles_up(end));
    }
    u->operation_free = begin + work->cost;
    u->second_free = work->second_cost ? begin + work->second_cost : u->second_free;
    u->busy += work->cost;
    u->second_busy += work->second_cost;
    const uint64_t latency = !works ? 0 : (uint64_t)(rop ? c->machine->rop_latency_cycles : c->machine->shader_latency_cycles);
    if (stage == c->stage_count - 1) {
        u->operations[u->operation] = begin / CYCLE_PARTS;
        u->operation = u->operation + 1 == u->window ? 0 : u->operation + 1;
    }
    job->ready = cycles_up(end) + latency;
    if (lanes)
        note_flight(c, u, job->tile, lanes, job->ready);
    for (uint32_t i = 0; i < work->touch_count; i++) {
        const queued_touch *touch = &job->touches[work->first_touch + i];
        p->caches[touch->cache].last_use[touch->slot] = cycles_up(end);
        p->caches[touch->cache].used_in[touch->slot] = job->stretch;
    }
    c->last_fragment = later(c->last_fragment, job->ready);
}

// Begins the stamp: the room that it had in the queue before is free.
static void begin_stamp(clock_state *c, partition *p, unit *u, int stage)
{
    const uint64_t could = later(job_at(p, u->started)->ready, u->port_free);
    c->statistics->unit_wait_queue += c->now - could;
    if (c->timeline)
        spans_note(c, u, true, "next queue full", could, c->now);
    u->open = true;
    u->touch = 0;
    u->data_ready = 0;
    u->quads_started += job_at(p, u->started)->quads;
    u->started++;
    const bool lists = u->kind == UNIT_KERNEL_STAGE || (stage == c->stage_count - 1 && u->kind == UNIT_COLOR_STAGE);
    u->step = lists ? STEP_STREAM : STEP_PENDING;
    if (stage)
        unit_next(c, p, stage - 1);
    else
        c->front.when = c->front.when == NEVER ? c->now : c->front.when;
}

// A lookup that moves no bytes asks nothing of what others use, so it need not wait for its turn among their steps. It is made
// in its cycle or when the replaced line is free: that cycle.
static uint64_t look_up_alone(clock_state *c, partition *p, unit *u, const job *job, const queued_touch *touch, uint64_t at)
{
    line_cache *cache = &p->caches[touch->cache];
    if (touch->miss) {
        const uint64_t free = touch->replaces ? victim_free(c, cache, touch, job->stretch) : 0;
        if (free > at) {
            c->statistics->unit_wait_victim += free - at;
            if (c->timeline)
                spans_note(c, u, true, "line in use", at, free);
            at = free;
        }
        cache->ready[touch->slot] = at + 1;
    }
    u->data_ready = later(u->data_ready, cache->ready[touch->slot]);
    return at;
}

// All lookups that can be made now; false: the next one has a cycle of its own. *at: the cycle of the last one.
static bool look_up_all(clock_state *c, partition *p, unit *u, const job *job, const stage_work *work, uint64_t *at)
{
    *at = c->now;
    while (u->touch < work->touch_count) {
        const queued_touch *touch = &job->touches[work->first_touch + u->touch];
        if (!touch->moves) {
            *at = look_up_alone(c, p, u, job, touch, *at);
        } else if (*at > c->now) {
            u->when = *at;
            return false;
        } else if (!look_up(c, p, u, job, touch)) {
            return false;
        }
        u->step = STEP_PENDING;
        *at += ++u->touch < work->touch_count;
    }
    return true;
}

void unit_step(clock_state *c, partition *p, int stage)
{
    unit *u = &p->units[stage];
    uint64_t at;
    if (!u->open)
        begin_stamp(c, p, u, stage);
    job *job = job_at(p, u->started - 1);
    if (u->step == STEP_STREAM && !stream(c, p, u, job))
        return;
    if (!look_up_all(c, p, u, job, &job->work[stage], &at))
        return;
    operate(c, p, u, stage, job, at);
    u->open = false;
    u->port_free = at + 1;
    unit_next(c, p, stage);
    if (stage + 1 < c->stage_count)
        unit_next(c, p, stage + 1);
}

void partition_next(const clock_state *c, partition *p)
{
    p->when = NEVER;
    for (int s = c->stage_count - 1; s >= 0; s--) {
        if (p->units[s].when < p->when) {
            p->when = p->units[s].when;
            p->next_stage = s;
        }
    }
}
