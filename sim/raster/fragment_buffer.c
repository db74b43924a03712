// The rasterizer's buffer: fragments gather in columns and leave in runs, so memory does not grow with them.
#include "triangle.h"

#include <stdlib.h>

rasterizer *rasterizer_create(const trace_info *info, fragment_sink sink)
{
    rasterizer *r = calloc(1, sizeof *r);
    if (!r)
        return NULL;
    r->width = info->width;
    r->height = info->height;
    r->samples = info->samples;
    r->reversed = info->reversed_depth;
    r->sink = sink;
    for (uint32_t i = 0; i < info->samples; i++) {
        r->sample_x[i] = info->sample_positions[i][0];
        r->sample_y[i] = info->sample_positions[i][1];
    }
    return r;
}

void rasterizer_destroy(rasterizer *r)
{
    free(r);
}

status rasterizer_flush(rasterizer *r)
{
    if (!r->count)
        return STATUS_OK;
    fragments run = {
        .count = r->count,
        .x = r->x,
        .y = r->y,
        .sample = r->sample,
        .depth = r->depth,
        .rgba = {r->rgba[0], r->rgba[1], r->rgba[2], r->rgba[3]},
        .primitive = r->primitive,
    };
    r->count = 0;
    return r->sink.take(r->sink.user, &run);
}
