// What tile.c and fixed_point.c share: one thread's view of the tile that it runs.
#ifndef ROPSIM_TILE_H
#define ROPSIM_TILE_H

#include "expand.h"
#include "foregone.h"
#include "replay.h"

typedef struct count_site { uint32_t at; uint8_t query; } count_site;  // a `count` instruction
typedef struct noted { uint64_t count, threshold; outcome outcome; } noted;

struct worker {
    const plan *plan;
    global *global;
    const bins *bins;
    const bin *bin;
    tile_plane planes[PLANE_MAX];
    expander *expander;
    uint64_t *counts;
    uint32_t count_total;
    count_site *sites;                  // kernel k's are those from site_start[k] to site_start[k + 1]
    uint32_t site_start[KERNEL_MAX + 1];
    uint32_t *stores;                   // `st` instructions, in counts: kernel k's from store_start[k] to store_start[k + 1]
    uint32_t store_start[KERNEL_MAX + 1];
    foresight foresight;
    bool failed;

    // The iteration being run: its loop, the conditions that it met, and the state at its head.
    int loop;                       // step of its `repeat`, or -1
    noted noted[EVALUATION_MAX];
    int noted_count;                // -1: too many to keep
    bool has_snapshot, fixed;
    uint32_t *snapshot;             // planes in order of their numbers
    uint64_t query_snapshot[QUERY_MAX];
    uint64_t *before, *delta;       // counts at its head; counts of one iteration at the fixed point
    uint64_t draws_before, draws_each;  // the same of draws that ended
};

uint32_t plane_words(const plan *plan, int plane);
uint32_t tile_number(const worker *worker);           // of the tile at hand, which has a bin

void fixed_start(worker *worker, const tile *tile);   // a tile begins or resumes
void fixed_note(worker *worker, uint64_t count, uint64_t threshold, outcome outcome);  // it met a condition
void fixed_enter(worker *worker);                     // it enters a loop anew: what came before was no iteration
void fixed_head(worker *worker, tile *tile, int loop);  // it stands at the head of a loop's body

#endif
