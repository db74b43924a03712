// One run, shared by the files that carry it through: replay.c sets it up, rounds.c runs the tiles, finish.c makes the result.
#ifndef ROPSIM_RUN_H
#define ROPSIM_RUN_H

#include "replay.h"

typedef struct replay {
    plan plan;
    trace *trace;
    const trace_info *info;
    const report *report;
    const run_options *options;
    const struct stamps *read;  // NULL, or the trace as a deeper level has read it
    tiling tiling;
    sample_counts counts;
    bin_request request;
    bins bins;              // of the band that is in memory
    bool whole;             // the one band is the whole image: it stays
    tile *tiles;
    uint32_t *storage;
    tile empty;             // stands for all samples of tiles without a fragment
    uint32_t *empty_storage;
    uint32_t *order;        // tiles of a band, deepest first
    global *global;
    worker **workers;
    worker *empty_worker;
    int threads;
    uint32_t order_count;
    atomic_bool failed;
    error_sum *errors;      // one a tile
    run_result *result;
    double seconds;
} replay;

// Tiles and workers, then the whole schedule (rounds.c).
status rounds_prepare(replay *replay);
status rounds_run(replay *replay);
// Calls body for each band of tiles that fits the memory budget.
typedef status band_body(replay *replay, uint32_t first, uint32_t end);
status each_band(replay *run, band_body *body);
// Makes a band's bins, unless they are there.
status load_band(replay *replay, uint32_t first, uint32_t end);

// Counts, image, error (finish.c).
status finish_run(replay *replay, const machine *machine);

#endif
