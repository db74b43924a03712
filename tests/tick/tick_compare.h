// A program, a machine and a trace in; how far apart sim/mem and sim/clock are from the slow machine out.
#ifndef ROPSIM_TEST_TICK_COMPARE_H
#define ROPSIM_TEST_TICK_COMPARE_H

#include "tick.h"

#include "../twin/random_input.h"

enum { TICK_LABEL_SIZE = 512 };

typedef struct tick_measure {
    uint64_t runs, passes, equal;          // equal: passes with the same cycles, last fragments' too
    uint64_t runs_equal;                   // runs with the same cycles in total
    uint64_t off_by_1, within_permille;    // passes that differ by one cycle; by at most a thousandth; not counted twice
    double worst_pass, worst_run;          // largest relative difference
    char worst_pass_label[TICK_LABEL_SIZE], worst_run_label[TICK_LABEL_SIZE];
    uint64_t cycles, traffic_checked;      // of the slow machine, summed; counts that were compared
} tick_measure;

// Runs both machines, loops at most `max_iterations` times (0: as often as the program wants). False, and a message, if bytes differ, a check of the run fails, a pass is shorter than its bounds,
// or cycles of a pass or of the run differ by more than `tolerance`.
bool tick_compare(const program *program, const machine *machine, trace *trace, uint64_t max_iterations, const char *label,
                  double tolerance, tick_measure *measure);
void tick_print_measure(const char *title, const tick_measure *measure);

// Opens shipped machines, programs and traces, and small scenes. They fail the test if they cannot.
program *tick_program(const char *words);
trace *tick_scene(const char *scene, uint32_t size, uint32_t samples);
trace *tick_trace(const char *name);  // of traces/

// The machine of that name with every key of time and traffic thrown by dice (tick_random.c).
void tick_random_machine(dice *dice, const char *name, machine *machine);

#endif
