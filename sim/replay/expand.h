// Dense batches of a bin as batches of 64 lanes, ready for dispatch.
#ifndef ROPSIM_EXPAND_H
#define ROPSIM_EXPAND_H

#include "replay.h"

// Puts dense 32-bit values at the lanes of a mask; other lanes stay.
void expand_lanes(uint32_t *lanes_out, const void *dense, uint64_t lanes);

typedef struct expander expander;
expander *expander_create(const bound_program *bound);
void expander_destroy(expander *expander);
// Forgets what was expanded: the next batches are of this bin.
void expander_start(expander *expander, const bins *bins, const bin *bin);
// Batch r of the bin, with only these of its lanes. Valid until the next call.
const batch *expander_batch(expander *expander, uint32_t r, uint64_t lanes);

#endif
