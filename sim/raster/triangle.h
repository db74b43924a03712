// A set-up triangle and the buffer that its fragments go to: what triangle_setup.c, coverage.c,
// interpolate.c and fragment_buffer.c share.
#ifndef ROPSIM_TRIANGLE_H
#define ROPSIM_TRIANGLE_H

#include "raster.h"

__extension__ typedef __int128 int128;  // edge functions of triangles up to 2^32 pixels wide

// Edge i faces corner i: its function is twice the area that a point spans with that edge, so divided by
// `area` it is corner i's weight there. Inside is >= bias.
typedef struct edge {
    int64_t x, y;            // a point on it
    int64_t step_x, step_y;  // growth of the function per 1/256 pixel
    int64_t bias;            // 0: points on the edge are inside (top or left); 1: they are not
} edge;

typedef struct triangle_setup {
    edge edges[3];
    double area;                    // twice, in square sub-pixels; > 0
    int32_t x0, y0, x1, y1;         // pixels that may be covered, both ends included
    double depth, depth_change[2];  // of corner 0; of corners 1 and 2 from it
    double inverse_w[3];
    bool perspective;  // inverse_w differ
    bool flat;         // one colour
    double rgba[4], rgba_change[2][4];
    uint32_t primitive;
} triangle_setup;

// False if it covers nothing for certain: no area, or outside the image.
bool triangle_set_up(const screen_vertex corners[3], uint32_t width, uint32_t height, triangle_setup *setup);
// The edge's function at a point, exactly.
int128 edge_at(const edge *edge, int64_t x, int64_t y);

enum { TILE_FRAGMENTS_MAX = RASTER_TILE * RASTER_TILE * TRACE_SAMPLES_MAX, BUFFER_FRAGMENTS = 1 << 15 };

struct rasterizer {
    uint32_t width, height, samples;
    int sample_x[TRACE_SAMPLES_MAX], sample_y[TRACE_SAMPLES_MAX];  // from the pixel's centre
    bool reversed;
    fragment_sink sink;
    uint32_t count;
    uint16_t x[BUFFER_FRAGMENTS], y[BUFFER_FRAGMENTS];
    uint8_t sample[BUFFER_FRAGMENTS];
    double depth[BUFFER_FRAGMENTS];
    float rgba[4][BUFFER_FRAGMENTS];
    uint32_t primitive[BUFFER_FRAGMENTS];
    double offset_x[TILE_FRAGMENTS_MAX], offset_y[TILE_FRAGMENTS_MAX];  // of a tile's fragments from its anchor
};

// Fills depth, colour and primitive of the `count` fragments that coverage put behind the buffer's end for
// one tile. Offsets are from the point (anchor_x, anchor_y).
void interpolate_tile(rasterizer *rasterizer, const triangle_setup *setup, int64_t anchor_x, int64_t anchor_y,
                      uint32_t count);

#endif
