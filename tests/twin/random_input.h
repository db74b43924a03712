// Random traces and programs for comparisons of the replay with its twin. Everything follows from the seed.
#ifndef ROPSIM_RANDOM_INPUT_H
#define ROPSIM_RANDOM_INPUT_H

#include "twin.h"

typedef struct dice {
    uint64_t state;
} dice;
uint64_t dice_next(dice *dice);
uint32_t dice_below(dice *dice, uint32_t count);  // 0 .. count - 1
bool dice_chance(dice *dice, uint32_t percent);
float dice_unit(dice *dice);  // 0 .. 1, both possible

// A trace of up to 40 x 24 pixels in draws of mixed classes, with few distinct depths, depths at and beyond the
// planes, alpha of 0 and 1, blocks in and against order, empty regions; sometimes nothing at all.
// nonfinite: with infinities and NaN among depths and colours.
void random_image(dice *dice, bool nonfinite, twin_image *image);
void random_image_free(twin_image *image);
// Writes it to a file of its own in /tmp, which it removes, and opens it. Fails the test if it cannot.
trace *random_image_open(const twin_image *image);

// A program text: every opcode, blend state, stencil operation and step may occur; its loops need a limit.
// fixed_function: declared passes only.
typedef struct program_text {
    char text[65536];
    size_t size;
} program_text;
void random_program(dice *dice, bool fixed_function, program_text *text);

// A machine by name with random formats and widths.
void random_machine(dice *dice, const char *name, machine *machine);

bool runs_on(const program *program, const machine *machine);  // no part of it is refused
// Replays and compares in several ways of running: threads, vector widths, budgets of memory. Returns false and
// prints what differs, with the program, if anything does.
bool same_as_twin(const program *program, const machine *machine, const twin_image *image, uint64_t max_iterations,
                  double occlusion_ratio, const char *label);

extern const report printing;  // prints every message

// ROPSIM_TEST_SEED and ROPSIM_TEST_COUNT, or the given ones.
uint64_t test_seed(void);
uint32_t test_count(uint32_t usual);

#endif
