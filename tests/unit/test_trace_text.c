// The text form: what is read, what is refused, and where the message points.
#include "trace_random.h"

#include <locale.h>
#include <math.h>

// "" if the text opens as a trace; else the message without its path.
static const char *verdict(const char *text, size_t size)
{
    const char *path = test_path("text.rtxt");
    put_file(path, text, size);
    said[0] = 0;
    if (trace_check(path, &keeping) == STATUS_OK)
        return "";
    assert_ptr_equal(strstr(said, path), said);
    return said + strlen(path) + 1;
}

#define START "ropsim-trace 1\nsize 4 3\n"
#define DRAWN START "draw a transparent\n"

static const struct text_case {
    const char *text, *message;  // the message's beginning; "": the text holds
} text_cases[] = {
    {START, ""},
    {START "# only this", ""},
    {"ropsim-trace 1\r\nsize 4 3\r\ndraw a sorted 1 3\r\nf 0 0 0 0 0 0 0 0\r\n", ""},
    {"ropsim-trace 1 # comment\n\n \t\nsize 4 3 # comment\n", ""},
    {DRAWN "f 3 2 0x1.8p-1  1 0 0 .5  4294967295\n", ""},
    {DRAWN "f 3 2 0X.8 +1. -0 1e-400 1e0 0 # comment", ""},
    {DRAWN "f 0 0 -3 1e38 0 0 0 0\nf 0 0 2 0 0 0 0 0\n", ""},
    {"ropsim-trace 1 nonfinite\nsize 1 1\ndraw a opaque\nf 0 0 inf nan -inf +inf 0 0\n", ""},
    {START "samples 2\npositions -128 127 0 -1\ndepth reversed\ndepth_bits 32\nbackground 0 0 0 1\ndraw a sorted\nf 0 "
           "0 0.1 0 0 0 0 0 1",
     ""},
    {START "depth normal\ndepth_bits 64\n", ""},
    {"ropsim-trace", "1:13: too few fields"},
    {"ropsim-trace 2\n", "1:14: version '2', only version 1"},
    {"ropsim-trace 1 finite\n", "1:16: 'finite', expected nonfinite"},
    {"ropsim-trace 1\n", "2:1: no `size WIDTH HEIGHT` line"},
    {"ropsim-trace 1\nsize 4\n", "2:7: too few fields; expected: size WIDTH HEIGHT"},
    {"ropsim-trace 1\nsize 4 3 2\n", "2:10: too many fields"},
    {"ropsim-trace 1\nsize 0 3\n", "2:6: size 0, expected 1 to 32768"},
    {"ropsim-trace 1\nsize 4 0\n", "2:8: size 0, expected 1 to 32768"},
    {"ropsim-trace 1\nsize 32769 3\n", "2:6: the width is '32769', expected a whole number from 0 to 32768"},
    {"ropsim-trace 1\nsize 4 -3\n", "2:8: the height is '-3'"},
    {"ropsim-trace 1\nsize 4 3.0\n", "2:8: the height is '3.0'"},
    {START "size 4 3\n", "3:1: a second `size` line"},
    {START "samples 3\n", "3:9: '3' samples, expected 1, 2, 4, 8 or 16"},
    {START "samples 0\n", "3:9: '0' samples"},
    {START "positions 0 0\nsamples 1\n", "4:1: `samples` must stand before `positions`"},
    {START "positions 0 0 0 0\n", "3:15: too many fields"},
    {START "positions 0 128\n", "3:13: position '128', expected -128 to 127"},
    {START "positions 0 -129\n", "3:13: position '-129'"},
    {START "background 0 0 0\n", "3:17: too few fields"},
    {START "background 0 0 0 inf\n", "3:18: the background is 'inf'"},
    {START "depth reverse\n", "3:7: 'reverse', expected normal or reversed"},
    {START "depth_bits 16\n", "3:12: '16', expected 64 or 32"},
    {START "colour 1\n", "3:1: 'colour', expected size, samples, positions"},
    {START "f 0 0 0 0 0 0 0 0\n", "3:1: a fragment before the first `draw NAME CLASS` line"},
    {START "draw a\n", "3:7: too few fields; expected: draw NAME"},
    {START "draw a glass\n", "3:8: class 'glass', expected opaque, transparent or sorted"},
    {START "draw a sorted 1\n", "3:16: triangles without vertices"},
    {START "draw a sorted 1 18446744073709551616\n", "3:17: the number of vertices is '18446744073709551616'"},
    {START "draw \xc3\xa9 sorted\n", "3:6: the name of a draw"},
    {DRAWN "size 4 3\n", "4:1: 'size', expected f or draw"},
    {DRAWN "f 4 0 0 0 0 0 0 0\n", "4:3: x is '4', expected a whole number from 0 to 3"},
    {DRAWN "f 0 3 0 0 0 0 0 0\n", "4:5: y is '3', expected a whole number from 0 to 2"},
    {DRAWN "f 0 0 0 0 0 0 0 4294967296\n", "4:17: the primitive is '4294967296'"},
    {DRAWN "f 0 0 0 0 0 0 0 0 0\n", "4:19: too many fields; expected: f X Y DEPTH R G B A PRIMITIVE"},
    {DRAWN "f 0 0 0 0 0 0 0\n", "4:16: too few fields"},
    {START "samples 2\ndraw a sorted\nf 0 0 0 0 0 0 0 0\n",
     "5:18: too few fields; expected: f X Y DEPTH R G B A PRIMITIVE SAMPLE"},
    {START "samples 2\ndraw a sorted\nf 0 0 0 0 0 0 0 0 2\n",
     "5:19: the sample is '2', expected a whole number from 0 to 1"},
    {DRAWN "f 0 0 1,5 0 0 0 0 0\n", "4:7: the depth is '1,5', expected a decimal or hexadecimal number"},
    {DRAWN "f 0 0 0x 0 0 0 0 0\n", "4:7: the depth is '0x'"},
    {DRAWN "f 0 0 . 0 0 0 0 0\n", "4:7: the depth is '.'"},
    {DRAWN "f 0 0 1e 0 0 0 0 0\n", "4:7: the depth is '1e'"},
    {DRAWN "f 0 0 0x1p 0 0 0 0 0\n", "4:7: the depth is '0x1p'"},
    {DRAWN "f 0 0 1d 0 0 0 0 0\n", "4:7: the depth is '1d'"},
    {DRAWN "f 0 0 infinity 0 0 0 0 0\n", "4:7: the depth is 'infinity'"},
    {DRAWN "f 0 0 nan(7) 0 0 0 0 0\n", "4:7: the depth is 'nan(7)'"},
    {DRAWN "f 0 0 inf 0 0 0 0 0\n", "4:7: the depth is 'inf'; only a trace whose first line"},
    {DRAWN "f 0 0 0 nan 0 0 0 0\n", "4:9: red is 'nan'; only a trace whose first line"},
    {DRAWN "f 0 0 1e999 0 0 0 0 0\n", "4:7: the depth '1e999' is too large"},
    {DRAWN "f 0 0 0 0 0 0 1e39 0\n", "4:15: alpha '1e39' is too large"},
    {DRAWN "g 0 0 0 0 0 0 0 0\n", "4:1: 'g', expected f or draw"},
    {DRAWN "f 0 0 0\f0 0 0 0 0\n", "4:8: control byte 0x0c"},
};

