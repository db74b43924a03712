// Trace tests: what passes, what a failure tells, what a wrong file is told, --bless, TAP, JUnit; and a run stopped
// after each pass against the pixel history.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "/tmp/ropsim_tracetest_XXXXXX";
static char path[128];

#define TRACE \
    "trace\n" \
    "    size 1 1\n" \
    "    draw glass transparent\n" \
    "    f 0 0 0.75  0 1 0 0.5  1\n" \
    "    f 0 0 0.25  1 0 0 0.5  2\n" \
    "end trace\n"

static void write_file(const char *name, const char *text)
{
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static char *read_file(const char *from)
{
    char *text = calloc(1, 65536);
    FILE *file = fopen(from, "rb");
    assert_true(text && file);
    assert_true(fread(text, 1, 65535, file) > 0);
    fclose(file);
    return text;
}

static trace_tests *run(const trace_test_options *options)
{
    const char *paths[] = {path};
    trace_tests *tests = NULL;
    assert_int_equal(trace_tests_run(paths, 1, options, NULL, &tests), STATUS_OK);
    return tests;
}

// What is printed for one file with this text; free it.
static char *printed(const char *text, uint64_t passed, uint64_t failed)
{
    char *out = NULL;
    size_t size;
    write_file("one.rtest", text);
    trace_tests *tests = run(&(trace_test_options){0});
    FILE *stream = open_memstream(&out, &size);
    assert_int_equal(trace_tests_print(tests, stream), STATUS_OK);
    fclose(stream);
    if (trace_tests_totals(tests)->passed != passed || trace_tests_totals(tests)->failed != failed)
        fail_msg("expected %d passed, %d failed:\n%s", (int)passed, (int)failed, out);
    trace_tests_destroy(tests);
    return out;
}

static void expect_output(const char *text, uint64_t passed, uint64_t failed, const char *const *parts)
{
    char *out = printed(text, passed, failed);
    for (; *parts; parts++)
        if (!strstr(out, *parts))
            fail_msg("`%s` is missing in:\n%s", *parts, out);
    free(out);
}

static void test_passes(void **state)
{
    (void)state;
    expect_output(TRACE "program layer_peel ideal_coherent_layer_peel\nexpect exact\nexpect pixel 0 0  0.5 0.25 0\n"
                        "program layer_peel\nexpect iterations 3\nexpect geometry_passes > 4\nexpect iterations >= 3\n"
                        "expect iterations < 4\nexpect iterations <= 3\nexpect not limit_reached\nexpect psnr_db inf\n",
                  3, 0, (const char *[]){"ok   ", "one.rtest  3 runs", "\n3 passed, 0 failed\n", NULL});
}

// Each expectation, made to fail, says what was seen.
static void test_failures(void **state)
{
    (void)state;
    static const char *const lines[][2] = {
        {"expect iterations 4", "seen 3"},
        {"expect iterations < 3", "seen 3"},
        {"expect not exact", "seen exact"},
        {"expect limit_reached", "seen not limit_reached"},
        {"expect max_abs > 0.5", "seen "},
        {"expect bytes_written front 1", "seen 32"},
        {"expect pixel 0 0  0.5 0.5 0", "seen 0.5 0.25 0"},
        {"expect pixel 0 0  0.5 0.2499 0", "seen 0.5 0.25 0"},
        {"expect plane z_next 0 0  0.5  after pass 1", "seen 0.25"},
        {"expect plane front 0 0  0.5 0 0 0.25  after pass 2", "seen 0.5 0 0 0.5"},
        {"expect plane front 0 0  0.5", "four values, R G B A, are expected"},
        {"expect plane z_nxt 0 0  0.5", "no plane `z_nxt`; did you mean `z_next`?"},
        {"expect pixel 1 0  0 0 0", "1 x 1 pixels"},
        {"expect iterations 3 after pass 9", "the run has only 5 passes"},
        {"expect iterations 9 after iteration 9", "the run has only 3 iterations"},
        {"expect error \"nothing\"", "nothing was refused"},
        {"expect warning \"nothing\"", "nothing was said"},
    };
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        char text[1024];
        snprintf(text, sizeof text, TRACE "program layer_peel\n%s\n", lines[i][0]);
        expect_output(text, 0, 1, (const char *[]){"FAIL ", lines[i][0], lines[i][1], "\n0 passed, 1 failed\n", NULL});
    }
    expect_output(TRACE "program layer_peel\nexpect pixel 0 0  1 1 1\n", 0, 1,
                  (const char *[]){"glass transparent  depth 0.75  rgba 0 1 0 0.5  primitive 1", "z_next", NULL});
    expect_output(TRACE "program layer_peel\nset depth_format=z99\nexpect exact\n", 0, 1,
                  (const char *[]){"refused:", "must be z16, z24 or z32f", NULL});
}

