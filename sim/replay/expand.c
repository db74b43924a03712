// Dense batches in, 64 lanes out. A full batch, and one of 64 places, is used where it lies. Others are spread over lanes once a
// visit of a tile and kept, as long as the tile's batches fit a second-level cache; a tile runs all its passes
// over them. What does not fit is spread anew for each pass.
#include "expand.h"

#include <stdlib.h>

enum { CACHE_BYTES = 768 * 1024 };

struct expander {
    const bins *bins;
    const bin *bin;
    bool formats[FORMAT_COUNT], color, primitive;
    uint32_t slot_words, slot_count;
    uint32_t *slots;       // the last one serves all batches that have none of their own
    uint64_t *stamps;      // the visit for which a slot was filled
    uint64_t visit;
    batch batch;
};

expander *expander_create(const bound_program *bound)
{
    expander *e = calloc(1, sizeof *e);
    if (!e)
        return NULL;
    uint32_t columns = 0;
    for (int f = 0; f < FORMAT_COUNT; f++)
        columns += e->formats[f] = bound_depth_formats(bound) >> f & 1;
    e->color = bound_reads(bound, SOURCE_FRAGMENT_COLOR) || bound_reads(bound, SOURCE_FRAGMENT_PREMUL);
    e->primitive = bound_reads(bound, SOURCE_PRIMITIVE);
    columns += (e->color ? 4 : 0) + e->primitive;
    e->slot_words = (columns ? columns : 1) * TILE_LANES;
    e->slot_count = CACHE_BYTES / (e->slot_words * (uint32_t)sizeof(uint32_t));
    e->slots = aligned_alloc(64, (size_t)e->slot_count * e->slot_words * sizeof *e->slots);
    e->stamps = calloc(e->slot_count, sizeof *e->stamps);
    if (!e->slots || !e->stamps) {
        expander_destroy(e);
        return NULL;
    }
    for (size_t i = 0; i < (size_t)e->slot_count * e->slot_words; i++)
        e->slots[i] = 0;  // lanes without a fragment are read, if not used
    return e;
}

void expander_destroy(expander *e)
{
    if (!e)
        return;
    free(e->slots);
    free(e->stamps);
    free(e);
}

void expander_start(expander *e, const bins *bins, const bin *bin)
{
    e->bins = bins;
    e->bin = bin;
    e->visit++;
}

void expand_lanes(uint32_t *lanes_out, const void *dense, uint64_t lanes)
{
    const uint32_t *from = dense;
    for (; lanes; lanes &= lanes - 1)
        lanes_out[__builtin_ctzll(lanes)] = *from++;
}

// Points the batch at its columns: dense ones at `offset`, or those of a slot, which are filled if asked for.
static void point_at(expander *e, const bin_batch *from, uint32_t *slot, bool fill)
{
    const bins *bins = e->bins;
    for (int f = 0; f < FORMAT_COUNT; f++) {
        if (!e->formats[f])
            continue;
        if (fill)
            expand_lanes(slot, bins->codes[f] + from->offset, from->lanes);
        e->batch.depth[f] = slot ? slot : bins->codes[f] + from->offset;
        slot = slot ? slot + TILE_LANES : NULL;
    }
    if (e->primitive) {
        if (fill)
            expand_lanes(slot, bins->primitive + from->offset, from->lanes);
        e->batch.primitive = slot ? slot : bins->primitive + from->offset;
        slot = slot ? slot + TILE_LANES : NULL;
    }
    for (int c = 0; e->color && c < 4; c++) {
        if (fill)
            expand_lanes(slot, bins->rgba[c] + from->offset, from->lanes);
        e->batch.rgba[c] = slot ? (const float *)(const void *)slot : bins->rgba[c] + from->offset;
        slot = slot ? slot + TILE_LANES : NULL;
    }
}

const batch *expander_batch(expander *e, uint32_t r, uint64_t lanes)
{
    const bin_batch *from = &e->bins->batches[e->bin->first_batch + r];
    e->batch.lanes = lanes;
    if (e->bins->shared || from->lanes == UINT64_MAX) {
        point_at(e, from, NULL, false);
        return &e->batch;
    }
    const bool own = r < e->slot_count - 1;
    const uint32_t slot = own ? r : e->slot_count - 1;
    const bool fill = !own || e->stamps[slot] != e->visit;
    e->stamps[slot] = e->visit;
    point_at(e, from, e->slots + (size_t)slot * e->slot_words, fill);
    return &e->batch;
}
