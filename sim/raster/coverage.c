// Which samples a triangle covers, and in which order they come out.
//
// Order: tiles of 8 x 8 pixels, row by row from the top left of the image; in a tile pixels row by row; in
// a pixel samples by number. A tile is settled whole where each edge has all of it on one side. For an edge
// that crosses a tile, the function's values there are small (below 2^53, since the tile is small and one
// value is near 0), so the walk needs 64 bits although the set-up needs 128.
#include "triangle.h"

// What is left of an edge inside one tile: value at the anchor minus bias, and steps; all 0 where the whole
// tile is inside.
typedef struct tile_edge {
    int64_t value, step_x, step_y;
} tile_edge;

// Sample offsets from a pixel's centre reach from -128 to 127.
enum { REACH_LOW = -SUBPIXELS / 2, REACH_HIGH = (RASTER_TILE - 1) * SUBPIXELS + SUBPIXELS / 2 - 1 };

// False if no sample of the tile can be inside the edge.
static bool edge_in_tile(const edge *edge, int64_t anchor_x, int64_t anchor_y, tile_edge *local)
{
    int128 value = edge_at(edge, anchor_x, anchor_y) - edge->bias;
    int64_t right = edge->step_x * REACH_HIGH, left = edge->step_x * REACH_LOW;
    int64_t down = edge->step_y * REACH_HIGH, up = edge->step_y * REACH_LOW;
    if (value + (right > left ? right : left) + (down > up ? down : up) < 0)
        return false;
    if (value + (right < left ? right : left) + (down < up ? down : up) >= 0)
        *local = (tile_edge){0};
    else
        *local = (tile_edge){.value = (int64_t)value, .step_x = edge->step_x, .step_y = edge->step_y};
    return true;
}

// Appends one sample without counting it; the caller counts if it is inside.
static inline void put(rasterizer *r, uint32_t index, uint32_t first, int32_t x, int32_t y, uint32_t sample, int64_t dx,
                       int64_t dy)
{
    r->x[index] = (uint16_t)x;
    r->y[index] = (uint16_t)y;
    r->sample[index] = (uint8_t)sample;
    r->offset_x[index - first] = (double)dx;
    r->offset_y[index - first] = (double)dy;
}

// The pixels [x0, x1] x [y0, y1] of the tile at (tile_x, tile_y); returns how many samples are inside.
static uint32_t cover(rasterizer *r, const tile_edge e[3], int32_t tile_x, int32_t tile_y, int32_t x0, int32_t x1,
                      int32_t y0, int32_t y1)
{
    const uint32_t first = r->count;
    uint32_t count = first;
    for (int32_t y = y0; y <= y1; y++) {
        for (int32_t x = x0; x <= x1; x++) {
            for (uint32_t s = 0; s < r->samples; s++) {
                int64_t dx = (int64_t)(x - tile_x) * SUBPIXELS + r->sample_x[s];
                int64_t dy = (int64_t)(y - tile_y) * SUBPIXELS + r->sample_y[s];
                int64_t a = e[0].value + e[0].step_x * dx + e[0].step_y * dy;
                int64_t b = e[1].value + e[1].step_x * dx + e[1].step_y * dy;
                int64_t c = e[2].value + e[2].step_x * dx + e[2].step_y * dy;
                put(r, count, first, x, y, s, dx, dy);
                count += (a | b | c) >= 0;  // no sign bit in any
            }
        }
    }
    return count - first;
}

status raster_triangle(rasterizer *r, const screen_vertex corners[3], uint32_t primitive)
{
    triangle_setup setup;
    if (!triangle_set_up(corners, r->width, r->height, &setup))
        return STATUS_OK;
    setup.primitive = primitive;
    const int32_t mask = ~(RASTER_TILE - 1);
    for (int32_t tile_y = setup.y0 & mask; tile_y <= setup.y1; tile_y += RASTER_TILE) {
        for (int32_t tile_x = setup.x0 & mask; tile_x <= setup.x1; tile_x += RASTER_TILE) {
            // The anchor is the centre of the tile's first pixel.
            int64_t anchor_x = (int64_t)tile_x * SUBPIXELS + SUBPIXELS / 2,
                    anchor_y = (int64_t)tile_y * SUBPIXELS + SUBPIXELS / 2;
            tile_edge local[3];
            if (!edge_in_tile(&setup.edges[0], anchor_x, anchor_y, &local[0]) ||
                !edge_in_tile(&setup.edges[1], anchor_x, anchor_y, &local[1]) ||
                !edge_in_tile(&setup.edges[2], anchor_x, anchor_y, &local[2]))
                continue;
            if (r->count + TILE_FRAGMENTS_MAX >= BUFFER_FRAGMENTS) {
                status result = rasterizer_flush(r);
                if (result)
                    return result;
            }
            int32_t x1 = tile_x + RASTER_TILE - 1, y1 = tile_y + RASTER_TILE - 1;
            uint32_t count =
                cover(r, local, tile_x, tile_y, tile_x > setup.x0 ? tile_x : setup.x0, x1 < setup.x1 ? x1 : setup.x1,
                      tile_y > setup.y0 ? tile_y : setup.y0, y1 < setup.y1 ? y1 : setup.y1);
            if (count)
                interpolate_tile(r, &setup, anchor_x, anchor_y, count);
        }
    }
    return STATUS_OK;
}
