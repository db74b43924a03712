// A run's result as the database keeps it: the columns of sweep_stats.def.
#include "sweep.h"

#include <math.h>
#include <string.h>

const char *const sweep_outcome_names[OUTCOME_COUNT] = {"done", "refused", "failed"};

const sweep_stat_row sweep_stat_rows[SWEEP_STAT_COUNT] = {
#define SWEEP_COUNT(column, known, value) {#column, false},
#define SWEEP_REAL(column, known, value) {#column, true},
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
};

// Clears are left out: hardware does them by marking blocks.
static uint64_t plane_bytes(const run_result *result)
{
    uint64_t bytes = 0;
    for (int i = 0; i < result->plane_count; i++)
        bytes += result->planes[i].bytes_read + result->planes[i].bytes_written + result->planes[i].texture_bytes_read;
    return bytes;
}

void sweep_row_fill(sweep_row *row, const run_result *result)
{
    const run_result *r = result;
    *row = (sweep_row){.outcome = OUTCOME_DONE, .plane_count = r->plane_count};
#define SWEEP_COUNT(column, is_known, value) \
    row->stats[STAT_##column] = (sweep_value){.known = (is_known), .count = (int64_t)(value)};
#define SWEEP_REAL(column, is_known, value) \
    row->stats[STAT_##column] = (sweep_value){.known = (is_known) && isfinite(value), .real = (value)};
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
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
