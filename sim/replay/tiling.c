// How an image's samples lie in tiles of 64 lanes: 8 x 8 pixels of one sample, 8 x 4 of two, 4 x 4 of four,
// 4 x 2 of eight, 2 x 2 of sixteen.
#include "replay.h"

void tiling_init(tiling *tiling, const trace_info *info)
{
    *tiling = (struct tiling){info->width, info->height, info->samples, 8, 8, 3, 3, 0, 0, 0, 0};
    for (uint32_t samples = info->samples; samples > 1; samples /= 2) {
        if (tiling->shift_y >= tiling->shift_x)
            tiling->shift_y--;
        else
            tiling->shift_x--;
    }
    tiling->tile_width = 1u << tiling->shift_x;
    tiling->tile_height = 1u << tiling->shift_y;
    tiling->columns = (info->width + tiling->tile_width - 1) / tiling->tile_width;
    tiling->rows = (info->height + tiling->tile_height - 1) / tiling->tile_height;
    tiling->tile_count = tiling->columns * tiling->rows;
    for (uint32_t y = 0; y < tiling->tile_height; y += 2)
        for (uint32_t x = 0; x < tiling->tile_width; x += 2)
            tiling->quad_corners |= 1ull << ((y << tiling->shift_x) + x) * tiling->samples;
}

tiling_run tiling_row(const tiling *tiling, uint32_t tile, uint32_t row)
{
    const uint32_t x = tile % tiling->columns << tiling->shift_x, y = (tile / tiling->columns << tiling->shift_y) + row;
    const uint32_t left = tiling->image_width - x, pixels = left < tiling->tile_width ? left : tiling->tile_width;
    const uint64_t sample = ((uint64_t)y * tiling->image_width + x) * tiling->samples;
    return (tiling_run){(row << tiling->shift_x) * tiling->samples, y < tiling->image_height ? pixels * tiling->samples : 0, sample};
}

uint64_t tiling_valid_lanes(const tiling *tiling, uint32_t tile)
{
    const uint32_t right = (tile % tiling->columns + 1) << tiling->shift_x, bottom = (tile / tiling->columns + 1) << tiling->shift_y;
    uint64_t lanes = 0;
    if (right <= tiling->image_width && bottom <= tiling->image_height)
        return UINT64_MAX;
    for (uint32_t row = 0; row < tiling->tile_height; row++) {
        const tiling_run run = tiling_row(tiling, tile, row);
        lanes |= run.count ? UINT64_MAX >> (TILE_LANES - run.count) << run.lane : 0;
    }
    return lanes;
}

uint64_t tiling_sample(const tiling *tiling, uint32_t tile, uint32_t lane)
{
    const uint32_t pixel = lane / tiling->samples;
    const uint64_t x = (tile % tiling->columns << tiling->shift_x) + (pixel & (tiling->tile_width - 1));
    const uint64_t y = (tile / tiling->columns << tiling->shift_y) + (pixel >> tiling->shift_x);
    return (y * tiling->image_width + x) * tiling->samples + lane % tiling->samples;
}
