// Fragments in, for each whether it lies behind the one before it out. The loops are for the compiler to vectorize.
#include "lane_runs.h"

#include <stdlib.h>

enum { FLAGS_AT_ONCE = 8, USUAL_RUN = 1 << 16 };

static bool reserve(lane_runs *l, uint32_t count)
{
    if (count <= l->capacity && l->follows)
        return true;
    lane_runs_free(l);
    l->capacity = count < USUAL_RUN ? USUAL_RUN : count;
    l->follows = malloc((size_t)l->capacity + FLAGS_AT_ONCE);
    return l->follows;
}

// Lanes are below 64, so that 16 bits hold all of this.
static void find_places(const tiling *t, const fragments *run, uint8_t *restrict follows)
{
    const uint16_t in_x = (uint16_t)(t->tile_width - 1), in_y = (uint16_t)(t->tile_height - 1), samples = (uint16_t)t->samples;
    const uint16_t step_y = (uint16_t)(t->tile_width * t->samples);
    const uint16_t *restrict x = run->x, *restrict y = run->y;
    const uint8_t *restrict sample = run->sample;
    const uint32_t count = run->count;
    for (uint32_t i = 1; i < count; i++) {
        const uint16_t lane = (uint16_t)((y[i] & in_y) * step_y + (x[i] & in_x) * samples + sample[i]);
        const uint16_t before = (uint16_t)((y[i - 1] & in_y) * step_y + (x[i - 1] & in_x) * samples + sample[i - 1]);
        const uint16_t block = (uint16_t)(((x[i] ^ x[i - 1]) & ~in_x) | ((y[i] ^ y[i - 1]) & ~in_y));
        follows[i] = (uint8_t)(((uint16_t)(lane - before - 1) | block) == 0);
    }
}

static void end_at_primitives(const fragments *run, uint8_t *restrict follows)
{
    const uint32_t *restrict primitive = run->primitive;
    const uint32_t count = run->count;
    for (uint32_t i = 1; i < count; i++)
        follows[i] = (uint8_t)(follows[i] & (primitive[i] == primitive[i - 1]));
}

bool lane_runs_find(lane_runs *l, const tiling *tiling, const fragments *run, bool primitives)
{
    if (!reserve(l, run->count))
        return false;
    find_places(tiling, run, l->follows);
    if (primitives)
        end_at_primitives(run, l->follows);
    memset(l->follows + run->count, 0, FLAGS_AT_ONCE);
    return true;
}

bool lane_runs_code(lane_runs *l, const fragments *run, uint32_t formats, bool reversed)
{
    for (; formats; formats &= formats - 1) {
        const int f = __builtin_ctz(formats);
        if (!l->codes[f] && !(l->codes[f] = malloc((size_t)l->capacity * sizeof *l->codes[f])))
            return false;
        format_depths_to_codes((format)f, run->depth, run->count, reversed, l->codes[f]);
    }
    return true;
}

void lane_runs_free(lane_runs *l)
{
    free(l->follows);
    for (int f = 0; f < FORMAT_COUNT; f++)
        free(l->codes[f]);
    *l = (lane_runs){0};
}
