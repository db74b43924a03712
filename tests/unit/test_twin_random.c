// Random programs on random images and machines: the replay equals its twin in every count, plane value and pixel.
// ROPSIM_TEST_SEED and ROPSIM_TEST_COUNT (programs a test) make other and longer runs.
#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

static void run_random(const char *machine_name, bool fixed_function, uint32_t usual)
{
    static program_text text;
    uint32_t ran = 0;
    for (uint32_t i = 0; i < test_count(usual); i++) {
        dice dice = {(test_seed() << 32) + i};
        twin_image image;
        machine machine;
        program *program;
        char label[64];
        snprintf(label, sizeof label, "program %u of seed %llu", i, (unsigned long long)test_seed());
        random_image(&dice, dice_chance(&dice, 10), &image);
        random_machine(&dice, machine_name, &machine);
        random_program(&dice, fixed_function, &text);
        if (assemble_text(label, text.text, text.size, &printing, &program) != STATUS_OK) {
            fputs(text.text, stdout);
            fail();
        }
        const uint64_t limit = dice_chance(&dice, 80) ? 0 : 1 + dice_below(&dice, 3);
        const bool runs = runs_on(program, &machine);
        assert_true(!runs || same_as_twin(program, &machine, &image, limit, -1.0, label));
        ran += runs;
        program_destroy(program);
        random_image_free(&image);
    }
    assert_true(ran >= test_count(usual) / 2);  // a machine with few stencil bits refuses some references
}

static void kernels_and_passes_equal_twin(void **state)
{
    (void)state;
    run_random("programmable", false, 150);
}

static void passes_equal_twin(void **state)
{
    (void)state;
    run_random("g80", true, 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_and_passes_equal_twin),
        cmocka_unit_test(passes_equal_twin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
