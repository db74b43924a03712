// The exact result: at each sample, all transparent fragments with 0 < z < z_opaque, in order of depth, ties in
// raster order, composited front to back in double precision over the opaque colour or the background.
// z_opaque is the depth of the nearest opaque fragment (the first of equals), or 1. The background's alpha does
// not weigh its colour.
#include "replay.h"

#include <stdlib.h>

typedef struct layer { double depth; uint64_t at; } layer;

// Where lane's fragment of a batch lies.
static uint64_t place(const bin_batch *batch, int lane)
{
    return batch->offset + count_lanes(batch->lanes & ((1ull << lane) - 1));
}

static double opaque_surface(const bins *bins, const bin *bin, int lane, const float background[4], double rgb[3])
{
    double nearest = 1.0;
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)background[c];
    for (uint32_t r = 0; r < bin->opaque_count; r++) {
        const bin_batch *batch = &bins->batches[bin->first_batch + r];
        if (!(batch->lanes >> lane & 1))
            break;
        const uint64_t at = place(batch, lane);
        const double depth = bins->depth[at] > 0.0 ? bins->depth[at] : 0.0;  // NaN and below: the near plane
        if (depth >= nearest)
            continue;
        nearest = depth;
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)bins->rgba[c][at];
    }
    return nearest;
}

static uint32_t gather(const bins *bins, const bin *bin, int lane, double opaque, layer *layers)
{
    uint32_t count = 0;
    for (uint32_t r = bin->opaque_count; r < bin->opaque_count + bin->transparent_count; r++) {
        const bin_batch *batch = &bins->batches[bin->first_batch + r];
        if (!(batch->lanes >> lane & 1))
            break;
        const uint64_t at = place(batch, lane);
        if (bins->depth[at] > 0.0 && bins->depth[at] < opaque)
            layers[count++] = (layer){bins->depth[at], at};
    }
    return count;
}

// Bottom-up merge sort: stable, so that ties stay in raster order; linear where the input is in order.
static layer *sort_layers(layer *layers, layer *spare, uint32_t count)
{
    bool ordered = true;
    for (uint32_t i = 1; i < count; i++)
        ordered &= layers[i - 1].depth <= layers[i].depth;
    for (uint32_t width = 1; !ordered && width < count; width *= 2) {
        for (uint32_t start = 0; start < count; start += 2 * width) {
            const uint32_t middle = count - start < width ? count : start + width;
            const uint32_t end = count - start < 2 * width ? count : start + 2 * width;
            uint32_t a = start, b = middle;
            for (uint32_t i = start; i < end; i++)
                spare[i] = a < middle && (b >= end || layers[a].depth <= layers[b].depth) ? layers[a++] : layers[b++];
        }
        layer *swap = layers;
        layers = spare;
        spare = swap;
    }
    return layers;
}

static void composite(const bins *bins, const layer *layers, uint32_t count, double rgb[3])
{
    double sum[3] = {0}, transmittance = 1.0;
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t at = layers[i].at;
        const double alpha = (double)bins->rgba[3][at];
        for (int c = 0; c < 3; c++)
            sum[c] += transmittance * alpha * (double)bins->rgba[c][at];
        transmittance *= 1.0 - alpha;
    }
    for (int c = 0; c < 3; c++)
        rgb[c] = sum[c] + transmittance * rgb[c];
}

bool reference_tile(const bins *bins, const bin *bin, uint64_t lanes, const float background[4], double rgb[TILE_LANES][3])
{
    layer *layers = malloc(2 * ((size_t)bin->transparent_count + 1) * sizeof *layers);
    if (!layers)
        return false;
    for (int lane = 0; lane < TILE_LANES; lane++) {
        if (!(lanes >> lane & 1))
            continue;
        const double opaque = opaque_surface(bins, bin, lane, background, rgb[lane]);
        const uint32_t count = gather(bins, bin, lane, opaque, layers);
        composite(bins, sort_layers(layers, layers + bin->transparent_count + 1, count), count, rgb[lane]);
    }
    free(layers);
    return true;
}
