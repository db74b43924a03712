// What every build must agree on: angles, recordings to the last bit, and the page about scenes.
#include "raster_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>
#include <cmocka.h>

static void angles_are_accurate(void **state)
{
    (void)state;
    for (int i = -4000; i <= 4000; i++) {
        double turns = i / 1234.5, sine, cosine;
        angle_sin_cos(turns, &sine, &cosine);
        assert_true(fabs(sine - sin(turns * 6.283185307179586476925)) < 1e-14 &&
                    fabs(cosine - cos(turns * 6.283185307179586476925)) < 1e-14);
        assert_true(fabs(sine * sine + cosine * cosine - 1) < 1e-15);
    }
}

// The content hash of small recordings, the same for every compiler and optimisation level. A change here is a change
// of pictures: it needs a line in CHANGELOG.
static void recordings_are_the_same_everywhere(void **state)
{
    (void)state;
    static const char *const golden[][2] = {
        {"scene:slices_cone,slices=20", "bbd4c5fd0662b2b92321b8e2195db535"},
        {"scene:knot", "d57b8e7147bcd52bec15dd6082172308"},
        {"scene:soup", "46969178a7fd83f563daf4e82b6de978"},
        {"scene:sheets", "33a1d7dce4c7d8dfab23433cacfd52f6"},
    };
    char path[] = "/tmp/ropsim-record-XXXXXX.ropt";
    int file = mkstemps(path, 5);
    assert_true(file >= 0);
    close(file);
    for (size_t i = 0; i < sizeof golden / sizeof *golden; i++) {
        record_options options;
        trace *trace;
        record_defaults(&options);
        options.width = options.height = 200;
        options.samples = 2;
        assert_int_equal(record_scenes(&golden[i][0], 1, &options, path, NULL), STATUS_OK);
        assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
        assert_string_equal(trace_get_info(trace)->hash, golden[i][1]);
        trace_close(trace);
    }
    unlink(path);
}

// docs/record.md shows what `ropsim record --scenes` prints.
static void the_page_lists_the_scenes(void **state)
{
    (void)state;
    static char page[1 << 16];
    FILE *file = fopen(ROPSIM_SOURCE "/docs/record.md", "r");
    assert_non_null(file);
    page[fread(page, 1, sizeof page - 1, file)] = 0;
    fclose(file);
    FILE *printed = tmpfile();
    char line[512], indented[520];
    assert_non_null(printed);
    record_print_scenes(printed);
    rewind(printed);
    int lines = 0;
    while (fgets(line, sizeof line, printed)) {
        snprintf(indented, sizeof indented, "    %s", line);
        if (!strstr(page, indented))
            fail_msg("docs/record.md lacks: %s", line);
        lines++;
    }
    fclose(printed);
    assert_true(lines > 15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angles_are_accurate),
        cmocka_unit_test(recordings_are_the_same_everywhere),
        cmocka_unit_test(the_page_lists_the_scenes),
    };
    return cmocka_run_group_tests_name("record_golden", tests, NULL, NULL);
}
