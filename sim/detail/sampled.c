// The level sampled: a pass from its head, its windows and its end.
//
// estimate of a pass = what is known exactly (geometry) + head + mean of windows * stamps behind the head + end (units that run
// empty, the flush and the drain). A window's cycles are those between its first and its last stamp leaving the rasterizer: summed over all
// stamps that is the pass's time but for its end, since units go from window to window with what they hold. What units did meanwhile
// was work on other stamps: those in queues before, not those in queues after. If queues grew, the window's own stamps will still
// cost time, and the other way round: so what units count is a mean of the stamps that they began, and time goes with them. Windows lie at random
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
    s->head_stamps = s->head_waiting = 0;
    s->head = s->exact = (statistics){0};
    s->at = d->raw;
    memory_begin_pass(d->memory, &d->record.info, &d->raw);
    return clock_begin_pass(d->clock, &d->record.info, &d->raw);
}

static bool add_window(sampler *s, const statistics *window, double waiting)
{
    if (s->window_count == s->window_capacity) {
        const uint32_t capacity = s->window_capacity ? 2 * s->window_capacity : 16;
        sampled_window *grown = realloc(s->windows, capacity * sizeof *grown);
        if (!grown)
            return false;
        s->windows = grown;
        s->window_capacity = capacity;
    }
    s->windows[s->window_count++] = (sampled_window){*window, waiting};
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
    const uint64_t waiting = clock_waiting(d->clock);
    if (s->phase == PHASE_HEAD) {
        s->head = since;
        s->head_stamps = since.stamps;
        s->head_waiting = waiting;
        return STATUS_OK;
    }
    return add_window(s, &since, (double)waiting - (double)s->waiting) ? STATUS_OK : report_error(d->report, STATUS_IO, "out of memory: windows");
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
    s->waiting = s->any ? clock_waiting(d->clock) : 0;
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

// Whether a statistic is counted when units work on a stamp, not when it arrives.
static bool by_units(int i)
{
    return i < STATISTIC_COUNT && statistic_rows[i].level == DETAIL_CYCLE && i != STAT_INDEX_raster_busy && i != STAT_INDEX_geometry_busy &&
           i != STAT_INDEX_raster_wait_geometry;
}

// Stamps behind the head that arrive; that units begin, until they have only those left that wait at the end; measured, both.
// `felt`: by how many stamps of all that arrive time changes if queues grow by one.
typedef struct stamp_sums { double arrive, begin, arrived, begun, felt; } stamp_sums;

// Stamps that the rasterizer discarded wait in no queue; and where it never waits for queues, time does not depend on them. Where most are
// discarded, work comes in bursts: the mean stamp then tells nothing of those that wait.
static double felt_growth(const sampler *s)
{
    double arrived = 0, queued = 0, cycles = 0, blocked = 0;
    for (uint32_t w = 0; w < s->window_count; w++) {
        const statistics *window = &s->windows[w].statistics;
        arrived += (double)window->stamps;
        queued += (double)(window->stamps - window->stamps_hierarchical);
        cycles += (double)window->cycles;
        blocked += (double)window->raster_wait_queue;
    }
    return 2 * queued > arrived && cycles > 0 ? (arrived / queued) * (blocked / cycles) : 0;
}

static stamp_sums sum_stamps(const detail *d, uint64_t stamps, uint64_t waiting)
{
    const sampler *s = d->sampler;
    stamp_sums sums = {.arrive = (double)stamps, .felt = felt_growth(s)};
    sums.begin = sums.arrive + sums.felt * ((double)s->head_waiting - (double)waiting);
    for (uint32_t w = 0; w < s->window_count; w++) {
        sums.arrived += (double)s->windows[w].statistics.stamps;
        sums.begun += (double)s->windows[w].statistics.stamps - sums.felt * s->windows[w].waiting;
    }
    if (sums.begin < 0 || 2 * sums.begun < sums.arrived) {  // too few windows to tell
        sums.begin = sums.arrive;
        sums.begun = 0;
    }
    return sums;
}

// Adds the sum over all stamps behind the head, `waiting` of which wait at the end, and its variance.
static void estimate(detail *d, uint64_t stamps, uint64_t waiting)
{
    sampler *s = d->sampler;
    const stamp_sums sums = sum_stamps(d, stamps, waiting);
    d->result->stamps += stamps + s->head_stamps;
    d->result->stamps_measured += (uint64_t)sums.arrived + s->head_stamps;
    d->result->windows += s->window_count;
    if (!s->window_count)
        return;
    const double m = s->window_count;
    for (int i = 0; i <= STATISTIC_COUNT; i++) {
        const bool begun = by_units(i) && sums.begun > 0;
        double sum = 0, squares = 0, last = 0;
        for (uint32_t w = 0; w < s->window_count; w++)
            sum += value_of(&s->windows[w].statistics, i);
        const double each = sum / (begun ? sums.begun : sums.arrived);  // a stamp
        const double inferred = each * (begun ? sums.begin : sums.arrive);
        for (uint32_t w = 0; w < s->window_count; w++) {
            const double value = value_of(&s->windows[w].statistics, i) + (begun ? each * sums.felt * s->windows[w].waiting : 0);
            squares += w ? (value - last) * (value - last) : 0;
            last = value;
        }
        const double scale = sums.arrive / sums.arrived;
        if (i < STATISTIC_COUNT)
            values(&d->record.statistics)[i] += (uint64_t)llround(inferred);
        if (s->window_count > 1)
            s->variances[i] += scale * scale * m * squares / (2 * (m - 1)) * (1 - 1 / scale);
        if (squares > 0)
            s->inferred[i] += inferred;
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
    estimate(d, d->record.info.stamps > s->head_stamps ? d->record.info.stamps - s->head_stamps : 0, waiting);
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

// By how much of what is inferred from windows a lead may have left it wrong, the same way in all windows: no difference between
// them shows it. The largest found in cycles (docs/accuracy.md) is 0.8 %.
static const double ALLOWANCE = 0.01;

static double half_width(const sampler *s, int i)
{
    return hypot(quantile(s->freedom) * sqrt(s->variances[i]), ALLOWANCE * s->inferred[i]);
}

void sampled_finish(detail *d)
{
    for (int i = 0; i < STATISTIC_COUNT; i++)
        d->result->half_widths[i] = half_width(d->sampler, i);
    d->result->memory_half_width = half_width(d->sampler, STATISTIC_COUNT);
}
