// The level sampled: a pass from its head, its windows and its end.
//
// estimate of a pass = what is known exactly (geometry) + head + mean of windows * stamps behind the head + end (units that run
// empty, the flush and the drain). A window's cycles are those between its first and its last stamp leaving the rasterizer: summed over all
// stamps that is the pass's time but for its end, since units go from window to window with what they hold. Windows lie at random
// places, one a stratum, so the sum is unbiased but for what a lead does not make up for, and for the order in which
// caches see stamps that were run together. Its variance comes from differences of
// neighbouring windows (Cochran 1977, 8.8), which trends within a pass do not widen; it adds up over passes.
#include "detail.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t *values(statistics *s)
{
    return (uint64_t *)(void *)s;
}

// ---- Measuring -----------------------------------------------------------------------------------------

status sampled_begin_pass(void *user, const pass_info *pass)
{
    detail *d = user;
    sampler *s = d->sampler;
    d->record = (pass_record){.info = *pass};
    s->any = false;
    s->window_count = 0;
    s->head_stamps = 0;
    s->head = s->exact = (statistics){0};
    s->at = d->raw;
    memory_begin_pass(d->memory, &d->record.info, &d->raw);
    return clock_begin_pass(d->clock, &d->record.info, &d->raw);
}

static bool add_window(sampler *s, const statistics *window)
{
    if (s->window_count == s->window_capacity) {
        const uint32_t capacity = s->window_capacity ? 2 * s->window_capacity : 16;
        statistics *grown = realloc(s->windows, capacity * sizeof *grown);
        if (!grown)
            return false;
        s->windows = grown;
        s->window_capacity = capacity;
    }
    s->windows[s->window_count++] = *window;
    return true;
}

// Ends the phase at hand: what was measured is kept.
static status end_phase(detail *d)
{
    sampler *s = d->sampler;
    if (!s->any || (s->phase != PHASE_HEAD && s->phase != PHASE_MEASURE))
        return STATUS_OK;
    clock_settle(d->clock, &d->raw);
    statistics since = statistics_since(&d->raw, &s->at);
    since.cycles = since.fragment_cycles = clock_front(d->clock) - s->front;
    if (s->phase == PHASE_HEAD) {
        s->head = since;
        s->head_stamps = since.stamps;
        return STATUS_OK;
    }
    return add_window(s, &since) ? STATUS_OK : report_error(d->report, STATUS_IO, "out of memory: windows");
}

static bool timed(stamp_phase phase)
{
    return phase != PHASE_SKIP && phase != PHASE_WARM;
}

status sampled_phase(void *user, stamp_phase phase, uint64_t begun)
{
    detail *d = user;
    sampler *s = d->sampler;
    const status status = end_phase(d);
    if (s->any && timed(phase) && !timed(s->phase))
        clock_resume(d->clock, begun);
    clock_settle(d->clock, &d->raw);
    if (!s->any)
        s->exact = statistics_since(&d->raw, &s->at);  // what came before the first stamp
    s->at = d->raw;
    s->front = s->any ? clock_front(d->clock) : clock_now(d->clock);
    s->phase = phase;
    s->any = true;
    return status;
}

status sampled_stamp(void *user, const stamp *stamp)
{
    detail *d = user;
    const stamp_lines *lines = memory_stamp(d->memory, stamp, &d->raw);
    return clock_stamp(d->clock, stamp, lines, &d->raw);
}

status sampled_warm(void *user, const stamp *stamp)
{
    detail *d = user;
    memory_warm(d->memory, stamp);
    return STATUS_OK;
}

void sampled_skip(void *user, uint32_t tile, uint32_t written)
{
    detail *d = user;
    memory_pass_over(d->memory, tile, written);
}

// ---- Estimating ----------------------------------------------------------------------------------------

// Statistic i, or behind the last one the bytes read and written, whose errors go together.
static double value_of(const statistics *s, int i)
{
    return i < STATISTIC_COUNT ? (double)statistic_value(s, i) : (double)(s->memory_bytes_read + s->memory_bytes_written);
}

// Adds the sum over all stamps behind the head, and its variance.
static void estimate(detail *d, uint64_t stamps)
{
    sampler *s = d->sampler;
    uint64_t measured = 0;
    for (uint32_t w = 0; w < s->window_count; w++)
        measured += s->windows[w].stamps;
    d->result->stamps += stamps + s->head_stamps;
    d->result->stamps_measured += measured + s->head_stamps;
    d->result->windows += s->window_count;
    if (!measured)
        return;
    const double scale = (double)stamps / (double)measured, m = s->window_count;
    for (int i = 0; i <= STATISTIC_COUNT; i++) {
        double sum = 0, squares = 0;
        for (uint32_t w = 0; w < s->window_count; w++) {
            const double value = value_of(&s->windows[w], i);
            sum += value;
            if (w) {
                const double step = value - value_of(&s->windows[w - 1], i);
                squares += step * step;
            }
        }
        if (i < STATISTIC_COUNT)
            values(&d->record.statistics)[i] += (uint64_t)llround(scale * sum);
        if (s->window_count > 1)
            s->variances[i] += scale * scale * m * squares / (2 * (m - 1)) * (1 - 1 / scale);
    }
    s->freedom += s->window_count - 1;
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
    status status = end_phase(d);
    const bool whole = !s->window_count;
    const uint64_t front = clock_front(d->clock);
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
    estimate(d, d->record.info.stamps > s->head_stamps ? d->record.info.stamps - s->head_stamps : 0);
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

// Two-sided 95 % quantiles of Student's t.
static double quantile(uint64_t freedom)
{
    static const double table[] = {12.71, 12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
                                   2.201, 2.179, 2.160, 2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086};
    return freedom <= 20 ? table[freedom] : 1.96 + 2.5 / (double)freedom;
}

void sampled_finish(detail *d)
{
    const double width = quantile(d->sampler->freedom);
    for (int i = 0; i < STATISTIC_COUNT; i++)
        d->result->half_widths[i] = width * sqrt(d->sampler->variances[i]);
    d->result->memory_half_width = width * sqrt(d->sampler->variances[STATISTIC_COUNT]);
}
