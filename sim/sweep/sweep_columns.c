// The columns of a run: rows of sweep_stats.def, then statistics, derived numbers and half widths of stats.def, by one index.
//
// A new row of either table is a new column, and needs no edit here; databases that lack it get it when they are
// opened.
#include "sweep.h"

#include <string.h>

static const struct {
    const char *name;
    column_kind kind;
    detail_level level;
} own_rows[SWEEP_STAT_COUNT] = {
#define SWEEP_COUNT(column, level, known, value) {#column, COLUMN_COUNT, DETAIL_##level},
#define SWEEP_REAL(column, level, known, value) {#column, COLUMN_REAL, DETAIL_##level},
#define SWEEP_RESOURCE(column, level, known, value) {#column, COLUMN_RESOURCE, DETAIL_##level},
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
#undef SWEEP_RESOURCE
};

// Of the table `runs`, beside what comes of a run.
static const char *const fixed_names[] = {"id",           "version", "detail",         "program_hash", "trace_hash",
                                          "machine_hash", "program", "trace",          "machine",      "machine_keys",
                                          "outcome",      "why",     "max_iterations", "settings"};

static bool is_taken(const char *name)
{
    static const machine any;
    machine_value key;
    for (size_t i = 0; i < sizeof fixed_names / sizeof *fixed_names; i++) {
        if (strcmp(name, fixed_names[i]) == 0)
            return true;
    }
    for (int i = 0; i < SWEEP_STAT_COUNT; i++) {
        if (strcmp(name, own_rows[i].name) == 0)
            return true;
    }
    for (int i = 0; machine_get_value(&any, i, &key); i++) {
        if (strcmp(name, key.key) == 0)
            return true;
    }
    return false;
}

column_kind sweep_column_kind(int index)
{
    if (index < SWEEP_STATISTICS_FROM)
        return own_rows[index].kind;
    return index >= SWEEP_DERIVED_FROM ? COLUMN_REAL : COLUMN_COUNT;
}

int sweep_half_width_of(int index)
{
    if (index == STAT_cycles || index == STAT_drained_cycles)
        return SWEEP_HALF_WIDTHS_FROM + STAT_INDEX_cycles;
    if (index == SWEEP_DERIVED_FROM + DERIVED_INDEX_memory_bytes)
        return STAT_memory_bytes_half_width;
    return index >= SWEEP_STATISTICS_FROM && index < SWEEP_DERIVED_FROM ? index - SWEEP_STATISTICS_FROM + SWEEP_HALF_WIDTHS_FROM : -1;
}

sweep_column sweep_get_column(int index)
{
    sweep_column column = {.kind = sweep_column_kind(index)};
    if (index < SWEEP_STATISTICS_FROM) {
        snprintf(column.name, sizeof column.name, "%s", own_rows[index].name);
        column.level = own_rows[index].level;
        return column;
    }
    if (index >= SWEEP_HALF_WIDTHS_FROM) {
        const sweep_column of = sweep_get_column(index - SWEEP_HALF_WIDTHS_FROM + SWEEP_STATISTICS_FROM);
        snprintf(column.name, sizeof column.name, "%.*s_half_width", (int)(sizeof column.name - sizeof "_half_width"), of.name);
        column.level = DETAIL_SAMPLED;
        return column;
    }
    const bool derived = index >= SWEEP_DERIVED_FROM;
    const statistic_row *row =
        derived ? &derived_rows[index - SWEEP_DERIVED_FROM] : &statistic_rows[index - SWEEP_STATISTICS_FROM];
    snprintf(column.name, sizeof column.name, "%s%s", is_taken(row->name) ? "statistic_" : "", row->name);
    column.level = row->level;
    return column;
}
