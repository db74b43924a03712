// The writer leaves a whole file or none, and the old one when it fails; selection loses nothing; figures of small
// traces.
#include "trace_random.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

static const uint16_t one_x[] = {0}, one_y[] = {0};
static const uint8_t one_sample[] = {0};
static const double one_depth[] = {0.5};
static const float one_value[] = {1};
static const uint32_t one_primitive[] = {0};
static const fragments one = {.count = 1,
                              .x = one_x,
                              .y = one_y,
                              .sample = one_sample,
                              .depth = one_depth,
                              .rgba = {one_value, one_value, one_value, one_value},
                              .primitive = one_primitive};

static trace_info plain_info(void)
{
    trace_info info = {.width = 4, .height = 4, .samples = 1, .depth_bits = 64};
    trace_standard_positions(&info);
    return info;
}

static trace_writer *create(const char *path)
{
    trace_info info = plain_info();
    trace_writer *writer;
    assert_int_equal(trace_create(path, &info, &keeping, &writer), STATUS_OK);
    return writer;
}

// Old contents stay; no other file is left in the folder.
static void assert_untouched(const char *path)
{
    size_t size;
    uint8_t *bytes = file_bytes(path, &size);
    assert_int_equal(size, 3);
    assert_memory_equal(bytes, "old", 3);
    free(bytes);
    assert_int_equal(test_folder_files(), 1);
}

static void test_failure_keeps_the_old_file(void **state)
{
    (void)state;
    static const char *const names[] = {"kept.ropt", "kept.rtxt"};
    for (int form = 0; form < 2; form++) {
        const char *path = test_path(names[form]);
        char hash[33];
        put_file(path, "old", 3);
        trace_writer *writer = create(path);
        trace_begin_draw(writer, "a", CLASS_OPAQUE);
        trace_append(writer, &one);
        trace_abandon(writer);
        assert_untouched(path);

        writer = create(path);
        const uint16_t outside[] = {4};
        fragments bad = one;
        bad.x = outside;
        trace_begin_draw(writer, "a", CLASS_OPAQUE);
        assert_int_equal(trace_append(writer, &one), STATUS_OK);
        trace_append(writer, &bad);
        assert_int_equal(trace_end_draw(writer, 1, 3), STATUS_REFUSED);
        assert_non_null(strstr(said, "draw a, after 0 fragments: fragment 1: x is 4, must be below 4"));
        assert_int_equal(trace_begin_draw(writer, "b", CLASS_OPAQUE), STATUS_REFUSED);
        assert_int_equal(trace_finish(writer, hash), STATUS_REFUSED);
        assert_untouched(path);

        writer = create(path);
        assert_int_equal(trace_append(writer, &one), STATUS_USAGE);
        assert_int_equal(trace_finish(writer, hash), STATUS_USAGE);
        writer = create(path);
        trace_begin_draw(writer, "a", CLASS_OPAQUE);
        assert_int_equal(trace_finish(writer, hash), STATUS_USAGE);
        assert_untouched(path);
        unlink(path);
    }
}

