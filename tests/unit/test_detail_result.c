// A result of the deeper levels, filled by hand, as JSON, CSV and table: every statistic once, at its level, with its
// value.
#include "messages.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

enum { PASSES_MAX = 64, COLUMNS_MAX = 128, TEXT_SIZE = 1 << 18 };

static char path[] = "/tmp/ropsim_detail_XXXXXX.out";

typedef struct sample {
    run_result function;
    detail_result detail;
    pass_record passes[PASSES_MAX];
    statistics draws[2], iterations[3];
} sample;

// Row i holds 1000 * factor + i: no two regions and no two rows share a number.
static statistics numbered(uint64_t factor)
{
    statistics statistics = {0};
    for (int i = 0; i < STATISTIC_COUNT; i++)
        ((uint64_t *)(void *)&statistics)[i] = 1000 * factor + (uint64_t)i;
    return statistics;
}

static void fill(sample *sample, detail_level level, uint64_t pass_count)
{
    *sample = (struct sample){
        .function = {.program = "layer_peel", .machine = "tiny", .iterations = 4, .wall_seconds = 0.25},
        .detail = {.level = level,
                   .total = numbered(1),
                   .passes = sample->passes,
                   .pass_count = pass_count,
                   .draws = sample->draws,
                   .draw_count = 2,
                   .iterations = sample->iterations,
                   .iteration_count = 3,
                   .planes = {{31, 32}, {33, 34}},
                   .plane_names = {"z_peel", "front"},
                   .plane_count = 2,
                   .cycles = 9000,
                   .drained_cycles = 10000,
                   .bound_cycles = 8000,
                   .occupancy = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}},
                   .wall_seconds = 0.5},
    };
    assert_int_equal(machine_load("tiny", NULL, &sample->detail.machine), STATUS_OK);
    sample->detail.machine.core_mhz = 500;
    for (uint64_t i = 0; i < pass_count; i++) {
        pass_record *pass = &sample->passes[i];
        pass->info.kind = i == 0 ? PASS_CLEAR : PASS_DRAW;
        pass->info.number = i;
        pass->info.iteration = (i + 1) / 2;
        snprintf(pass->info.name, sizeof pass->info.name, "pass_%d", (int)i);
        pass->statistics = numbered(10 + i);
        // The k-th pass takes 100 + k cycles.
        pass->start = i * 100 + i * (i - 1) / 2;
        pass->drained = pass->start + 100 + i;
        pass->last_fragment = pass->drained - 1;
        for (int k = 0; k < RESOURCE_COUNT; k++)
            pass->bounds[k] = 10 * i + (uint64_t)k;
        pass->bound_by = i == 0 ? RESOURCE_COUNT : RESOURCE_MEMORY;
    }
    for (uint64_t i = 0; i < 2; i++)
        sample->draws[i] = numbered(100 + i);
    for (uint64_t i = 0; i < 3; i++)
        sample->iterations[i] = numbered(200 + i);
}

static json_t *at(json_t *object, const char *key)
{
    json_t *value = json_object_get(object, key);
    if (!value)
        fail_msg("no key %s", key);
    return value;
}

static void assert_integer(json_t *object, const char *key, uint64_t value)
{
    if ((uint64_t)json_integer_value(at(object, key)) != value)
        fail_msg("%s is %lld, not %llu", key, (long long)json_integer_value(at(object, key)),
                 (unsigned long long)value);
}

static json_t *written(sample *sample)
{
    assert_int_equal(detail_write_json(&sample->function, &sample->detail, "bunny.ropt", path, NULL), STATUS_OK);
    json_t *object = json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(object);
    return object;
}

