// The shipped programs on the shipped machines, through the fast machine and the slow one (tests/tick): the same bytes, and
// cycles that differ by at most 2 %. Prints how many passes are equal to the cycle.
//
// ROPSIM_TICK_ONLY=WORD runs only what has WORD in its label; ROPSIM_TICK_EXACT=1 asks for equal cycles.
#include "../tick/tick_compare.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { PROGRAM_MAX = 64, MAX_ITERATIONS = 4 };

static const char *const machines[] = {"tiny", "g80", "programmable", "modern", "tiled", "abuffer"};

static bool wanted(const char *label)
{
    const char *only = getenv("ROPSIM_TICK_ONLY");
    return !only || strstr(label, only);
}

static bool all_programs(const char *machine_name, trace *trace, const char *trace_name, tick_measure *measure)
{
    static char names[PROGRAM_MAX][NAME_SIZE];
    const int count = data_names("programs", ".rop", names, PROGRAM_MAX);
    machine machine;
    bool good = true;
    assert_int_equal(machine_load(machine_name, &printing, &machine), STATUS_OK);
    for (int p = 0; p < count; p++) {
        // abuffer is programmable but for its lists.
        if (strcmp(machine_name, "abuffer") == 0 && strcmp(names[p], "a_buffer") != 0)
            continue;
        char label[TICK_LABEL_SIZE];
        program *program = tick_program(names[p]);
        snprintf(label, sizeof label, "%s, %.63s, %s", machine_name, names[p], trace_name);
        if (wanted(label) && runs_on(program, &machine))
            good &= tick_compare(program, &machine, trace, MAX_ITERATIONS, label, 0.02, measure);
        program_destroy(program);
    }
    return good;
}

static void on_each_machine(trace *trace, const char *trace_name)
{
    bool good = true;
    for (size_t m = 0; m < sizeof machines / sizeof *machines; m++) {
        tick_measure measure = {0};
        char title[TICK_LABEL_SIZE];
        good &= all_programs(machines[m], trace, trace_name, &measure);
        snprintf(title, sizeof title, "%s, %s", machines[m], trace_name);
        tick_print_measure(title, &measure);
    }
    trace_close(trace);
    assert_true(good);
}

static void traces(void **state)
{
    static const char *const names[] = {"classes", "edge_samples", "empty", "figure2", "finished_sample", "opaque", "ties"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char file[64];
        snprintf(file, sizeof file, "%s.rtxt", names[i]);
        on_each_machine(tick_trace(file), names[i]);
    }
}

static void soup(void **state)
{
    (void)state;
    on_each_machine(tick_scene("scene:soup,count=20", 48, 1), "soup");
}

static void knot(void **state)
{
    (void)state;
    on_each_machine(tick_scene("scene:knot,rings=40,sides=6", 32, 1), "knot");
}

static void sheets(void **state)
{
    (void)state;
    on_each_machine(tick_scene("scene:sheets,count=8,order=shuffled", 16, 4), "sheets of 4 samples");
}

static void slices_cone(void **state)
{
    (void)state;
    on_each_machine(tick_scene("scene:slices_cone,slices=10,grid=4", 16, 4), "slices_cone of 4 samples");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(traces), cmocka_unit_test(soup),        cmocka_unit_test(knot),
        cmocka_unit_test(sheets), cmocka_unit_test(slices_cone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