static void test_full_disk(void **state)
{
    (void)state;
    static const char *const names[] = {"full.ropt", "full.rtxt"};
    memory_trace *trace = random_trace(4, 1, 64, false, 100000);
    signal(SIGXFSZ, SIG_IGN);
    for (int form = 0; form < 2; form++) {
        const char *path = test_path(names[form]);
        char hash[33];
        put_file(path, "old", 3);
        struct rlimit limit, before;
        getrlimit(RLIMIT_FSIZE, &before);
        limit = (struct rlimit){50000, before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
        status result = write_trace(trace, path, &keeping, hash);
        setrlimit(RLIMIT_FSIZE, &before);
        assert_int_equal(result, STATUS_IO);
        assert_non_null(strstr(said, "cannot be written"));
        assert_untouched(path);
        unlink(path);
    }
    free(trace);
}

static void test_bad_places_and_infos(void **state)
{
    (void)state;
    trace_info info = plain_info();
    trace_writer *writer;
    assert_int_equal(trace_create(test_path("none/a.ropt"), &info, &keeping, &writer), STATUS_IO);
    assert_null(writer);
    info.samples = 3;
    assert_int_equal(trace_create(test_path("a.ropt"), &info, &keeping, &writer), STATUS_REFUSED);
    info = plain_info();
    info.background[2] = INFINITY;
    assert_int_equal(trace_create(test_path("a.ropt"), &info, &keeping, &writer), STATUS_REFUSED);
    trace *trace;
    assert_int_equal(trace_open(test_path("a.ropt"), &keeping, &trace), STATUS_IO);
    assert_null(trace);
    assert_int_equal(trace_open(test_folder(), &keeping, &trace), STATUS_IO);
    assert_int_equal(trace_check(test_path("a.ropt"), &keeping), STATUS_IO);
    assert_int_equal(test_folder_files(), 0);
}

static void test_rules_of_the_writer(void **state)
{
    (void)state;
    const double tenth[] = {0.1}, not_a_number[] = {NAN};
    trace_info info = plain_info();
    info.depth_bits = 32;
    for (int round = 0; round < 2; round++) {
        trace_writer *writer;
        fragments bad = one;
        bad.depth = round ? not_a_number : tenth;
        assert_int_equal(trace_create(test_path("a.ropt"), &info, &keeping, &writer), STATUS_OK);
        trace_begin_draw(writer, "a", CLASS_OPAQUE);
        trace_append(writer, &bad);
        assert_int_equal(trace_end_draw(writer, 0, 0), STATUS_REFUSED);
        assert_non_null(strstr(said, round ? "must be finite" : "is no 32-bit float"));
        trace_abandon(writer);
    }
    trace_abandon(NULL);
    trace_close(NULL);
}

// A mesh's path may hold anything; the name in the trace is what the text form can hold.
static void test_names_are_cleaned(void **state)
{
    (void)state;
    trace_writer *writer = create(test_path("names.rtxt"));
    char hash[33];
    trace_begin_draw(writer, "my mesh #1 \xc3\xa9.obj", CLASS_OPAQUE);
    trace_end_draw(writer, 0, 0);
    trace_begin_draw(writer, "0123456789012345678901234567890123456789012345678901234567890123456789", CLASS_SORTED);
    trace_end_draw(writer, 18446744073709551615u, 18446744073709551615u);
    assert_int_equal(trace_finish(writer, hash), STATUS_OK);
    trace *trace;
    assert_int_equal(trace_open(test_path("names.rtxt"), NULL, &trace), STATUS_OK);
    assert_string_equal(trace_get_info(trace)->draws[0].name, "my_mesh__1___.obj");
    assert_int_equal(strlen(trace_get_info(trace)->draws[1].name), 63);
    assert_true(trace_get_info(trace)->draws[1].triangles == UINT64_MAX);
    assert_true(trace_get_info(trace)->draws[1].vertices == UINT64_MAX);
    trace_close(trace);
    unlink(test_path("names.rtxt"));
}

// Fragments inside the region, summed so that a missing or moved one shows.
static uint64_t sum_inside(trace *trace, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1, uint64_t *read)
{
    uint64_t sum = 0;
    *read = 0;
    for (fragments run; assert_int_equal(trace_next(trace, &run), STATUS_OK), run.count > 0; *read += run.count)
        for (uint32_t i = 0; i < run.count; i++)
            if (run.x[i] >= x0 && run.x[i] < x1 && run.y[i] >= y0 && run.y[i] < y1)
                sum = sum * 31 + run.primitive[i] + run.draw;
    return sum;
}

static void test_selection_loses_nothing(void **state)
{
    (void)state;
    memory_trace *memory = random_trace(21, 1, 64, false, RANDOM_MAX);
    memory->info.width = memory->info.height = 256;
    for (uint32_t i = 0; i < RANDOM_MAX; i++) {  // from the top to the bottom, so that chunks are bands
        memory->x[i] = (uint16_t)(memory->primitive[i] % 256);
        memory->y[i] = (uint16_t)((uint64_t)i * 256 / RANDOM_MAX);
    }
    char hash[33];
    uint64_t random = 2;
    bool skipped = false;
    for (int form = 0; form < 2; form++) {
        const char *path = test_path(form ? "select.rtxt" : "select.ropt");
        assert_int_equal(write_trace(memory, path, NULL, hash), STATUS_OK);
        trace *trace;
        assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
        for (int round = 0; round < (form ? 2 : 20); round++) {
            uint32_t x0 = (uint32_t)(random_next(&random) % 256), y0 = (uint32_t)(random_next(&random) % 256);
            uint32_t x1 = x0 + (uint32_t)(random_next(&random) % 300), y1 = y0 + (uint32_t)(random_next(&random) % 40);
            uint64_t read, whole;
            trace_select(trace, 0, 0, 256, 256);
            trace_rewind(trace);
            uint64_t expected = sum_inside(trace, x0, y0, x1, y1, &whole);
            assert_int_equal(whole, RANDOM_MAX);
            trace_select(trace, x0, y0, x1, y1);
            trace_rewind(trace);
            assert_true(sum_inside(trace, x0, y0, x1, y1, &read) == expected);
            skipped = skipped || read < whole;
        }
        trace_close(trace);
        unlink(path);
    }
    assert_true(skipped);
    free(memory);
}

// Figure 2's order: 0.8 0.7 0.3 0.1 0.4 0.5 0.65 0.9 0.6 0.55 falls into 6 ascending runs; 4 of 9 neighbours ascend.
static void test_summary_of_figure_2(void **state)
{
    (void)state;
    trace *trace;
    trace_summary summary;
    assert_int_equal(trace_open(ROPSIM_SOURCE "/traces/figure2.rtxt", NULL, &trace), STATUS_OK);
    assert_int_equal(trace_summarize(trace, NULL, &summary), STATUS_OK);
    assert_int_equal(summary.fragments, 10);
    assert_int_equal(summary.deepest, 10);
    assert_int_equal(summary.histogram[10], 1);
    assert_int_equal(summary.pairs, 9);
    assert_int_equal(summary.pairs_in_order, 4);
    assert_int_equal(summary.pairs_tied, 0);
    assert_int_equal(summary.runs, 6);
    assert_true(summary.depth_min == 0.1 && summary.depth_max == 0.9 && summary.depth_outside == 0);
    trace_close(trace);
}

static void test_summary_leaves_opaque_out(void **state)
{
    (void)state;
    trace *trace;
    trace_summary summary;
    uint64_t read;
    assert_int_equal(trace_open(ROPSIM_SOURCE "/traces/opaque.rtxt", NULL, &trace), STATUS_OK);
    assert_int_equal(trace_summarize(trace, NULL, &summary), STATUS_OK);
    assert_int_equal(summary.fragments, 4);
    assert_int_equal(summary.covered_samples, 4);
    assert_int_equal(summary.histogram[1], 4);
    assert_int_equal(summary.pairs, 0);
    sum_inside(trace, 0, 0, 4, 1, &read);  // rewound and whole again
    assert_int_equal(read, 7);
    trace_close(trace);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_failure_keeps_the_old_file), cmocka_unit_test(test_full_disk),
        cmocka_unit_test(test_bad_places_and_infos),       cmocka_unit_test(test_rules_of_the_writer),
        cmocka_unit_test(test_names_are_cleaned),          cmocka_unit_test(test_selection_loses_nothing),
        cmocka_unit_test(test_summary_of_figure_2),        cmocka_unit_test(test_summary_leaves_opaque_out),
    };
    return cmocka_run_group_tests(tests, NULL, remove_test_folder);
}
