// What the ranks of a sweep say to each other. All run the same command, so that a struct is the same on each.
//
//   rank 0                                           the others
//   (opens the sweep, records its scenes)
//   TAG_BEGIN: the plan can be read              ->
//                                               <-   TAG_READY, or why it is not
//   TAG_RUN: a run for one of your slots         ->
//                                               <-   TAG_ROW: what came of it
//   TAG_BEAT: I am alive, each second             <-> TAG_BEAT
//   TAG_END                                      ->
//                                                    (drops what is on its way)
#ifndef ROPSIM_SWEEP_RANKS_H
#define ROPSIM_SWEEP_RANKS_H

#include "module/sweep_mpi.h"
#include "sweep.h"

typedef enum rank_tag { TAG_BEGIN = 1, TAG_READY, TAG_RUN, TAG_ROW, TAG_BEAT, TAG_END } rank_tag;

// Another version would give other figures under our version's name.
typedef struct rank_ready {
    char version[32], host[64];
    char why[SWEEP_WHY_SIZE];  // empty: it is
} rank_ready;

// The hashes and the level say which run rank 0 means by the index.
typedef struct rank_run {
    int slot;
    uint64_t index;
    char detail[NAME_SIZE];
    char program_hash[33], trace_hash[33], variant_hash[33];
} rank_run;

typedef struct rank_row {
    int slot;
    uint64_t index;
    sweep_row row;
} rank_row;

typedef union rank_message {
    rank_ready ready;
    rank_run run;
    rank_row row;
} rank_message;

struct sweep_ranks {
    const mpi_functions *mpi;
    const report *report;
    int rank, count, silence;
    double beat;  // when the last was sent
    int lost;     // ranks that were given up
    bool ended;   // TAG_END was sent
};

double ranks_now(void);  // seconds
// These report what goes wrong.
status ranks_send(sweep_ranks *ranks, int to, rank_tag tag, const void *data, size_t size);
status ranks_take(sweep_ranks *ranks, int *from, rank_tag *tag, rank_message *message);  // *from -1: nothing there
bool ranks_beat_is_due(sweep_ranks *ranks);
void ranks_end(sweep_ranks *ranks);  // of rank 0: lets the others go, once

#endif
