// Dual depth peeling, after the shaders that Bavoil and Myers describe. Fragments at one depth blend by component-wise
// maximum; the loop ends when no sample's back layer has an alpha above 0.
#include "model.h"

#include <stdlib.h>
#include <string.h>

typedef struct bounds {
    uint32_t nearest, farthest;  // nearest > farthest: nothing left
} bounds;

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static bounds inside(const model_state *state, const size_t *order, size_t count, bounds outer)
{
    bounds found = {UINT32_MAX, 0};
    for (size_t i = 0; i < count; i++) {
        const uint32_t z = state->codes[order[i]];
        if (z <= outer.nearest || z >= outer.farthest)
            continue;
        found.nearest = z < found.nearest ? z : found.nearest;
        found.farthest = z > found.farthest ? z : found.farthest;
    }
    return found;
}

// Blends what lies at the bounds; true if the query sees the back layer.
static bool peel(model_state *state, const size_t *order, size_t count, bounds at)
{
    double back[4] = {0}, front[4];
    bool fronts = false;
    for (size_t i = 0; i < count; i++) {
        const model_fragment *f = &state->scene->fragments[order[i]];
        const uint32_t z = state->codes[order[i]];
        const double *so_far = state->front[f->sample];
        if (z == at.nearest) {
            if (!fronts)
                memcpy(front, so_far, sizeof front);
            fronts = true;
            for (int c = 0; c < 3; c++)
                front[c] = larger(front[c], so_far[c] + so_far[3] * f->rgba[3] * f->rgba[c]);
            front[3] = -larger(-front[3], -so_far[3] * (1 - f->rgba[3]));
            state->result.composited++;
        } else if (z == at.farthest) {
            for (int c = 0; c < 4; c++)
                back[c] = larger(back[c], f->rgba[c]);
        }
    }
    if (!fronts)
        return false;
    const uint32_t s = state->scene->fragments[order[0]].sample;
    memcpy(state->front[s], front, sizeof front);
    for (int c = 0; c < 3; c++)
        state->base[s][c] = back[3] * back[c] + (1 - back[3]) * state->base[s][c];
    state->result.composited += back[3] > 0;
    return back[3] > 0;
}

model_result model_dual(const model_scene *scene)
{
    model_state state;
    size_t *order = NULL, *start = NULL;
    bounds *bounds = calloc(scene->sample_count + 1u, sizeof *bounds);
    if (!bounds || !model_start(&state, scene)) {
        free(bounds);
        return (model_result){0};
    }
    bool seen = model_gather(&state, &order, &start);
    state.result.passes = seen;
    for (uint32_t s = 0; seen && s < scene->sample_count; s++)
        bounds[s] = inside(&state, order + start[s], start[s + 1] - start[s], (struct bounds){0, UINT32_MAX});
    while (seen) {
        seen = false;
        for (uint32_t s = 0; s < scene->sample_count; s++) {
            const size_t *const mine = order + start[s], count = start[s + 1] - start[s];
            seen |= peel(&state, mine, count, bounds[s]);
            bounds[s] = inside(&state, mine, count, bounds[s]);
        }
        state.result.iterations++;
        state.result.passes++;
    }
    free(bounds);
    free(order);
    free(start);
    return model_finish(&state);
}