// The statistics of one region: those of the level, no others.
static void check_region(json_t *object, uint64_t factor, const detail_result *detail)
{
    json_t *counts = at(object, "statistics"), *numbers = at(object, "derived");
    const statistics expected = numbered(factor);
    size_t known = 0;
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_rows[i].level <= detail->level) {
            assert_integer(counts, statistic_rows[i].name, statistic_value(&expected, i));
            known++;
        }
    }
    assert_int_equal(json_object_size(counts), known);
    known = 0;
    for (int i = 0; i < DERIVED_COUNT; i++) {
        if (derived_rows[i].level <= detail->level) {
            const double value = derived_value(i, &expected, &detail->machine);
            assert_true(json_real_value(at(numbers, derived_rows[i].name)) == value);
            known++;
        }
    }
    assert_int_equal(json_object_size(numbers), known);
}

static void check_json(detail_level level)
{
    sample sample;
    fill(&sample, level, 3);
    json_t *object = written(&sample);
    assert_string_equal(json_string_value(at(object, "detail")), detail_level_names[level]);
    assert_integer(object, "iterations", 4);  // the count of the function level stays
    assert_integer(at(object, "machine_keys"), "core_mhz", 500);
    assert_integer(at(object, "memory"), "bytes_read", sample.detail.total.memory_bytes_read);
    assert_integer(at(object, "memory"), "bytes_written", sample.detail.total.memory_bytes_written);
    json_t *plane = json_array_get(at(at(object, "memory"), "planes"), 1);
    assert_string_equal(json_string_value(at(plane, "name")), "front");
    assert_integer(plane, "bytes_read", 33);
    assert_integer(plane, "bytes_written", 34);
    assert_integer(at(at(object, "occupancy"), "texture"), "least", 1);
    assert_integer(at(at(object, "occupancy"), "depth"), "most", 5);
    assert_integer(at(at(object, "occupancy"), "color"), "sets", 9);
    check_region(object, 1, &sample.detail);
    assert_int_equal(json_array_size(at(object, "passes")), 3);
    assert_int_equal(json_array_size(at(object, "draws")), 2);
    assert_int_equal(json_array_size(at(object, "by_iteration")), 3);
    for (size_t i = 0; i < 3; i++) {
        json_t *pass = json_array_get(at(object, "passes"), i), *turn = json_array_get(at(object, "by_iteration"), i);
        assert_integer(pass, "number", i);
        assert_string_equal(json_string_value(at(pass, "kind")), i == 0 ? "clear" : "draw");
        assert_string_equal(json_string_value(at(pass, "name")), sample.passes[i].info.name);
        assert_integer(pass, "iteration", (i + 1) / 2);
        check_region(pass, 10 + i, &sample.detail);
        assert_integer(turn, "index", i);
        check_region(turn, 200 + i, &sample.detail);
    }
    assert_integer(json_array_get(at(object, "draws"), 1), "index", 1);
    check_region(json_array_get(at(object, "draws"), 1), 101, &sample.detail);
    assert_true(json_real_value(at(object, "wall_seconds")) == 0.25);
    assert_true(json_real_value(at(object, "detail_wall_seconds")) == 0.5);
    json_decref(object);
}

static void json_of_traffic(void **state)
{
    (void)state;
    check_json(DETAIL_TRAFFIC);
    sample sample;
    fill(&sample, DETAIL_TRAFFIC, 1);
    json_t *object = written(&sample);
    assert_null(json_object_get(object, "cycles"));
    assert_null(json_object_get(json_array_get(at(object, "passes"), 0), "start"));
    json_decref(object);
}

static void json_of_cycle(void **state)
{
    (void)state;
    check_json(DETAIL_CYCLE);
    sample sample;
    fill(&sample, DETAIL_CYCLE, 2);
    json_t *object = written(&sample);
    assert_integer(object, "cycles", 9000);
    assert_integer(object, "drained_cycles", 10000);
    assert_integer(object, "bound_cycles", 8000);
    assert_true(json_real_value(at(object, "seconds_at_clock")) == 10000 / 500e6);
    json_t *first = json_array_get(at(object, "passes"), 0), *second = json_array_get(at(object, "passes"), 1);
    assert_string_equal(json_string_value(at(first, "bound_by")), "latency");
    assert_string_equal(json_string_value(at(second, "bound_by")), "memory");
    assert_integer(second, "start", 100);
    assert_integer(second, "last_fragment", 200);
    assert_integer(second, "drained", 201);
    assert_int_equal(json_object_size(at(second, "bounds")), RESOURCE_COUNT);
    assert_integer(at(second, "bounds"), "clear", 10 + RESOURCE_CLEAR);
    json_decref(object);
}