static void test_wrong_files(void **state)
{
    (void)state;
    static const char *const files[][2] = {
        {"", ":1:1: the file expects nothing"},
        {TRACE, ":6:1: the file expects nothing"},
        {TRACE "program layer_peel\n", ":7:1: nothing is expected of this program"},
        {"program layer_peel\n", ":1:1: `program` before the first `trace`"},
        {TRACE "expect exact\n", ":7:1: before a `program` only `expect error`"},
        {TRACE "program layer_peel\nexpct exact\n", ":8:1: `expct` begins no line of a test; did you mean `expect`?"},
        {TRACE "program layer_peel\nexpect iteration 3\n",
         ":8:8: nothing called `iteration` can be expected; did you mean `iterations`?"},
        {TRACE "program layer_peel\nexpect iterations three\n", ":8:19: `three`, expected an integer"},
        {TRACE "program layer_peel\nexpect iterations\n", ":8:18: an integer is missing"},
        {TRACE "program layer_peel\nexpect not iterations 3\n",
         ":8:8: `not` stands before exact and limit_reached only"},
        {TRACE "program layer_peel\nexpect exact 3\n", ":8:14: `3` is too much here"},
        {TRACE "program layer_peel\nexpect pixel 0 0  1 1\n", ":8:22: a pixel has three values"},
        {TRACE "program layer_peel\nexpect plane p 0 0  1 1\n", ": a plane has one value"},
        {TRACE "program layer_peel\nexpect pixel 0 0  1 1 1 tolerance -1\n", ":8:35: a tolerance is not negative"},
        {TRACE "program layer_peel\nexpect iterations 3 after pass 0\n",
         ":8:32: passes and iterations are counted from 1"},
        {TRACE "program layer_peel\nexpect iterations 3 after noon\n",
         ":8:27: expected after pass N or after iteration N"},
        {TRACE "program layer_peel\nexpect error \"open\n", ":8:14: the quote is not closed"},
        {TRACE "replace \"a\" \"b\"\n", ":7:1: `replace` before a `program`"},
        {TRACE "occlusion_ratio 2\n", ":7:17: the occlusion ratio is a number from 0 to 1"},
        {TRACE "set a=1 b=2\n", ":7:9: `b=2` is too much; expected set KEY=VALUE"},
        {"trace\n size 1 1\n", ":1:1: `trace` without its `end trace`"},
    };
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++)
        expect_output(files[i][0], 0, 1, (const char *[]){"FAIL ", files[i][1], "\n0 passed, 1 failed\n", NULL});
}

// Lines of an inline trace and program are told as lines of the test, also behind a line that stands for many.
static void test_places(void **state)
{
    (void)state;
    expect_output("trace\n size 1 1\n draw a transparent\n layers 9\n f 0 0 x  1 1 1 1  1\nend trace\nexpect error "
                  "\"no such text\"\n",
                  0, 1, (const char *[]){"one.rtest:5:8: the depth", NULL});
    expect_output(
        "trace\n size 1 1\n draw a transparent\n layers 9 backwards\nend trace\nexpect error \"no such text\"\n", 0, 1,
        (const char *[]){"one.rtest:4:11: `backwards`, expected sorted", NULL});
    expect_output(TRACE "program\nprogram wrong\nplane z dept\nend program\nexpect error \"no such text\"\n", 0, 1,
                  (const char *[]){"one.rtest:9:9: there is no kind of plane 'dept'", NULL});
}

static void test_bless(void **state)
{
    (void)state;
    static const char before[] =
        TRACE "program layer_peel\nexpect iterations 7   # stays\nexpect pixel 0 0   0.5 0.75\t0\n"
              "expect iterations <= 2\nexpect plane z_next 0 0  near  after pass 1\n"
              "program layer_peel ideal_coherent_layer_peel coherent_layer_peel_a\nexpect iterations 9";
    static const char after[] =
        TRACE "program layer_peel\nexpect iterations 3   # stays\nexpect pixel 0 0   0.5 0.25\t0\n"
              "expect iterations <= 2\nexpect plane z_next 0 0  0.25  after pass 1\n"
              "program layer_peel ideal_coherent_layer_peel coherent_layer_peel_a\nexpect iterations 9";
    write_file("bless.rtest", before);
    trace_tests *tests = run(&(trace_test_options){.bless = true});
    assert_int_equal(trace_tests_totals(tests)->blessed, 3);
    assert_int_equal(trace_tests_totals(tests)->failed, 4);
    trace_tests_destroy(tests);
    char *text = read_file(path);
    assert_string_equal(text, after);
    free(text);
    unlink(path);
}

