// Lookups that move bytes: what a miss waits for, the replaced line on its way out, and its own on its way in.
//
// A miss waits until fewer than cache_misses_max are pending and until whoever used the replaced line is done, writes the
// replaced line back, asks for its own, and goes on.
#include "clock.h"

bool clock_write(partition *p, uint64_t now, uint64_t address, uint32_t bytes, uint64_t *when)
{
    return !bytes || channel_write(p->channel, now, address, bytes, when);
}

uint64_t clock_l2_move(const clock_state *c, partition *p, uint64_t now, uint32_t bytes)
{
    const uint64_t share = (uint64_t)bytes * (uint64_t)c->partition_count * CYCLE_PARTS;
    const uint64_t rate = (uint64_t)c->machine->l2_bytes_per_clock;
    p->l2_free = later(p->l2_free, now * CYCLE_PARTS) + (share + rate - 1) / rate;
    return cycles_up(p->l2_free) + (uint64_t)c->machine->l2_latency_cycles;
}

// Waits until `when`; counted under a cause.
static bool wait_until(clock_state *c, const partition *p, unit *u, uint64_t when, uint64_t *cause)
{
    const statistics *s = c->statistics;
    *cause += when - p->now;
    if (c->timeline)
        spans_note(c, u, true, cause == &s->unit_wait_misses ? "pending misses" : cause == &s->unit_wait_victim ? "line in use" : "memory takes no write",
                   p->now, when);
    u->when = when;
    return false;
}

// The bytes of a line on their way; when they are there.
static uint64_t fill_ready(clock_state *c, partition *p, const transfer *fill)
{
    uint64_t ready = p->now + 1;
    if (fill->bytes) {
        if (c->machine->l2_bytes)
            ready = clock_l2_move(c, p, p->now, fill->bytes);
        if (!fill->on_chip)
            ready = later(ready, channel_read(p->channel, p->now, fill->address, fill->bytes) +
                                     (c->machine->l2_bytes ? (uint64_t)c->machine->l2_latency_cycles : 0));
        ready += fill->compressed ? (uint64_t)c->machine->compression_cycles : 0;
    }
    return ready;
}

static access_unit cache_of(const queued_touch *touch)
{
    return (access_unit)(touch->how >> TOUCH_CACHE & 3);
}

uint64_t earliest_use(const clock_state *c, partition *p, const queued_touch *touch, uint64_t stretch)
{
    const int64_t ways[ACCESS_UNITS] = {c->machine->texture_cache_ways, c->machine->depth_cache_ways, c->machine->color_cache_ways};
    const access_unit cache = cache_of(touch);
    const uint32_t line = touch->line, count = (uint32_t)ways[cache], base = c->first_line[cache];
    const uint32_t first = base + (line - base) / count * count;
    uint32_t earliest = line;
    for (uint32_t i = first; i < first + count; i++)
        if (p->used_in[i] != stretch && p->lines[i].last_use < p->lines[earliest].last_use)
            earliest = i;
    const uint64_t use = p->lines[earliest].last_use;
    p->lines[earliest].last_use = p->lines[line].last_use;
    return p->lines[line].last_use = use;
}

// The place of the pending fetch that is back first. They come back out of order: some from the second level, some after
// decompression.
static uint64_t *first_back(const clock_state *c, const partition *p, fetches *fetches)
{
    const uint64_t places = (uint64_t)c->machine->cache_misses_max;
    uint64_t *first = &fetches->misses[fetches->oldest_miss];
    for (uint64_t i = 0; *first > p->now && i < places; i++)
        first = fetches->misses[i] < *first ? &fetches->misses[i] : first;
    return first;
}

// The changed lines that make room, on their way out; false: the channel does not take all of them yet.
static bool make_room(clock_state *c, partition *p, unit *u, const queued_move *line)
{
    uint64_t *wait = &c->statistics->unit_wait_memory, when;
    if (u->step == STEP_SPILL) {
        if (line->spill.on_chip)
            clock_l2_move(c, p, p->now, line->spill.bytes);
        else if (!clock_write(p, p->now, line->spill.address, line->spill.bytes, &when))
            return wait_until(c, p, u, when, wait);
        u->step = STEP_SPILL_EVICTED;
    }
    if (u->step == STEP_SPILL_EVICTED) {
        if (!clock_write(p, p->now, line->spill.evicted_address, line->spill.evicted_bytes, &when))
            return wait_until(c, p, u, when, wait);
        u->step = STEP_FILL_EVICTED;
    }
    return clock_write(p, p->now, line->fill.evicted_address, line->fill.evicted_bytes, &when) || wait_until(c, p, u, when, wait);
}

// As far as it can go now.
bool move_line(clock_state *c, partition *p, unit *u, const job *job, const queued_touch *touch)
{
    const queued_move *line = move_at(p, touch->how >> TOUCH_MOVE);
    line_state *state = &p->lines[touch->line];
    fetches *fetches = &p->fetches[cache_of(touch)];
    uint64_t *pending = line->fill.bytes ? first_back(c, p, fetches) : NULL;
    if (u->step <= STEP_PENDING) {
        if (pending && *pending > p->now)
            return wait_until(c, p, u, *pending, &c->statistics->unit_wait_misses);
        const uint64_t used = touch->how & TOUCH_REPLACES ? victim_free(c, p, touch, job) : 0;
        if (used > p->now)
            return wait_until(c, p, u, used, &c->statistics->unit_wait_victim);
        u->step = STEP_SPILL;
    }
    if ((line->spill.bytes | line->spill.evicted_bytes | line->fill.evicted_bytes) && !make_room(c, p, u, line))
        return false;
    if (touch->how & TOUCH_MISS) {
        state->ready = fill_ready(c, p, &line->fill);
        if (pending) {
            *pending = state->ready;
            fetches->oldest_miss = fetches->oldest_miss + 1 == (uint64_t)c->machine->cache_misses_max ? 0 : fetches->oldest_miss + 1;
        }
    }
    u->data_ready = later(u->data_ready, state->ready);
    return true;
}

// Fragments appended to lists, or read back.
bool move_stream(clock_state *c, partition *p, unit *u, const job *job)
{
    uint64_t when;
    if (job->stream_written && !clock_write(p, p->now, job->stream_address, job->stream_written, &when))
        return wait_until(c, p, u, when, &c->statistics->unit_wait_memory);
    if (job->stream_read)
        u->data_ready = later(u->data_ready, channel_read(p->channel, p->now, job->stream_address, job->stream_read));
    u->step = STEP_PENDING;
    return true;
}
