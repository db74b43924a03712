// A run's results as the database keeps them: a value a column.
#include "sweep.h"

#include <math.h>
#include <string.h>

const char *const sweep_outcome_names[OUTCOME_COUNT] = {"done", "refused", "failed"};

// Clears are left out: hardware does them by marking blocks.
static uint64_t plane_bytes(const run_result *result)
{
    uint64_t bytes = 0;
    for (int i = 0; i < result->plane_count; i++)
        bytes += result->planes[i].bytes_read + result->planes[i].bytes_written + result->planes[i].texture_bytes_read;
    return bytes;
}

// The resource, or latency, that bounds the passes which take most of the time.
static int longest_bound(const detail_result *detail)
{
    uint64_t cycles[RESOURCE_COUNT + 1] = {0};
    int longest = 0;
    for (uint64_t i = 0; i < detail->pass_count; i++)
        cycles[detail->passes[i].bound_by] += detail->passes[i].drained - detail->passes[i].start;
    for (int i = 1; i <= RESOURCE_COUNT; i++)
        longest = cycles[i] > cycles[longest] ? i : longest;
    return longest;
}

static sweep_value count_of(bool known, uint64_t value)
{
    return (sweep_value){.known = known, .count = (int64_t)value};
}

static sweep_value real_of(bool known, double value)
{
    return known && isfinite(value) ? (sweep_value){.known = true, .real = value} : (sweep_value){0};
}

void sweep_row_fill(sweep_row *row, const run_result *result, const detail_result *detail)
{
    static const detail_result none = {.level = DETAIL_FUNCTION};
    const run_result *r = result;
    const detail_result *d = detail ? detail : &none;
    *row = (sweep_row){.outcome = OUTCOME_DONE, .plane_count = r->plane_count};
#define SWEEP_COUNT(column, from, is_known, value) \
    row->stats[STAT_##column] = count_of(d->level >= DETAIL_##from && (is_known), (uint64_t)(value));
#define SWEEP_REAL(column, from, is_known, value) \
    row->stats[STAT_##column] = real_of(d->level >= DETAIL_##from && (is_known), (value));
#define SWEEP_RESOURCE SWEEP_COUNT
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
#undef SWEEP_RESOURCE
    for (int i = 0; i < STATISTIC_COUNT; i++)
        row->stats[SWEEP_STATISTICS_FROM + i] =
            count_of(d->level >= statistic_rows[i].level, statistic_value(&d->total, i));
    for (int i = 0; i < DERIVED_COUNT; i++)
        row->stats[SWEEP_DERIVED_FROM + i] =
            real_of(d->level >= derived_rows[i].level, derived_value(i, &d->total, &d->machine));
    for (int i = 0; i < STATISTIC_COUNT; i++)
        row->stats[SWEEP_HALF_WIDTHS_FROM + i] = real_of(d->level == DETAIL_SAMPLED, d->half_widths[i]);
    for (int i = 0; i < r->plane_count; i++)
        row->planes[i] = r->planes[i];
}

void sweep_keep_reason(void *why, severity severity, const char *text)
{
    char *reason = why;
    const size_t length = strlen(reason);
    if (severity == SEVERITY_ERROR)
        snprintf(reason + length, SWEEP_WHY_SIZE - length, "%s%s", length ? "; " : "", text);
}