static void test_machine_readable(void **state)
{
    (void)state;
    char *tap = NULL;
    size_t size;
    write_file("two.rtest", TRACE "program layer_peel\nexpect exact\n"
                                  "program layer_peel\nset color_format=rgba8\nexpect error \"a < b & c\"\n");
    trace_tests *tests = run(&(trace_test_options){0});
    FILE *stream = open_memstream(&tap, &size);
    assert_int_equal(trace_tests_print_tap(tests, stream), STATUS_OK);
    fclose(stream);
    assert_non_null(strstr(tap, "TAP version 13\n1..2\nok 1 - "));
    assert_non_null(strstr(tap, "two.rtest:9 layer_peel color_format=rgba8\n#     "));
    assert_non_null(strstr(tap, "\nnot ok 2 - "));
    free(tap);
    char xml[160];
    snprintf(xml, sizeof xml, "%s/junit.xml", folder);
    assert_int_equal(trace_tests_write_junit(tests, xml, NULL), STATUS_OK);
    trace_tests_destroy(tests);
    char *text = read_file(xml);
    assert_non_null(strstr(text, "tests=\"2\" failures=\"1\""));
    assert_non_null(strstr(text, "&quot;a &lt; b &amp; c&quot;"));
    assert_non_null(strstr(text, "</testsuite>\n</testsuites>\n"));
    free(text);
    unlink(xml);
    unlink(path);
}

static void test_folders(void **state)
{
    (void)state;
    char inner[128], first[160], second[160];
    snprintf(inner, sizeof inner, "%s/inner", folder);
    assert_int_equal(mkdir(inner, 0700), 0);
    const char *paths[] = {inner};
    trace_tests *tests = NULL;
    messages kept;
    messages_start(&kept);
    assert_int_equal(trace_tests_run(paths, 1, &(trace_test_options){0}, &kept.report, &tests), STATUS_REFUSED);
    assert_non_null(strstr(kept.text, "holds no file that ends in .rtest"));
    write_file("inner/b.rtest", TRACE "program layer_peel\nexpect exact\n");
    snprintf(second, sizeof second, "%s", path);
    write_file("inner/a.rtest", TRACE "program layer_peel\nexpect not exact\n");
    snprintf(first, sizeof first, "%s", path);
    char *out[2] = {NULL};
    size_t size;
    for (int threads = 1; threads <= 2; threads++) {
        assert_int_equal(trace_tests_run(paths, 1, &(trace_test_options){.threads = threads}, NULL, &tests), STATUS_OK);
        FILE *stream = open_memstream(&out[threads - 1], &size);
        trace_tests_print_tap(tests, stream);
        fclose(stream);
        trace_tests_destroy(tests);
    }
    assert_string_equal(out[0], out[1]);
    assert_true(strstr(out[0], "a.rtest") < strstr(out[0], "b.rtest"));
    free(out[0]);
    free(out[1]);
    unlink(first);
    unlink(second);
    rmdir(inner);
    assert_int_equal(trace_tests_run(paths, 1, &(trace_test_options){0}, NULL, &tests), STATUS_IO);
}

// A run that is stopped after a pass holds in its planes what the history tells of that pass.
static void test_stop_after_pass(void **state)
{
    (void)state;
    static const char text[] =
        "ropsim-trace 1\nsize 2 1\ndraw a transparent\n"
        "f 0 0 0.8 1 0 0 0.5 1\nf 0 0 0.3 1 0 0 0.5 2\nf 1 0 0.5 1 0 0 0.5 3\nf 0 0 0.4 1 0 0 0.5 4\n";
    char place[4096];
    write_file("stop.rtxt", text);
    program *program = NULL;
    machine machine;
    trace *trace = NULL;
    assert_int_equal(program_load("coherent_layer_peel_a", NULL, place, sizeof place, &program), STATUS_OK);
    assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
    assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
    for (uint64_t pass = 1; pass <= 12; pass++) {
        run_result *run = NULL;
        const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .stop_after_pass = pass};
        const history_options at = {.run = {.threads = 1, .occlusion_ratio = -1}, .pass = pass};
        assert_int_equal(replay_run(program, &machine, trace, &options, NULL, &run), STATUS_OK);
        assert_int_equal(run->geometry_passes, pass);
        for (int p = 0; p < run->plane_count; p++) {
            for (uint32_t x = 0; x < 2; x++) {
                uint32_t value[4];
                const int words = format_table[run->planes[p].format].class == FORMAT_CLASS_COLOR ? 4 : 1;
                assert_int_equal(
                    history_plane_value(program, &machine, trace, x, 0, 0, run->planes[p].name, &at, NULL, value),
                    STATUS_OK);
                assert_memory_equal(value, run->plane_values[p] + x * (uint32_t)words, (size_t)words * sizeof *value);
            }
        }
        result_destroy(run);
    }
    trace_close(trace);
    program_destroy(program);
    unlink(path);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state)
{
    (void)state;
    snprintf(path, sizeof path, "%s/one.rtest", folder);
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_passes),  cmocka_unit_test(test_failures),        cmocka_unit_test(test_wrong_files),
        cmocka_unit_test(test_places),  cmocka_unit_test(test_bless),           cmocka_unit_test(test_machine_readable),
        cmocka_unit_test(test_folders), cmocka_unit_test(test_stop_after_pass),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
