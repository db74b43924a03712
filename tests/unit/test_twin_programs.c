// The shipped programs on random images and machines: the replay equals its twin in every count, plane value and
// pixel. ROPSIM_TEST_SEED and ROPSIM_TEST_COUNT (images a machine) make other and longer runs.
#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <string.h>

enum { PROGRAM_MAX = 64, USUAL_COUNT = 20 };

static uint64_t random_limit(dice *dice)
{
    return dice_chance(dice, 70) ? 0 : 1 + dice_below(dice, 3);
}

static double random_ratio(dice *dice)
{
    return dice_chance(dice, 70) ? -1.0 : dice_chance(dice, 50) ? 0.0 : (double)dice_unit(dice) * 0.3;
}

// Each image through all programs, on a machine with random settings.
static void run_programs(const char *machine_name)
{
    static char names[PROGRAM_MAX][NAME_SIZE];
    program *programs[PROGRAM_MAX];
    const int count = data_names("programs", ".rop", names, PROGRAM_MAX);
    assert_true(count >= 4);
    for (int p = 0; p < count; p++) {
        char path[4096], words[NAME_SIZE + 16];
        // Lists of two, so that some overflow.
        snprintf(words, sizeof words, "%.63s%s", names[p], strcmp(names[p], "a_buffer") == 0 ? ",entries=2" : "");
        assert_int_equal(program_load(words, NULL, path, sizeof path, &programs[p]), STATUS_OK);
    }
    for (uint32_t i = 0; i < test_count(USUAL_COUNT); i++) {
        dice dice = {(test_seed() << 32) + i};
        twin_image image;
        machine machine;
        random_image(&dice, dice_chance(&dice, 10), &image);
        random_machine(&dice, machine_name, &machine);
        const uint64_t limit = random_limit(&dice);
        const double ratio = random_ratio(&dice);
        char label[64];
        snprintf(label, sizeof label, "image %u of seed %llu", i, (unsigned long long)test_seed());
        for (int p = 0; p < count; p++)
            assert_true(!runs_on(programs[p], &machine) ||
                        same_as_twin(programs[p], &machine, &image, limit, ratio, label));
        random_image_free(&image);
    }
    for (int p = 0; p < count; p++)
        program_destroy(programs[p]);
}

static void programmable_equals_twin(void **state)
{
    (void)state;
    run_programs("programmable");
}

static void g80_equals_twin(void **state)
{
    (void)state;
    run_programs("g80");
}

static void tiny_equals_twin(void **state)
{
    (void)state;
    run_programs("tiny");
}

static void abuffer_equals_twin(void **state)
{
    (void)state;
    run_programs("abuffer");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(programmable_equals_twin),
        cmocka_unit_test(g80_equals_twin),
        cmocka_unit_test(tiny_equals_twin),
        cmocka_unit_test(abuffer_equals_twin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
