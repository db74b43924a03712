// Stamps that a deeper level has read, as bins of the function level: nothing is read again, and nothing moved.
//
// A block's stamps lie in batches of 64 lanes already (block_order.c). These are not the batches that bins_build would make: each is
// of one draw, and ends before a sample would occur twice. But each sample's fragments keep their order, and no result knows
// which of them were run together.
#include "stamps.h"

#include <stdlib.h>
#include <string.h>

bool bins_can_share(const stamps *s)
{
    return s->whole && s->chunk_count == 1 && s->request.blocks && !s->request.tiles;
}

static void count_tile(const trace_info *info, const block_order *blocks, uint32_t tile, sample_counts *counts)
{
    for (uint32_t b = blocks->first_batches[tile], end = blocks->first_batches[tile + 1]; b < end; b++) {
        const uint64_t lanes = blocks->batches[b].lanes;
        const draw_class class = info->draws[blocks->batches[b].draw].class;
        uint32_t *const array = (class == CLASS_OPAQUE ? counts->opaque : counts->transparent) + (size_t)tile * TILE_LANES;
        for (int lane = 0; lane < TILE_LANES; lane++)
            array[lane] += (uint32_t)(lanes >> lane & 1);
        counts->class_fragments[class] += count_lanes(lanes);
    }
}

// Appends the tile's batches of opaque draws, or of all others; returns how many.
static uint32_t add_batches(const trace_info *info, const block_order *blocks, uint32_t tile, bool opaque, bool depths, bin_batch *to)
{
    uint32_t count = 0;
    const uint32_t first = blocks->first_batches[tile];
    for (uint32_t b = first, end = blocks->first_batches[tile + 1]; b < end; b++) {
        const block_batch *batch = &blocks->batches[b];
        const depth_range range = depths ? (depth_range){batch->nearest, batch->farthest} : (depth_range){UINT32_MAX, 0};
        const uint64_t lanes = blocks->batches[b].lanes;
        const draw_class class = info->draws[blocks->batches[b].draw].class;
        if ((class == CLASS_OPAQUE) == opaque)
            to[count++] = (bin_batch){lanes, class == CLASS_SORTED ? lanes : 0, batch->offset, range, b - first};
    }
    return count;
}

static void add_tile(const trace_info *info, const block_order *blocks, uint32_t tile, bool depths, bins *bins)
{
    bin *const bin = &bins->bins[tile];
    bin->first_batch = blocks->first_batches[tile];
    bin_batch *const batches = bins->batches + bin->first_batch;
    bin->opaque_count = add_batches(info, blocks, tile, true, depths, batches);
    bin->transparent_count = add_batches(info, blocks, tile, false, depths, batches + bin->opaque_count);
}

status bins_share(const stamps *s, format format, const report *report, sample_counts *counts, bins *bins)
{
    const trace_info *info = trace_get_info(s->trace);
    const block_order *blocks = &s->chunks[0].blocks;
    const uint32_t tiles = s->tiling.tile_count;
    memset(bins, 0, sizeof *bins);
    const bool counted = sample_counts_make(&s->tiling, counts);
    bins->shared = true;
    bins->tile_count = tiles;
    bins->bins = calloc(tiles, sizeof *bins->bins);
    bins->batches = malloc(((size_t)blocks->batch_count + 1) * sizeof *bins->batches);
    if (!counted || !bins->bins || !bins->batches)
        return report_error(report, STATUS_IO, "out of memory: %u batches", blocks->batch_count);
    for (uint32_t t = 0; t < tiles; t++) {
        count_tile(info, blocks, t, counts);
        add_tile(info, blocks, t, format == s->request.range_format, bins);
    }
    sample_counts_deepest(&s->tiling, counts);
    memcpy(bins->codes, s->chunks[0].codes, sizeof bins->codes);
    memcpy(bins->rgba, s->chunks[0].rgba, sizeof bins->rgba);
    bins->primitive = s->chunks[0].primitive;
    return STATUS_OK;
}