static void test_texts(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof text_cases / sizeof *text_cases; i++) {
        const char *seen = verdict(text_cases[i].text, strlen(text_cases[i].text)), *expected = text_cases[i].message;
        if (expected[0] ? strncmp(seen, expected, strlen(expected)) != 0 : seen[0] != 0)
            fail_msg("case %zu: expected '%s', seen '%s'", i, expected, seen);
    }
    const char nul[] = DRAWN "f 0 0 0\0";
    assert_ptr_equal(strstr(verdict(nul, sizeof nul - 1), "4:8: control byte 0x00"),
                     said + strlen(test_path("text.rtxt")) + 1);
}

static void test_long_lines(void **state)
{
    (void)state;
    size_t size = 200000;
    char *text = malloc(size);
    memset(text, ' ', size);
    memcpy(text, START "#", sizeof START "#" - 1);
    assert_string_equal(verdict(text, sizeof START - 1 + 4096), "");
    assert_ptr_equal(strstr(verdict(text, sizeof START - 1 + 4097), "3:4097: line of more than 4096 bytes"),
                     said + strlen(test_path("text.rtxt")) + 1);
    assert_non_null(strstr(verdict(text, size), "3:4097: line of more than"));
    for (size_t i = sizeof START - 1; i < size; i += 2)
        text[i] = 'f';
    assert_non_null(strstr(verdict(text, sizeof START + 200), "more than 64 words"));
    free(text);
}