static void no_number_is_null(void **state)
{
    (void)state;
    sample sample;
    fill(&sample, DETAIL_CYCLE, 0);
    sample.detail.total = (statistics){0};
    json_t *object = written(&sample);
    assert_true(json_is_null(at(at(object, "derived"), "depth_hit_rate")));
    assert_true(json_is_null(at(at(object, "derived"), "memory_gb_per_s")));
    json_decref(object);
    assert_int_equal(detail_write_json(&sample.function, &sample.detail, "\xFF", path, NULL), STATUS_REFUSED);
}

// The file as lines, each cut into columns in place; the number of lines.
static int read_csv(char *text, char *lines[], char *columns[][COLUMNS_MAX], int counts[])
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    text[fread(text, 1, TEXT_SIZE - 1, file)] = 0;
    fclose(file);
    int line_count = 0;
    for (char *at = text; *at;) {
        char *end = strstr(at, "\r\n");
        assert_non_null(end);
        *end = 0;
        lines[line_count] = at;
        counts[line_count] = 0;
        for (char *column; (column = strsep(&lines[line_count], ","));)
            columns[line_count][counts[line_count]++] = column;
        line_count++;
        at = end + 2;
    }
    return line_count;
}

static int find_column(char *const header[], int count, const char *name)
{
    int found = -1;
    for (int i = 0; i < count; i++) {
        if (strcmp(header[i], name) == 0) {
            if (found >= 0)
                fail_msg("two columns %s", name);
            found = i;
        }
    }
    return found;
}

static void check_csv(detail_level level)
{
    enum { LINES = 1 + 1 + 3 + 2 + 3 };
    static char text[TEXT_SIZE];
    static const char *const scopes[LINES] = {"scope", "total", "pass",      "pass",      "pass",
                                              "draw",  "draw",  "iteration", "iteration", "iteration"};
    static const uint64_t factors[LINES] = {0, 1, 10, 11, 12, 100, 101, 200, 201, 202};
    char *lines[LINES + 1], *columns[LINES + 1][COLUMNS_MAX] = {{NULL}};
    int counts[LINES + 1];
    sample sample;
    fill(&sample, level, 3);
    assert_int_equal(detail_write_csv(&sample.detail, path, NULL), STATUS_OK);
    assert_int_equal(read_csv(text, lines, columns, counts), LINES);
    for (int line = 0; line < LINES; line++) {
        assert_int_equal(counts[line], counts[0]);
        assert_string_equal(columns[line][0], scopes[line]);
    }
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        const int column = find_column(columns[0], counts[0], statistic_rows[i].name);
        assert_int_equal(column >= 0, statistic_rows[i].level <= level);
        for (int line = 1; line < LINES && column >= 0; line++)
            assert_int_equal(strtoull(columns[line][column], NULL, 10), 1000 * factors[line] + (uint64_t)i);
    }
    for (int i = 0; i < DERIVED_COUNT; i++) {
        const int column = find_column(columns[0], counts[0], derived_rows[i].name);
        assert_int_equal(column >= 0, derived_rows[i].level <= level);
        if (column >= 0)
            assert_true(strtod(columns[1][column], NULL) ==
                        derived_value(i, &sample.detail.total, &sample.detail.machine));
    }
    assert_string_equal(columns[3][find_column(columns[0], counts[0], "name")], "pass_1");
    assert_string_equal(columns[3][find_column(columns[0], counts[0], "index")], "1");
    assert_string_equal(columns[5][find_column(columns[0], counts[0], "name")], "");
    if (level == DETAIL_CYCLE) {
        assert_string_equal(columns[3][find_column(columns[0], counts[0], "bound_by")], "memory");
        assert_string_equal(columns[3][find_column(columns[0], counts[0], "bound_geometry")], "10");
    } else {
        assert_int_equal(find_column(columns[0], counts[0], "start"), -1);
    }
}

