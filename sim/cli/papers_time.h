// The parts of `ropsim papers --time` and `--gain`: programs timed at the level cycle, and the printing of it.
//
// --time: fixed-function programs on the paper's card, beside its frame rates. --gain: free kernels on the same card
// with a programmable ROP, over the slots a clock that its kernel unit has.
#ifndef PAPERS_TIME_H
#define PAPERS_TIME_H

#include "papers.h"

#include "../levels.h"

#define PAPER_MACHINE(name, file, key, value, second_key, second_value, meaning) PAPER_MACHINE_##name,
typedef enum paper_machine {
#include "papers.def"
    PAPER_MACHINE_COUNT
} paper_machine;
#define PAPER_TIMED(program, column, on_meshes) PAPER_TIMED_##program,
typedef enum paper_timed {
#include "papers.def"
    PAPER_TIMED_COUNT
} paper_timed;
#define PAPER_CLAIM(text, place, slower, faster, low, high) +1
enum {
    PAPER_CLAIM_COUNT = 0
#include "papers.def"
};
#define PAPER_GAINER(name, words, meaning) PAPER_GAINER_##name,
enum {
#include "papers.def"
    PAPER_GAINER_COUNT
};
#define PAPER_SLOTS(number) +1
enum {
    PAPER_SLOTS_COUNT = 0
#include "papers.def"
};

// ---- Tables (papers_tables.c) --------------------------------------------------------------------------

typedef struct paper_machine_row {
    const char *name, *file;
    const char *settings[2][2];  // keys and values; NULL: none
    const char *meaning;
} paper_machine_row;

typedef struct paper_timed_row {
    const char *name;
    bool in_paper, on_meshes;
    size_t iterations, fps;  // offsets in paper_row, if in_paper
    uint64_t passes_an_iteration;
} paper_timed_row;

typedef struct paper_claim_row {
    const char *text, *place;
    paper_timed slower, faster;
    double low, high;
} paper_claim_row;

typedef struct paper_gainer_row {
    const char *name, *words, *meaning;
} paper_gainer_row;

extern const paper_machine_row paper_machines[PAPER_MACHINE_COUNT];
extern const paper_timed_row paper_timed_rows[PAPER_TIMED_COUNT];
extern const paper_claim_row paper_claims[PAPER_CLAIM_COUNT];
extern const paper_gainer_row paper_gainers[PAPER_GAINER_COUNT];
extern const int64_t paper_slots[PAPER_SLOTS_COUNT];

// ---- Timing one program (papers_timer.c) ---------------------------------------------------------------

typedef struct paper_time {
    bool known;  // was run at the level cycle
    uint64_t iterations, passes, unsorted, sorted, composited;
    double max_abs;
    uint64_t cycles;  // until everything is drained
    double seconds;
    double last_seconds;                    // of that, the last iteration, which finds nothing
    uint64_t bound_by[RESOURCE_COUNT + 1];  // cycles of the passes that the resource bounds
    statistics total;
} paper_time;

typedef struct paper_timer paper_timer;
// `out`: where a JSON a run and `csv` go, NULL: nowhere. `runs`: to come, for the progress. Free with
// paper_timer_destroy.
status paper_timer_create(const run_options *run, const char *out, const char *csv, uint64_t runs, paper_timer **timer);
// The scene as a trace, which the caller closes.
status paper_timer_record(paper_timer *timer, const char *subject, const char *scene, const record_options *options,
                          trace **trace);
// Runs the program at the level cycle. `note` tells runs of one program on one subject and machine apart.
status paper_timer_run(paper_timer *timer, trace *trace, const char *subject, const char *program,
                       const machine *machine, const char *note, paper_time *time);
// Counts alone, the level function; a step of the progress as well.
status paper_timer_count(paper_timer *timer, trace *trace, const char *program, const machine *machine,
                         paper_time *time);
void paper_timer_skip(paper_timer *timer, uint64_t runs);  // that will not come
status paper_timer_finish(paper_timer *timer);             // writes the CSV
void paper_timer_destroy(paper_timer *timer);              // NULL is fine

// The resource whose passes took most of the time, and its share of it.
clock_resource paper_time_bound(const paper_time *time, double *share);

// ---- --time (papers_time.c, papers_time_print.c) -------------------------------------------------------

// A subject on the card, and with a float depth buffer where that makes a difference.
typedef struct paper_timing {
    const paper_subject *subject;  // NULL: slices
    uint32_t slices;
    uint64_t triangles, fragments;
    paper_time times[2][PAPER_TIMED_COUNT];
} paper_timing;

enum { PAPER_SLICE_STEPS = 3 };  // a quarter, half and all of the slices
typedef struct paper_timings {
    paper_timing slices[PAPER_SLICE_STEPS];
    paper_timing *subjects;  // malloc, setup's subject_count
} paper_timings;

// The machines of PAPER_MACHINE with the user's --set under their own keys.
typedef struct paper_machine_set {
    machine machines[PAPER_MACHINE_COUNT];
} paper_machine_set;

status paper_time_all(const paper_setup *setup, const paper_machine_set *machines, const run_options *run,
                      const char *out);
void paper_print_time_intro(const paper_setup *setup, const paper_machine_set *machines);
void paper_print_slices(const paper_setup *setup, const paper_timings *timings);
void paper_print_times(const paper_setup *setup, const paper_timings *timings);

// ---- --gain (papers_gain.c, papers_gain_print.c, papers_gain_svg.c) ------------------------------------

enum {
    PAPER_GAIN_FORMATS = 2,
    PAPER_GAIN_GUARDS = 2
};  // PAPER_MACHINE_rop and _rop_wide; kernel_guarded_slots 1 and 0
typedef struct paper_gain {
    char label[PAPER_LABEL_SIZE];
    uint64_t triangles, fragments;
    // Of the level cycle, on the same machine: fixed-function programs, then each free kernel. A rate that is not known
    // was not run, since the one before had gained less than PAPER_GAIN_LEAST over its own predecessor.
    paper_time peel[PAPER_GAIN_FORMATS], coherent[PAPER_GAIN_FORMATS];
    paper_time times[PAPER_GAIN_FORMATS][PAPER_GAIN_GUARDS][PAPER_GAINER_COUNT][PAPER_SLOTS_COUNT];
} paper_gain;
extern const double PAPER_GAIN_LEAST;
static inline int paper_gain_guards(int formats)
{
    return formats == 0 ? PAPER_GAIN_GUARDS : 1;
}

typedef struct paper_gains {
    paper_gain *gains;  // malloc
    int count;
} paper_gains;

status paper_gain_all(const paper_setup *setup, const paper_machine_set *machines, const run_options *run,
                      const char *out, const char *svg);
// Seconds at a rate, the last known one's if it was not run.
double paper_gain_seconds(const paper_time times[PAPER_SLOTS_COUNT], int slots);
// Slots a clock at which the times meet `seconds`: between two rates as if time were a + b / slots. 0: faster at the
// least rate already; infinity: never.
double paper_gain_meets(const paper_time times[PAPER_SLOTS_COUNT], double seconds);
void paper_print_gain_intro(const paper_setup *setup, const paper_machine_set *machines);
void paper_print_gain(const paper_gain *gain);
void paper_print_gain_summary(const paper_gains *gains);
// Speed over layer peeling against slots, in the card's formats; a panel a subject.
status paper_gain_svg(const paper_gains *gains, const char *path);

#endif