// A cut within a line is refused or reads as another number; neither crashes, and the reader never reads past the end.
static void test_every_cut_ends(void **state)
{
    (void)state;
    memory_trace *trace = random_trace(5, 2, 64, true, 40);
    char hash[33];
    assert_int_equal(write_trace(trace, test_path("cut.rtxt"), NULL, hash), STATUS_OK);
    size_t size;
    uint8_t *bytes = file_bytes(test_path("cut.rtxt"), &size);
    int refused = 0;
    for (size_t cut = 0; cut < size; cut++)
        refused += verdict((char *)bytes, cut)[0] != 0;
    assert_true(refused > (int)size / 2);
    uint64_t random = 1;
    for (int round = 0; round < 3000; round++) {
        size_t at = random_next(&random) % size;
        uint8_t before = bytes[at];
        bytes[at] = (uint8_t)random_next(&random);
        verdict((char *)bytes, size);
        bytes[at] = before;
    }
    assert_string_equal(verdict((char *)bytes, size), "");
    free(bytes);
    free(trace);
}

static void read_first(const char *text, double *depth, float *red)
{
    put_file(test_path("one.rtxt"), text, strlen(text));
    trace *trace;
    fragments run;
    assert_int_equal(trace_open(test_path("one.rtxt"), NULL, &trace), STATUS_OK);
    assert_int_equal(trace_next(trace, &run), STATUS_OK);
    assert_int_equal(run.count, 1);
    *depth = run.depth[0];
    *red = run.rgba[0][0];
    trace_close(trace);
}

static void test_numbers(void **state)
{
    (void)state;
    double depth;
    float red;
    read_first(DRAWN "f 0 0 0x1.921fb54442d18p+1 0.1 0 0 0 0\n", &depth, &red);
    assert_true(depth == 3.141592653589793 && red == 0.1f);
    read_first(DRAWN "f 0 0 -0 -0.0 0 0 0 0\n", &depth, &red);
    assert_true(depth == 0 && signbit(depth) && signbit(red));
    // 1 + 2^-24 + 2^-60 lies above the middle of two floats; by way of double it would round down
    read_first(DRAWN "f 0 0 0 1.00000005960464477625793 0 0 0 0\n", &depth, &red);
    assert_true(red == 0x1.000002p0f);
    read_first(START "depth_bits 32\ndraw a opaque\nf 0 0 0.1 0 0 0 0 0\n", &depth, &red);
    assert_true(depth == (double)0.1f);
}

// A locale with a comma as decimal point must change neither reading nor writing.
static void test_locale(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    bool set = false;
    for (size_t i = 0; !set && i < sizeof names / sizeof *names; i++)
        set = setlocale(LC_ALL, names[i]) != NULL;
    if (!set) {
        print_message("skipped: no locale with a decimal comma is installed\n");
        skip();
    }
    memory_trace *trace = random_trace(8, 1, 64, false, 100);
    char hash[33];
    assert_int_equal(write_trace(trace, test_path("comma.rtxt"), NULL, hash), STATUS_OK);
    struct trace *again;
    assert_int_equal(trace_open(test_path("comma.rtxt"), NULL, &again), STATUS_OK);
    assert_string_equal(trace_get_info(again)->hash, hash);
    trace_close(again);
    setlocale(LC_ALL, "C");
    free(trace);
}

static void test_shipped_traces_hold(void **state)
{
    (void)state;
    static const char *const names[] = {"classes",         "edge_samples", "empty", "figure2",
                                        "finished_sample", "opaque",       "ties"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s/traces/%s.rtxt", ROPSIM_SOURCE, names[i]);
        said[0] = 0;
        assert_int_equal(trace_check(path, &keeping), STATUS_OK);
        assert_string_equal(said, "");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_texts),   cmocka_unit_test(test_long_lines), cmocka_unit_test(test_every_cut_ends),
        cmocka_unit_test(test_numbers), cmocka_unit_test(test_locale),     cmocka_unit_test(test_shipped_traces_hold),
    };
    return cmocka_run_group_tests(tests, NULL, remove_test_folder);
}
