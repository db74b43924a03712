// A rasterizer that counts and keeps what it emits, for tests of coverage and interpolation.
#ifndef ROPSIM_TEST_RASTER_FIXTURE_H
#define ROPSIM_TEST_RASTER_FIXTURE_H

#include "../../sim/raster/raster.h"

#include <stdlib.h>
#include <string.h>

typedef struct kept_fragment {
    uint16_t x, y;
    uint8_t sample;
    double depth;
    float rgba[4];
    uint32_t primitive;
} kept_fragment;

typedef struct kept {
    trace_info info;
    rasterizer *rasterizer;
    kept_fragment *fragments;
    size_t count, capacity;
} kept;

static inline status keep(void *user, const fragments *run)
{
    kept *kept = user;
    if (kept->count + run->count > kept->capacity) {
        kept->capacity = 2 * (kept->count + run->count);
        kept->fragments = realloc(kept->fragments, kept->capacity * sizeof *kept->fragments);
        if (!kept->fragments)
            return STATUS_IO;
    }
    for (uint32_t i = 0; i < run->count; i++)
        kept->fragments[kept->count++] =
            (kept_fragment){run->x[i],
                            run->y[i],
                            run->sample[i],
                            run->depth[i],
                            {run->rgba[0][i], run->rgba[1][i], run->rgba[2][i], run->rgba[3][i]},
                            run->primitive[i]};
    return STATUS_OK;
}

static inline void kept_start(kept *kept, uint32_t width, uint32_t height, uint32_t samples)
{
    memset(kept, 0, sizeof *kept);
    kept->info = (trace_info){.width = width, .height = height, .samples = samples};
    trace_standard_positions(&kept->info);
    kept->rasterizer = rasterizer_create(&kept->info, (fragment_sink){keep, kept});
}

static inline void kept_stop(kept *kept)
{
    rasterizer_destroy(kept->rasterizer);
    free(kept->fragments);
}

// A sample's position in 1/256 pixel from the image's corner.
static inline int64_t sample_x(const kept *kept, uint32_t x, uint32_t sample)
{
    return (int64_t)x * 256 + 128 + kept->info.sample_positions[sample][0];
}

static inline int64_t sample_y(const kept *kept, uint32_t y, uint32_t sample)
{
    return (int64_t)y * 256 + 128 + kept->info.sample_positions[sample][1];
}

#endif
