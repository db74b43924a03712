// From a pass's windows: what all stamps behind its head add up to, and how wrong that may be.
//
// A window's cycles are those between its first and its last stamp leaving the rasterizer: summed over all stamps that is the pass's time but for
// its end, since units go from window to window with what they hold. They are put down to two causes. What units did meanwhile was work on
// other stamps than the window's: those in queues before, not those in queues after. If queues grew, the window's own stamps will still cost time,
// and the other way round: so what units count is a mean of the stamps that they began, and time goes with them. And as far as the
// rasterizer waited for triangles, time goes with those that began: how many a pass has is known, and need not be guessed from windows.
//
// Any stamp is as likely to be in a window as any other (sampling.c), so the sum is unbiased but for what a lead does not make up for, and for the
// order in which caches see stamps that were run together. Its variance comes from differences of neighbouring windows (Cochran 1977,
// 8.8), which trends within a pass do not widen; it adds up over passes.
#include "detail.h"

#include <math.h>

// Statistic i, or behind the last one the bytes read and written, whose errors go together. Each line that is changed is written back in the
// same pass, and those that were changed unseen are met at its end.
static double value_of(const statistics *s, int i)
{
    if (i == STAT_INDEX_lines_dirtied)
        return (double)(s->depth_writebacks + s->color_writebacks);
    return i < STATISTIC_COUNT ? (double)statistic_value(s, i) : (double)(s->memory_bytes_read + s->memory_bytes_written);
}

// By how much of what is inferred from windows a lead may have left it wrong, the same way in all windows: no difference between
// them shows it. The largest found in cycles where intervals are not much wider (docs/accuracy.md) is 0.6 %; of passes whose queues fill behind
// the head, so that no window before has seen them full, 4 %.
static const double ALLOWANCE = 0.01, ALLOWANCE_FILLED = 0.05;

// Whether a statistic is counted when units work on a stamp, not when it arrives.
static bool by_units(int i)
{
    return i < STATISTIC_COUNT && statistic_rows[i].level == DETAIL_CYCLE && i != STAT_INDEX_raster_busy && i != STAT_INDEX_geometry_busy &&
           i != STAT_INDEX_raster_wait_geometry;
}

// Whether it counts time in which the rasterizer may wait for triangles.
static bool by_triangles(int i)
{
    return i == STAT_INDEX_cycles || i == STAT_INDEX_fragment_cycles || i == STAT_INDEX_raster_wait_geometry;
}

// What windows are parts of: all behind the head.
typedef struct whole {
    double stamps;
    double waiting;         // by how many stamps the queues shrank
    double primitives;
    double pace;            // cycles that geometry takes, by primitive
    bool filled;            // queues became deeper
} whole;

// Sums over windows.
typedef struct window_sums {
    double value;           // of the statistic at hand
    double stamps, waiting, primitives, paced;
    double queued;          // stamps that went to queues
    double cycles, blocked; // that the rasterizer waited for queues
} window_sums;

static window_sums sums_of(const sampled_window *w, int i)
{
    const statistics *s = &w->statistics;
    return (window_sums){value_of(s, i), (double)s->stamps, w->waiting, w->primitives, w->paced, (double)(s->stamps - s->stamps_hierarchical),
                         (double)s->cycles, (double)s->raster_wait_queue};
}

static window_sums plus(const window_sums *a, const window_sums *b, double sign)
{
    return (window_sums){a->value + sign * b->value, a->stamps + sign * b->stamps, a->waiting + sign * b->waiting, a->primitives + sign * b->primitives,
                         a->paced + sign * b->paced, a->queued + sign * b->queued, a->cycles + sign * b->cycles, a->blocked + sign * b->blocked};
}

// What a stamp costs, and what else the value depends on.
typedef struct cost {
    double stamp;
    double felt;            // by how many stamps of all that arrive it changes if queues grow by one
    double pace;            // by how much it changes with each primitive
} cost;

// Stamps that the rasterizer discarded wait in no queue; and where it never waits for queues, time does not depend on them, unless queues fill:
// then units are always busy, and the pass takes as long as they do. Where most are discarded, work comes in bursts: the mean stamp then tells
// nothing of those that wait.
static double felt_growth(const whole *all, const window_sums *s)
{
    const double blocked = all->filled ? 1 : s->cycles > 0 ? s->blocked / s->cycles : 0;
    const double felt = 2 * s->queued > s->stamps ? s->stamps / s->queued * blocked : 0;
    const bool few = all->stamps + felt * all->waiting < 0 || 2 * felt * s->waiting > s->stamps;  // too few windows to tell
    return few ? 0 : felt;
}

