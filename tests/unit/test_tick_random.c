// Random machines, images and shipped programs through the fast machine and the slow one (tests/tick): the same bytes, and
// cycles that differ by at most 2 %. Prints how many passes are equal to the cycle.
//
// ROPSIM_TEST_SEED and ROPSIM_TEST_COUNT (machines) make other and longer runs; ROPSIM_TICK_ONLY=WORD runs
// only what has WORD in its label, ROPSIM_TICK_EXACT=1 asks for equal cycles.
#include "../tick/tick_compare.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { PROGRAM_MAX = 64, USUAL_COUNT = 60, PROGRAMS_A_MACHINE = 2, MAX_ITERATIONS = 2 };

static void random_machines(void **state)
{
    static const char *const bases[] = {"tiny", "g80", "programmable", "modern", "tiled", "abuffer"};
    static char names[PROGRAM_MAX][NAME_SIZE];
    const uint32_t count = (uint32_t)data_names("programs", ".rop", names, PROGRAM_MAX);
    tick_measure measure = {0};
    bool good = true;
    (void)state;
    for (uint32_t i = 0; i < test_count(USUAL_COUNT); i++) {
        dice dice = {(test_seed() << 32) + i};
        const char *base = bases[dice_below(&dice, sizeof bases / sizeof *bases)];
        twin_image image;
        machine machine;
        random_image(&dice, false, &image);
        tick_random_machine(&dice, base, &machine);
        trace *trace = random_image_open(&image);
        for (int k = 0; k < PROGRAMS_A_MACHINE; k++) {
            const char *name = names[dice_below(&dice, count)];
            char label[TICK_LABEL_SIZE];
            program *program = tick_program(name);
            snprintf(label, sizeof label, "machine %u of seed %llu from %s, %.63s", i, (unsigned long long)test_seed(), base,
                     name);
            const char *only = getenv("ROPSIM_TICK_ONLY");
            if ((!only || strstr(label, only)) && runs_on(program, &machine) && !tick_compare(program, &machine, trace, MAX_ITERATIONS, label, 0.02, &measure))
                good = false;
            program_destroy(program);
        }
        trace_close(trace);
        random_image_free(&image);
    }
    tick_print_measure("random machines", &measure);
    assert_true(good);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(random_machines)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
