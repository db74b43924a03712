// A result as JSON and as a table: every key that scripts rely on, doubles that come back, nothing half written.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static char path[] = "/tmp/ropsim_result_XXXXXX.json";
static machine tiny;

static void fill(run_result *result)
{
    *result = (run_result){
        .program = "layer_peel",
        .machine = "tiny",
        .machine_hash = "0123",
        .trace_hash = "4567",
        .width = 4,
        .height = 3,
        .samples = 2,
        .geometry_passes = 7,
        .passes_by_class = {9, 5, 2},
        .fullscreen_passes = 3,
        .iterations = 4,
        .iteration_limit_reached = true,
        .fragments_in_trace = 11,
        .fragments_replayed = 12,
        .fragments_composited = 13,
        .deepest_sample = 6,
        .plane_count = 2,
        .error = {.exact = false, .max_abs = 0.1, .rmse = 1.0 / 3, .psnr_db = 9.5, .samples_wrong = 8},
        .error_known = true,
        .wall_seconds = 0.25,
        .fragments_per_second = 48,
    };
    result->planes[0] = (plane_result){"depth", FORMAT_z24, 21, 22, 24, 23};
    result->planes[1] = (plane_result){"front", FORMAT_rgba16f, UINT64_C(1) << 40, 25, 26, 0};
}

static json_t *at(json_t *object, const char *key)
{
    json_t *value = json_object_get(object, key);
    if (!value)
        fail_msg("no key %s", key);
    return value;
}

static json_t *written(const run_result *result)
{
    assert_int_equal(result_write_json(result, &tiny, "bunny.ropt", path, NULL), STATUS_OK);
    json_t *object = json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(object);
    return object;
}

#define EXPECT_INTEGER(object, key, value) assert_int_equal(json_integer_value(at(object, key)), value)
#define EXPECT_TEXT(object, key, value) assert_string_equal(json_string_value(at(object, key)), value)
#define EXPECT_REAL(object, key, value) assert_true(json_real_value(at(object, key)) == (value))

static void json_has_every_key(void **state)
{
    (void)state;
    run_result result;
    fill(&result);
    json_t *object = written(&result);
    EXPECT_TEXT(object, "version", ROPSIM_VERSION);
    EXPECT_TEXT(object, "program", "layer_peel");
    EXPECT_TEXT(object, "trace", "bunny.ropt");
    EXPECT_TEXT(object, "trace_hash", "4567");
    EXPECT_TEXT(object, "machine", "tiny");
    EXPECT_TEXT(object, "machine_hash", "0123");
    EXPECT_TEXT(object, "detail", "function");
    EXPECT_INTEGER(object, "width", 4);
    EXPECT_INTEGER(object, "height", 3);
    EXPECT_INTEGER(object, "samples", 2);
    EXPECT_INTEGER(object, "geometry_passes", 7);
    EXPECT_INTEGER(at(object, "geometry_passes_by_class"), "transparent", 5);
    EXPECT_INTEGER(at(object, "geometry_passes_by_class"), "sorted", 2);
    EXPECT_INTEGER(object, "fullscreen_passes", 3);
    EXPECT_INTEGER(object, "iterations", 4);
    assert_true(json_is_true(at(object, "iteration_limit_reached")));
    EXPECT_INTEGER(object, "deepest_sample", 6);
    EXPECT_INTEGER(at(object, "fragments"), "in_trace", 11);
    EXPECT_INTEGER(at(object, "fragments"), "replayed", 12);
    EXPECT_INTEGER(at(object, "fragments"), "composited", 13);
    assert_int_equal(json_array_size(at(object, "planes")), 2);
    json_t *plane = json_array_get(at(object, "planes"), 1);
    EXPECT_TEXT(plane, "name", "front");
    EXPECT_TEXT(plane, "format", "rgba16f");
    EXPECT_INTEGER(plane, "bytes_read", INT64_C(1) << 40);
    EXPECT_INTEGER(plane, "bytes_written", 25);
    EXPECT_INTEGER(plane, "bytes_cleared", 26);
    EXPECT_INTEGER(json_array_get(at(object, "planes"), 0), "texture_bytes_read", 23);
    assert_true(json_is_false(at(at(object, "error"), "exact")));
    EXPECT_REAL(at(object, "error"), "max_abs", 0.1);
    EXPECT_REAL(at(object, "error"), "rmse", 1.0 / 3);
    EXPECT_REAL(at(object, "error"), "psnr_db", 9.5);
    EXPECT_INTEGER(at(object, "error"), "samples_wrong", 8);
    EXPECT_REAL(object, "wall_seconds", 0.25);
    EXPECT_REAL(object, "fragments_per_second", 48.0);
    json_decref(object);
}

