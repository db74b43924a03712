// The hand-written loop that the replay is measured against, and what it works on.
#ifndef ROPSIM_NATIVE_IDEAL_H
#define ROPSIM_NATIVE_IDEAL_H

#include "../../isa/isa.h"

// 64 lanes; absent ones have depth 0. Depth as 32-bit float codes.
typedef struct native_batch {
    uint64_t lanes;
    const uint32_t *depth;
    const float *rgba[4];
} native_batch;

// Runs the algorithm on one tile: the opaque batches first, then the others. Returns the passes it took.
typedef uint64_t native_tile_run(const native_batch *batches, uint32_t opaque_count, uint32_t count,
                                 const float background[4], float rgb[TILE_LANES][3]);
extern native_tile_run native_16, native_32, native_64;

#endif
