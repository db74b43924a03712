// The level sampled: a pass from its head, its windows and its end.
//
// estimate of a pass = what is known exactly (geometry) + head + what windows tell of all stamps behind it (estimate.c) + end (units that
// run empty, the flush and the drain).
#include "detail.h"

#include <stdlib.h>
#include <string.h>

status sampled_begin_pass(void *user, const pass_info *pass)
{
    detail *d = user;
    sampler *s = d->sampler;
    d->record = (pass_record){.info = *pass};
    s->any = s->filled = false;
    s->window_count = 0;
    s->head_stamps = s->head_waiting = s->head_primitives = 0;
    s->head = s->exact = (statistics){0};
    s->at = d->raw;
    memory_begin_pass(d->memory, &d->record.info, &d->raw);
    return clock_begin_pass(d->clock, &d->record.info, &d->raw);
}

static bool add_window(sampler *s, const sampled_window *window)
{
    if (s->window_count == s->window_capacity) {
        const uint32_t capacity = s->window_capacity ? 2 * s->window_capacity : 16;
        sampled_window *grown = realloc(s->windows, capacity * sizeof *grown);
        if (!grown)
            return false;
        s->windows = grown;
        s->window_capacity = capacity;
    }
    s->windows[s->window_count++] = *window;
    return true;
}

// Ends the phase at hand: what was measured is kept. So many primitives have begun.
static status end_phase(detail *d, uint64_t begun)
{
    sampler *s = d->sampler;
    if (!s->any || (s->phase != PHASE_HEAD && s->phase != PHASE_MEASURE))
        return STATUS_OK;
    clock_settle(d->clock, &d->raw);
    statistics since = statistics_since(&d->raw, &s->at);
    since.cycles = since.fragment_cycles = clock_front(d->clock) - s->front;
    const uint64_t waiting = clock_waiting(d->clock);
    if (s->phase == PHASE_HEAD) {
        s->head = since;
        s->head_stamps = since.stamps;
        s->head_waiting = waiting;
        s->head_primitives = begun;
        return STATUS_OK;
    }
    const sampled_window window = {since, (double)waiting - (double)s->waiting, (double)(begun - s->begun), (double)(clock_paced(d->clock) - s->paced)};
    return add_window(s, &window) ? STATUS_OK : report_error(d->report, STATUS_IO, "out of memory: windows");
}

static bool timed(stamp_phase phase)
{
    return phase != PHASE_SKIP && phase != PHASE_WARM;
}

status sampled_phase(void *user, stamp_phase phase, uint64_t begun)
{
    detail *d = user;
    sampler *s = d->sampler;
    const status status = end_phase(d, begun);
    if (s->any && timed(phase) && !timed(s->phase))
        clock_resume(d->clock, begun);
    clock_settle(d->clock, &d->raw);
    if (!s->any)
        s->exact = statistics_since(&d->raw, &s->at);  // what came before the first stamp
    s->at = d->raw;
    s->waiting = s->any ? clock_waiting(d->clock) : 0;
    s->front = s->any ? clock_front(d->clock) : clock_now(d->clock);
    s->begun = begun;
    s->paced = clock_paced(d->clock);
    s->phase = phase;
    s->filled |= phase == PHASE_FILL;
    s->any = true;
    return status;
}

status sampled_stamp(void *user, const stamp *stamp)
{
    detail *d = user;
    memory_at(d->memory, stamp->tile, stamp->time);
    const stamp_lines *lines = memory_stamp(d->memory, stamp, &d->raw);
    return clock_stamp(d->clock, stamp, lines, &d->raw);
}

uint64_t sampled_waiting(void *user)
{
    detail *d = user;
    return clock_waiting(d->clock);
}

status sampled_warm(void *user, const stamp *stamp, const uint64_t *times)
{
    detail *d = user;
    memory_warm(d->memory, stamp, times);
    return STATUS_OK;
}

void sampled_skip(void *user, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time)
{
    detail *d = user;
    memory_pass_over(d->memory, tile, planes, lanes, time);
}

static void estimate_bounds(detail *d)
{
    const statistics *s = &d->record.statistics;
    const uint64_t parts = (uint64_t)d->machine->partitions;
    const uint64_t bounds[RESOURCE_COUNT] = {
        [RESOURCE_GEOMETRY] = s->geometry_busy,        [RESOURCE_RASTER] = s->raster_busy,
        [RESOURCE_SHADER] = s->shader_busy / parts,    [RESOURCE_TEXTURE] = s->texture_busy / parts,
        [RESOURCE_DEPTH] = s->depth_busy / parts,      [RESOURCE_COLOR] = s->color_busy / parts,
        [RESOURCE_KERNEL] = s->kernel_busy / parts,    [RESOURCE_MEMORY] = s->memory_busy / parts,
        [RESOURCE_CLEAR] = clock_pass_bounds(d->clock)[RESOURCE_CLEAR],
    };
    memcpy(d->record.bounds, bounds, sizeof bounds);
    uint64_t most = 0;
    for (int i = 0; i < RESOURCE_COUNT; i++)
        most = bounds[i] > most ? bounds[i] : most;
    d->result->bound_cycles += most;
    d->record.bound_by = detail_busiest(bounds, s->cycles);
}

static status finish_pass(detail *d, bool last)
{
    sampler *s = d->sampler;
    status status = end_phase(d, d->record.info.primitives);
    const bool whole = !s->window_count;
    const uint64_t front = clock_front(d->clock), waiting = clock_waiting(d->clock);
    clock_settle(d->clock, &d->raw);
    if (s->any)
        s->at = d->raw;
    if (status == STATUS_OK)
        status = clock_end_stamps(d->clock, &d->raw);
    if (status == STATUS_OK)
        status = detail_flush(d, last);
    if (status == STATUS_OK)
        status = clock_end_pass(d->clock, &d->raw);
    if (status != STATUS_OK)
        return status;
    statistics end = statistics_since(&d->raw, &s->at);
    const uint64_t pass_cycles = end.cycles, drain = clock_now(d->clock) - clock_last_fragment(d->clock);
    d->record.statistics = s->exact;
    end.cycles = end.fragment_cycles = 0;
    statistics_add(&d->record.statistics, &s->head);
    statistics_add(&d->record.statistics, &end);
    estimate_pass(d, d->record.info.stamps > s->head_stamps ? d->record.info.stamps - s->head_stamps : 0, waiting);
    statistics *r = &d->record.statistics;
    if (whole) {
        r->cycles = pass_cycles;
        r->fragment_cycles = pass_cycles - drain;
    } else {
        const uint64_t geometry = clock_pass_bounds(d->clock)[RESOURCE_GEOMETRY];
        r->cycles += clock_last_stamp(d->clock) - front;
        r->fragment_cycles = r->cycles = r->cycles > geometry ? r->cycles : geometry;
        r->cycles += drain;
    }
    estimate_bounds(d);
    d->record.start = d->result->drained_cycles;
    d->record.last_fragment = d->record.start + r->fragment_cycles;
    d->result->cycles = last ? d->result->cycles : d->record.last_fragment;
    d->record.drained = d->result->drained_cycles = d->record.start + r->cycles;
    return detail_keep_record(d);
}

status sampled_end_pass(void *user)
{
    return finish_pass(user, false);
}

status sampled_drain(detail *d, const pass_info *pass)
{
    const status status = sampled_begin_pass(d, pass);
    return status == STATUS_OK ? finish_pass(d, true) : status;
}
