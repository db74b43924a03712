// The rows of stats.def at run time: names and meanings, sums and differences, and the numbers derived from counts.
#include "levels.h"

#include <math.h>
#include <string.h>

const char *const detail_level_names[DETAIL_COUNT] = {"function", "traffic", "cycle", "sampled"};
const char *const pass_kind_names[PASS_KINDS] = {"draw", "fullscreen", "copy", "clear", "drain"};
const char *const access_unit_names[ACCESS_UNITS] = {"texture", "depth", "color"};
const char *const clock_resource_names[RESOURCE_COUNT + 1] = {"geometry", "raster", "shader", "texture", "depth",
                                                              "color",    "kernel", "memory", "clear",   "latency"};

const statistic_row statistic_rows[STATISTIC_COUNT] = {
#define STAT(name, level, unit, meaning) {#name, unit, meaning, DETAIL_##level},
#include "stats.def"
#undef STAT
};

const statistic_row derived_rows[DERIVED_COUNT] = {
#define DERIVED(name, level, unit, expression, meaning) {#name, unit, meaning, DETAIL_##level},
#include "stats.def"
#undef DERIVED
};

bool statistic_is_stall(int index)
{
    return strstr(statistic_rows[index].name, "_wait_") != NULL;
}

// Sums go over the counts as an array.
_Static_assert(sizeof(statistics) == STATISTIC_COUNT * sizeof(uint64_t), "all fields of statistics are uint64_t");

void statistics_add(statistics *sum, const statistics *more)
{
    uint64_t *counts = (uint64_t *)(void *)sum;
    for (int i = 0; i < STATISTIC_COUNT; i++)
        counts[i] += statistic_value(more, i);
}

statistics statistics_since(const statistics *now, const statistics *then)
{
    statistics region = {0};
    uint64_t *counts = (uint64_t *)(void *)&region;
    for (int i = 0; i < STATISTIC_COUNT; i++)
        counts[i] = statistic_value(now, i) - statistic_value(then, i);
    return region;
}

// The same fields as numbers, so that `a / b` in stats.def divides as one expects.
typedef struct real_counts {
#define STAT(name, level, unit, meaning) double name;
#include "stats.def"
#undef STAT
} real_counts;

typedef struct real_machine {
#define PARAM_INT(key, min, max, unit, meaning) double key;
#define PARAM_BOOL(key, meaning)
#define PARAM_FORMAT(key, class, meaning)
#define PARAM_CHOICE(key, words, meaning)
#define PARAM_SET(key, table, meaning)
#include "params.def"
#undef PARAM_INT
} real_machine;

double derived_value(int index, const statistics *statistics, const machine *machine)
{
    const real_counts counts = {
#define STAT(name, level, unit, meaning) .name = (double)statistics->name,
#include "stats.def"
#undef STAT
    };
    const real_machine keys = {
#define PARAM_INT(key, min, max, unit, meaning) .key = (double)machine->key,
#include "params.def"
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_FORMAT
#undef PARAM_CHOICE
#undef PARAM_SET
    };
    const real_counts *s = &counts;
    const real_machine *m = &keys;
    double value = NAN;
    switch (index) {
#define DERIVED(name, level, unit, expression, meaning) \
    case DERIVED_INDEX_##name: \
        value = expression; \
        break;
#include "stats.def"
#undef DERIVED
    default: break;
    }
    return isfinite(value) ? value : NAN;
}
