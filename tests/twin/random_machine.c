// A shipped machine with its settings thrown by dice.
#include "random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

static void set(machine *machine, const char *key, const char *value)
{
    char assignment[64];
    snprintf(assignment, sizeof assignment, "%s=%s", key, value);
    assert_int_equal(machine_set(machine, assignment, NULL), STATUS_OK);
}

void random_machine(dice *dice, const char *name, machine *machine)
{
    static const char *const depths[] = {"z16", "z24", "z32f"}, *const colors[] = {"rgba8", "rgba16f", "rgba32f"};
    static const char *const bits[] = {"1", "2", "3", "4", "5", "6", "7", "8"};
    assert_int_equal(machine_load(name, NULL, machine), STATUS_OK);
    if (dice_chance(dice, 70))
        set(machine, "depth_format", depths[dice_below(dice, 3)]);
    if (dice_chance(dice, 70))
        set(machine, "color_format", colors[dice_below(dice, 3)]);
    if (dice_chance(dice, 50))
        set(machine, "stencil_bits", bits[dice_below(dice, 8)]);
    if (dice_chance(dice, 30))
        set(machine, "range_clip", "interpolated");
}
