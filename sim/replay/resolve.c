// A tile's planes in, its pixels out: front.rgb + front.a * base.rgb in float, samples averaged.
#include "replay.h"

static const float *channel(const plan *plan, const tile *tile, int plane, int c)
{
    const uint32_t *words = tile->storage + plan->plane_offset[tile->plane_at[plane]] + c * TILE_LANES;
    return (const float *)(const void *)words;
}

void resolve_tile(const plan *plan, const tile *tile, float rgb[TILE_LANES][3])
{
    const int front = plan->program->output_front, base = plan->program->output_base;
    for (int c = 0; c < 3; c++) {
        const float *behind = channel(plan, tile, base, c);
        for (int lane = 0; lane < TILE_LANES; lane++)
            rgb[lane][c] = front < 0 ? behind[lane]
                                     : channel(plan, tile, front, c)[lane] + channel(plan, tile, front, 3)[lane] * behind[lane];
    }
}

void resolve_store(const tiling *tiling, uint32_t tile, uint64_t lanes, float rgb[TILE_LANES][3], run_result *result)
{
    for (; lanes; lanes &= lanes - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctzll(lanes);
        const uint64_t sample = tiling_sample(tiling, tile, lane);
        for (int c = 0; c < 3; c++)
            result->sample_rgb[3 * sample + (uint64_t)c] = rgb[lane][c];
    }
}

void resolve_average(run_result *result)
{
    const float weight = 1.0f / (float)result->samples;  // a power of two: exact
    const uint64_t pixels = (uint64_t)result->width * result->height;
    for (uint64_t pixel = 0; pixel < pixels; pixel++) {
        for (int c = 0; c < 3; c++) {
            float sum = 0.0f;
            for (uint32_t s = 0; s < result->samples; s++)
                sum += result->sample_rgb[3 * (pixel * result->samples + s) + (uint64_t)c];
            result->image[3 * pixel + (uint64_t)c] = sum * weight;
        }
    }
}