static void csv_has_every_column(void **state)
{
    (void)state;
    check_csv(DETAIL_TRAFFIC);
    check_csv(DETAIL_CYCLE);
    sample sample;
    messages messages;
    messages_start(&messages);
    fill(&sample, DETAIL_CYCLE, 1);
    assert_int_equal(detail_write_csv(&sample.detail, "/nowhere/at/all.csv", &messages.report), STATUS_IO);
    assert_non_null(strstr(messages.text, "/nowhere/at/all.csv"));
}

static char *printed(const sample *sample)
{
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    assert_non_null(file);
    assert_int_equal(detail_print(&sample->detail, file), STATUS_OK);
    fclose(file);
    return text;
}

static void assert_shown(const char *text, const char *const *shown, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (!strstr(text, shown[i]))
            fail_msg("`%s` is not in:\n%s", shown[i], text);
    }
}

static void table_shows_time_and_bounds(void **state)
{
    (void)state;
    sample sample;
    fill(&sample, DETAIL_CYCLE, 3);
    sample.detail.total.memory_bytes_read = 1500000;
    sample.detail.total.depth_lookups = 4;
    sample.detail.total.depth_misses = 1;
    sample.detail.total.l2_lookups = 0;
    char *text = printed(&sample);
    // 100 of the 303 cycles are the pass that nothing bounds.
    static const char *const shown[] = {
        "cycle on tiny, 3 passes",
        "1.500 MB read",
        "depth 75.0 %",
        "second level -",
        "9000 cycles to the last fragment, 10000 until all is drained",
        "0.02 ms at 500 MHz; no less than 8000 cycles",
        "memory in 2 passes (67.0 % of the time), latency in 1 pass (33.0 % of the time)",
        "unit_wait_interlock",
        "bound by",
        "pass_2"};
    assert_shown(text, shown, sizeof shown / sizeof *shown);
    free(text);
}

static void table_of_traffic_has_no_time(void **state)
{
    (void)state;
    sample sample;
    fill(&sample, DETAIL_TRAFFIC, 40);
    char *text = printed(&sample);
    static const char *const shown[] = {"traffic on tiny, 40 passes", "hit rates", "pass_0 ", "pass_39"};
    assert_shown(text, shown, sizeof shown / sizeof *shown);
    assert_null(strstr(text, "cycles"));
    free(text);
}

// Of more than 40 passes the ten longest, in order: here the last, but for one that is made short and one made long.
static void many_passes_are_cut(void **state)
{
    (void)state;
    sample sample;
    fill(&sample, DETAIL_CYCLE, 50);
    sample.passes[45].drained = sample.passes[45].start + 1;
    sample.passes[7].drained = sample.passes[7].start + 5000;
    char *text = printed(&sample);
    static const char *const shown[] = {"the 10 of 50 passes that took longest", "pass_7 ", "pass_40 ", "pass_49 "};
    assert_shown(text, shown, sizeof shown / sizeof *shown);
    assert_null(strstr(text, "pass_45 "));
    assert_null(strstr(text, "pass_39 "));
    assert_true(strstr(text, "pass_7 ") < strstr(text, "pass_40 "));
    free(text);
}

int main(void)
{
    int descriptor = mkstemps(path, 4);
    if (descriptor < 0)
        return 1;
    close(descriptor);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_of_traffic),
        cmocka_unit_test(json_of_cycle),
        cmocka_unit_test(no_number_is_null),
        cmocka_unit_test(csv_has_every_column),
        cmocka_unit_test(table_shows_time_and_bounds),
        cmocka_unit_test(table_of_traffic_has_no_time),
        cmocka_unit_test(many_passes_are_cut),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