// Each key as `ropsim machine` prints it: numbers as numbers, words as words.
static void json_has_every_machine_key(void **state)
{
    (void)state;
    run_result result;
    fill(&result);
    json_t *object = written(&result), *keys = at(object, "machine_keys");
    EXPECT_INTEGER(keys, "line_bytes", tiny.line_bytes);
    EXPECT_TEXT(keys, "depth_format", format_table[tiny.depth_format].name);
    assert_true(json_boolean_value(at(keys, "fast_clear")) == tiny.fast_clear);
    machine_value value;
    int count = 0;
    for (; machine_get_value(&tiny, count, &value); count++) {
        char number[32] = "";
        json_t *json = at(keys, value.key);
        if (json_is_integer(json))
            snprintf(number, sizeof number, "%lld", (long long)json_integer_value(json));
        const char *text = json_is_boolean(json) ? json_is_true(json) ? "true" : "false"
                           : number[0]           ? number
                                                 : json_string_value(json);
        assert_string_equal(text, value.text);
    }
    assert_int_equal(json_object_size(keys), count);
    assert_false(machine_get_value(&tiny, -1, &value));
    json_decref(object);
}

static void what_is_not_a_number_is_null(void **state)
{
    (void)state;
    run_result result;
    fill(&result);
    result.error.psnr_db = INFINITY;
    json_t *object = written(&result);
    assert_true(json_is_null(at(at(object, "error"), "psnr_db")));
    json_decref(object);
    result.error_known = false;
    object = written(&result);
    assert_true(json_is_null(at(object, "error")));
    json_decref(object);
}

static void json_repeats(void **state)
{
    (void)state;
    run_result result;
    char bytes[2][16384];
    fill(&result);
    for (int i = 0; i < 2; i++) {
        memset(bytes[i], 0, sizeof bytes[i]);
        json_decref(written(&result));
        FILE *file = fopen(path, "rb");
        assert_non_null(file);
        assert_true(fread(bytes[i], 1, sizeof bytes[i] - 1, file) > 100);
        fclose(file);
    }
    assert_string_equal(bytes[0], bytes[1]);
    assert_true(strstr(bytes[0], "\"version\"") < strstr(bytes[0], "\"program\""));
}

static void refusals(void **state)
{
    (void)state;
    run_result result;
    messages messages;
    fill(&result);
    messages_start(&messages);
    assert_int_equal(result_write_json(&result, &tiny, "t", "/nowhere/at/all.json", &messages.report), STATUS_IO);
    assert_non_null(strstr(messages.text, "/nowhere/at/all.json"));
    assert_int_equal(result_write_json(&result, &tiny, "\xFF", path, &messages.report), STATUS_REFUSED);
    assert_non_null(strstr(messages.text, "UTF-8"));
}

static void table_shows_the_counts(void **state)
{
    (void)state;
    run_result result;
    char *text = NULL;
    size_t size = 0;
    fill(&result);
    FILE *file = open_memstream(&text, &size);
    assert_non_null(file);
    assert_int_equal(result_print(&result, file), STATUS_OK);
    fclose(file);
    static const char *const shown[] = {"layer_peel on tiny",
                                        "2 samples a pixel",
                                        "7 (transparent 5, sorted 2)",
                                        "stopped at the limit",
                                        "11 in the trace, 12 replayed, 13 composited",
                                        "not exact",
                                        "1099511627776",
                                        "rgba16f"};
    for (size_t i = 0; i < sizeof shown / sizeof *shown; i++) {
        if (!strstr(text, shown[i]))
            fail_msg("`%s` is not in:\n%s", shown[i], text);
    }
    free(text);
}

int main(void)
{
    int descriptor = mkstemps(path, 5);
    if (descriptor < 0)
        return 1;
    close(descriptor);
    if (machine_load("tiny", NULL, &tiny) != STATUS_OK)
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_every_key),     cmocka_unit_test(what_is_not_a_number_is_null),
        cmocka_unit_test(json_repeats),           cmocka_unit_test(refusals),
        cmocka_unit_test(table_shows_the_counts), cmocka_unit_test(json_has_every_machine_key),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
