// The `list` step on one tile.
#ifndef ROPSIM_FRAGMENT_LIST_H
#define ROPSIM_FRAGMENT_LIST_H

#include "replay.h"

// Keeps the first `step->entries` fragments of each sample that lie in front of plane `step->source`, sorts them and blends them
// into plane `step->plane`. Adds to *kept and *lost. False: out of memory.
bool fragment_list_run(const plan *plan, const step *step, const bins *bins, const bin *bin, const tile_plane *planes,
                       uint64_t *kept, uint64_t *lost);

#endif