static cost find_cost(const whole *all, const window_sums *s, double felt, int i)
{
    cost c = {.felt = felt};
    if (by_triangles(i) && s->primitives > 0)
        c.pace = all->pace * s->paced / s->primitives;
    c.stamp = (s->value - c.pace * s->primitives) / (s->stamps - c.felt * s->waiting);
    return c;
}

static double extrapolate(const whole *all, const window_sums *s, double felt, int i)
{
    const cost c = find_cost(all, s, felt, i);
    return c.stamp * (all->stamps + c.felt * all->waiting) + c.pace * all->primitives;
}

// Quotients of sums over few windows are biased. From all windows, and from all but each in turn: the bias that is left falls with
// the square of their number (the jackknife: Quenouille 1956; Cochran 1977, chapter 6).
static double extrapolate_unbiased(const sampler *s, const whole *all, const window_sums *sum, double felt, int i)
{
    const double m = s->window_count, together = extrapolate(all, sum, felt, i);
    double others = 0;
    for (uint32_t w = 0; w < s->window_count; w++) {
        const window_sums one = sums_of(&s->windows[w], i), rest = plus(sum, &one, -1);
        if (2 * felt * rest.waiting > rest.stamps || !(rest.stamps > 0))  // too few to do without one
            return together;
        others += extrapolate(all, &rest, felt, i);
    }
    return m * together - (m - 1) / m * others;
}

// The sum over neighbouring windows of the squares of their differences, each but for what it costs as a rule.
static double squared_differences(const sampler *s, const cost *c, int i)
{
    double squares = 0, last = 0;
    for (uint32_t w = 0; w < s->window_count; w++) {
        const window_sums one = sums_of(&s->windows[w], i);
        const double rest = one.value - c->stamp * (one.stamps - c->felt * one.waiting) - c->pace * one.primitives;
        squares += w ? (rest - last) * (rest - last) : 0;
        last = rest;
    }
    return squares;
}

static void estimate_statistic(detail *d, const whole *all, int i)
{
    sampler *s = d->sampler;
    window_sums sum = {0};
    for (uint32_t w = 0; w < s->window_count; w++) {
        const window_sums one = sums_of(&s->windows[w], i);
        sum = plus(&sum, &one, 1);
    }
    const double felt = by_units(i) ? felt_growth(all, &sum) : 0;
    const cost c = find_cost(all, &sum, felt, i);
    const double m = s->window_count, scale = all->stamps / sum.stamps, squares = squared_differences(s, &c, i);
    const double inferred = fmax(extrapolate_unbiased(s, all, &sum, felt, i), 0);
    if (i < STATISTIC_COUNT)
        ((uint64_t *)(void *)&d->record.statistics)[i] += (uint64_t)llround(inferred);
    if (s->window_count > 1)
        s->variances[i] += scale * scale * m * squares / (2 * (m - 1)) * (1 - 1 / scale);
    if (squares > 0)
        s->allowed[i] += (all->filled ? ALLOWANCE_FILLED : ALLOWANCE) * inferred;
}

void estimate_pass(detail *d, uint64_t stamps, uint64_t waiting)
{
    sampler *s = d->sampler;
    const pass_info *pass = &d->record.info;
    whole all = {.stamps = (double)stamps, .waiting = (double)s->head_waiting - (double)waiting, .primitives = (double)(pass->primitives - s->head_primitives), .filled = s->filled};
    if (pass->primitives)
        all.pace = (double)clock_pass_bounds(d->clock)[RESOURCE_GEOMETRY] / (double)pass->primitives;
    d->result->stamps += stamps + s->head_stamps;
    d->result->stamps_measured += s->head_stamps;
    d->result->windows += s->window_count;
    for (uint32_t w = 0; w < s->window_count; w++)
        d->result->stamps_measured += s->windows[w].statistics.stamps;
    if (!s->window_count)
        return;
    for (int i = 0; i <= STATISTIC_COUNT; i++)
        estimate_statistic(d, &all, i);
    statistics *sum = &d->record.statistics;
    sum->lines_dirtied = sum->depth_writebacks + sum->color_writebacks;
    s->freedom += s->window_count - 1;
}

// Two-sided 95 % quantiles of Student's t.
static double quantile(uint64_t freedom)
{
    static const double table[] = {12.71, 12.71, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
                                   2.201, 2.179, 2.160, 2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086};
    return freedom <= 20 ? table[freedom] : 1.96 + 2.5 / (double)freedom;
}

static double half_width(const sampler *s, int i)
{
    return hypot(quantile(s->freedom) * sqrt(s->variances[i]), s->allowed[i]);
}

void estimate_half_widths(detail *d)
{
    for (int i = 0; i < STATISTIC_COUNT; i++)
        d->result->half_widths[i] = half_width(d->sampler, i);
    d->result->memory_half_width = half_width(d->sampler, STATISTIC_COUNT);
}
