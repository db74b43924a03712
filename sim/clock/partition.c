// What a partition consists of: its channel, its units, what is known of its lines, and the ring of stamps on their way.
#include "clock.h"

#include <stdlib.h>
#include <string.h>

const char *const unit_names[UNIT_KINDS] = {"shader", "depth unit", "colour unit", "kernel unit"};

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

static job *make_jobs(uint64_t count)
{
    job *jobs = aligned_alloc(PROCESSOR_LINE, count * sizeof *jobs);
    if (jobs)
        memset(jobs, 0, count * sizeof *jobs);
    return jobs;
}

bool partition_make(clock_state *c, partition *p, const uint32_t slots[ACCESS_UNITS])
{
    const machine *m = c->machine;
    const uint64_t most = later((uint64_t)m->depth_queue, (uint64_t)m->color_queue), quads = (uint64_t)m->shader_queue;
    enum { JOBS_AT_FIRST = 16 };  // few are on their way as a rule: a small ring stays in the nearest cache
    p->when = NEVER;
    p->job_mask = JOBS_AT_FIRST - 1;
    p->jobs = make_jobs(p->job_mask + 1);
    bool good = p->jobs;
    for (int s = 0; good && s < STAGES_MAX; s++) {
        unit *u = &p->units[s];
        u->flight_mask = power_above(most + (uint64_t)m->rop_latency_cycles + 2) - 1;
        u->begun = calloc(power_above(later(most, quads) + 1), sizeof *u->begun);
        u->operations = calloc(most, sizeof *u->operations);
        u->flights = calloc(u->flight_mask + 1, sizeof *u->flights);
        u->buckets = calloc((size_t)m->interlock_buckets, sizeof *u->buckets);
        good = u->begun && u->operations && u->flights && u->buckets;
    }
    // A stamp has a quad or more, so the shader's window holds no more stamps than quads.
    p->shader_room.mask = power_above(quads + 1) - 1;
    p->shader_room.quads = calloc(p->shader_room.mask + 1, sizeof *p->shader_room.quads);
    good = good && p->shader_room.quads;
    uint32_t lines = 0;
    for (int k = 0; good && k < ACCESS_UNITS; k++) {
        p->fetches[k].misses = calloc((size_t)m->cache_misses_max, sizeof *p->fetches[k].misses);
        good = p->fetches[k].misses;
        c->first_line[k] = lines;
        lines += slots[k];
    }
    p->lines = calloc((size_t)lines + 1, sizeof *p->lines);
    p->used_in = calloc((size_t)lines + 1, sizeof *p->used_in);
    return good && p->lines && p->used_in;
}

void partition_free(partition *p)
{
    free(p->jobs);
    free(p->touches.items);
    free(p->moves.items);
    for (int s = 0; s < STAGES_MAX; s++) {
        free(p->units[s].begun);
        free(p->units[s].operations);
        free(p->units[s].flights);
        free(p->units[s].buckets);
    }
    for (int k = 0; k < ACCESS_UNITS; k++)
        free(p->fetches[k].misses);
    free(p->shader_room.quads);
    free(p->lines);
    free(p->used_in);
}

// At a pass's start everything is idle and drained. Times that rings still hold from the pass before are past, and keep nobody
// waiting.
void partition_begin(clock_state *c, partition *p)
{
    const uint64_t start = c->drained;
    shader_room *room = &p->shader_room;
    p->pushed = p->moving = 0;
    p->when = NEVER;
    *room = (shader_room){.quads = room->quads, .mask = room->mask};
    for (int s = c->stage_count; s < STAGES_MAX; s++)
        p->units[s].when = NEVER;
    for (int s = 0; s < c->stage_count; s++) {
        unit *u = &p->units[s];
        const unit old = *u;
        const unit_kind kind = c->stages[s];
        *u = (unit){.kind = kind, .partition = (int)(p - c->partitions), .when = NEVER, .window = window_of(c->machine, kind),
                    .latency = (uint64_t)(kind == UNIT_SHADER_STAGE ? c->machine->shader_latency_cycles : c->machine->rop_latency_cycles),
                    .stage = (uint8_t)s, .last = s + 1 == c->stage_count, .lists = kind == UNIT_KERNEL_STAGE || (s == c->stage_count - 1 && kind == UNIT_COLOR_STAGE),
                    .last_step = start, .port_free = start, .operation_free = start * CYCLE_PARTS, .second_free = start * CYCLE_PARTS,
                    .begun = old.begun, .begun_mask = s ? power_above(p->units[s - 1].window + 1) - 1 : 0,
                    .operations = old.operations, .flights = old.flights, .flight_mask = old.flight_mask, .buckets = old.buckets};
    }
}

// ---- Stamps on their way -------------------------------------------------------------------------------

// Grows the ring to hold those from number `oldest` on and so many more; an item's size divides that of a processor's line.
static bool grow(ring *r, size_t size, uint64_t oldest, uint64_t more)
{
    enum { PLACES_AT_FIRST = 128 };  // as few as of jobs
    const uint64_t places = later(power_above(r->end - oldest + more), PLACES_AT_FIRST);
    char *items = aligned_alloc(PROCESSOR_LINE, places * size);
    if (!items)
        return false;
    for (uint64_t i = oldest; i < r->end; i++)
        memcpy(items + (i & (places - 1)) * size, (char *)r->items + (i & r->mask) * size, size);
    free(r->items);
    r->items = items;
    r->mask = places - 1;
    return true;
}

// Room for so many more behind those from number `oldest` on.
static bool reserve(ring *r, size_t size, uint64_t oldest, uint64_t more)
{
    if ((!r->items || r->end + more > oldest + r->mask + 1) && !grow(r, size, oldest, more))
        return false;
    r->limit = oldest + r->mask + 1;
    return true;
}

// For so many touches of a stamp, any of which may move bytes.
static bool reserve_touches(partition *p, uint64_t oldest, uint32_t count)
{
    const job *first = oldest < p->pushed ? &p->jobs[oldest & p->job_mask] : NULL;
    return reserve(&p->touches, sizeof(queued_touch), first ? first->first_touch : p->touches.end, count) &&
           reserve(&p->moves, sizeof(queued_move), first ? first->first_move : p->moves.end, count);
}

// Doubles the ring.
static bool reserve_job(partition *p, uint64_t oldest)
{
    const uint64_t mask = 2 * p->job_mask + 1;
    job *grown = make_jobs(mask + 1);
    if (!grown)
        return false;
    for (uint64_t i = oldest; i < p->pushed; i++)
        grown[i & mask] = p->jobs[i & p->job_mask];
    free(p->jobs);
    p->jobs = grown;
    p->job_mask = mask;
    return true;
}

job *partition_new_job(const clock_state *c, partition *p, uint32_t touches)
{
    // The last unit may have the stamp that it began last at hand.
    const uint64_t begun = p->units[c->stage_count - 1].started, oldest = begun ? begun - 1 : 0;
    const bool full = p->pushed - oldest > p->job_mask;
    const bool tight = p->touches.end + touches > p->touches.limit || p->moves.end + touches > p->moves.limit;
    if ((full && !reserve_job(p, oldest)) || (tight && !reserve_touches(p, oldest, touches)))
        return NULL;
    return &p->jobs[p->pushed & p->job_mask];
}

// All of them have begun in the last stage, and none waits there for bytes.
bool partition_moves_nothing(const clock_state *c, const partition *p)
{
    const unit *last = &p->units[c->stage_count - 1];
    return last->started >= p->moving && !last->open;
}
