// Rows of stats.def: what each needs, sums and regions, and derived numbers against sums by hand.
#include "messages.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <math.h>

// Units that the glossary knows. A new one is added here, so that two spellings of one unit are noticed.
static const char *const count_units[] = {"stamps", "fragments", "quads",    "operations", "samples",
                                          "slots",  "triangles", "vertices", "blocks",     "lines",
                                          "bytes",  "cycles",    "requests", "times"};
static const char *const derived_units[] = {
    "", "bytes", "bytes a fragment", "fragments a quad", "s", "samples a clock", "GB/s"};

static bool is_among(const char *word, const char *const *words, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (strcmp(word, words[i]) == 0)
            return true;
    }
    return false;
}

static void check_rows(const statistic_row *rows, int count, const char *const *units, size_t unit_count)
{
    for (int i = 0; i < count; i++) {
        const statistic_row *row = &rows[i];
        if (strlen(row->meaning) < 5 || strchr(row->meaning, '|'))
            fail_msg("%s has no meaning that a table could show", row->name);
        if (!is_among(row->unit, units, unit_count))
            fail_msg("%s has the unknown unit `%s`", row->name, row->unit);
        if (row->level != DETAIL_TRAFFIC && row->level != DETAIL_CYCLE)
            fail_msg("%s is of level %d", row->name, row->level);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(rows[k].name, row->name);
    }
}

static void every_row_is_whole(void **state)
{
    (void)state;
    check_rows(statistic_rows, STATISTIC_COUNT, count_units, sizeof count_units / sizeof *count_units);
    check_rows(derived_rows, DERIVED_COUNT, derived_units, sizeof derived_units / sizeof *derived_units);
    // A column's name must say which table it is from.
    for (int i = 0; i < DERIVED_COUNT; i++) {
        for (int k = 0; k < STATISTIC_COUNT; k++)
            assert_string_not_equal(derived_rows[i].name, statistic_rows[k].name);
    }
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_is_stall(i))
            assert_string_equal(statistic_rows[i].unit, "cycles");
    }
    assert_true(statistic_is_stall(STAT_INDEX_unit_wait_interlock));
    assert_true(statistic_is_stall(STAT_INDEX_raster_wait_geometry));
    assert_false(statistic_is_stall(STAT_INDEX_cycles));
}

static void names_are_there(void **state)
{
    (void)state;
    assert_string_equal(detail_level_names[DETAIL_CYCLE], "cycle");
    assert_string_equal(pass_kind_names[PASS_CLEAR], "clear");
    assert_string_equal(access_unit_names[ACCESS_COLOR], "color");
    assert_string_equal(clock_resource_names[RESOURCE_MEMORY], "memory");
    assert_string_equal(clock_resource_names[RESOURCE_CLEAR], "clear");
    assert_string_equal(clock_resource_names[RESOURCE_COUNT], "latency");
}

// Row i holds factor * (i + 1): every row is its own number.
static statistics filled(uint64_t factor)
{
    statistics statistics = {0};
    for (int i = 0; i < STATISTIC_COUNT; i++)
        ((uint64_t *)(void *)&statistics)[i] = factor * (uint64_t)(i + 1);
    return statistics;
}

static void index_is_field(void **state)
{
    (void)state;
    const statistics statistics = filled(1);
    assert_int_equal(statistics.stamps, 1);
    assert_int_equal(statistics.turnarounds, STATISTIC_COUNT);
    assert_int_equal(statistics.cycles, statistic_value(&statistics, STAT_INDEX_cycles));
}

static void a_region_is_end_minus_start(void **state)
{
    (void)state;
    const statistics start = filled(3), more = filled(UINT64_C(1) << 40);
    statistics end = start;
    statistics_add(&end, &more);
    for (int i = 0; i < STATISTIC_COUNT; i++)
        assert_int_equal(statistic_value(&end, i), ((UINT64_C(1) << 40) + 3) * (uint64_t)(i + 1));
    const statistics region = statistics_since(&end, &start);
    assert_memory_equal(&region, &more, sizeof region);
    const statistics nothing = statistics_since(&end, &end), zero = {0};
    assert_memory_equal(&nothing, &zero, sizeof zero);
}

static void assert_near(double value, double expected)
{
    if (!(fabs(value - expected) <= 1e-12 * fabs(expected)))
        fail_msg("%.17g is not %.17g", value, expected);
}

static void derived_numbers(void **state)
{
    (void)state;
    machine machine;
    assert_int_equal(machine_load("g80", NULL, &machine), STATUS_OK);
    machine.core_mhz = 500;
    machine.partitions = 4;
    const statistics s = {.fragments = 10,
                          .quads = 4,
                          .depth_lookups = 8,
                          .depth_misses = 2,
                          .memory_bytes_read = 5,
                          .memory_bytes_written = 2,
                          .cycles = 20,
                          .memory_busy = 40,
                          .row_hits = 3,
                          .row_misses = 1};
    assert_near(derived_value(DERIVED_INDEX_memory_bytes, &s, &machine), 7);
    assert_near(derived_value(DERIVED_INDEX_bytes_per_fragment, &s, &machine), 0.7);
    assert_near(derived_value(DERIVED_INDEX_fragments_per_quad, &s, &machine), 2.5);
    assert_near(derived_value(DERIVED_INDEX_depth_hit_rate, &s, &machine), 0.75);
    // 20 cycles of 2 ns; 7 bytes in 40 ns are 0.175 GB/s; 40 of 4 x 20 bus cycles.
    assert_near(derived_value(DERIVED_INDEX_seconds_at_clock, &s, &machine), 40e-9);
    assert_near(derived_value(DERIVED_INDEX_samples_per_clock, &s, &machine), 0.5);
    assert_near(derived_value(DERIVED_INDEX_memory_gb_per_s, &s, &machine), 0.175);
    assert_near(derived_value(DERIVED_INDEX_memory_share, &s, &machine), 0.5);
    assert_near(derived_value(DERIVED_INDEX_row_hit_rate, &s, &machine), 0.75);
    // Nothing was looked up.
    assert_true(isnan(derived_value(DERIVED_INDEX_color_hit_rate, &s, &machine)));
}

static void division_by_zero_is_no_number(void **state)
{
    (void)state;
    machine machine;
    assert_int_equal(machine_load("g80", NULL, &machine), STATUS_OK);
    const statistics zero = {0}, bytes = {.memory_bytes_read = 1};
    for (int i = 0; i < DERIVED_COUNT; i++) {
        const double value = derived_value(i, &zero, &machine);
        assert_true(value == 0 || isnan(value));
    }
    // One over nothing is infinite: no number either.
    assert_true(isnan(derived_value(DERIVED_INDEX_bytes_per_fragment, &bytes, &machine)));
    assert_true(isnan(derived_value(DERIVED_INDEX_memory_gb_per_s, &bytes, &machine)));
    assert_true(isnan(derived_value(DERIVED_COUNT, &bytes, &machine)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_row_is_whole), cmocka_unit_test(names_are_there),
        cmocka_unit_test(index_is_field),     cmocka_unit_test(a_region_is_end_minus_start),
        cmocka_unit_test(derived_numbers),    cmocka_unit_test(division_by_zero_is_no_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
