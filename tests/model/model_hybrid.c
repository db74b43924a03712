// Hybrid layer peeling. Printed: algorithm 1 of the paper line by line, numbers in comments are its lines. Mended: what
// it is meant to do, sample by sample: between two unsorted layers the sorted fragments as they arrive, at a layer's
// depth all fragments as they arrive.
#include "model.h"

#include <stdlib.h>

static bool iterate(model_state *state, uint32_t **peel, uint32_t **next)
{
    const model_scene *scene = state->scene;
    bool changed = false;
    state->result.iterations++;
    for (uint32_t s = 0; s < scene->sample_count; s++)  // 7
        (*next)[s] = state->opaque[s];
    state->result.unsorted_passes++;
    for (size_t i = 0; i < scene->fragment_count; i++) {  // 10
        const model_fragment *f = &scene->fragments[i];
        const uint32_t s = f->sample, z = state->codes[i];
        if (!f->opaque && !f->sorted && (*peel)[s] < z && z < (*next)[s]) {
            (*next)[s] = z;
            changed = true;
        }
    }
    state->result.sorted_passes++;
    for (size_t i = 0; i < scene->fragment_count; i++) {  // 16
        const model_fragment *f = &scene->fragments[i];
        if (f->sorted && (*peel)[f->sample] < state->codes[i] && state->codes[i] < (*next)[f->sample])
            model_composite(state, f);
    }
    if (!changed)
        return false;
    state->result.unsorted_passes++;
    for (size_t i = 0; i < scene->fragment_count; i++) {  // 22
        const model_fragment *f = &scene->fragments[i];
        if (!f->opaque && !f->sorted && state->codes[i] == (*next)[f->sample])
            model_composite(state, f);
    }
    uint32_t *const swap = *peel;
    *peel = *next;
    *next = swap;
    return true;
}

static model_result printed_form(const model_scene *scene)
{
    model_state state;
    uint32_t *peel = calloc(scene->sample_count + 1u, sizeof *peel),
             *next = calloc(scene->sample_count + 1u, sizeof *next);
    model_result result = {0};
    if (peel && next && model_start(&state, scene)) {
        while (iterate(&state, &peel, &next))
            ;
        state.result.passes = state.result.unsorted_passes + state.result.sorted_passes;
        result = model_finish(&state);
    }
    free(peel);
    free(next);
    return result;
}

// Returns the number of unsorted layers.
static uint64_t mended_sample(model_state *state, const size_t *order, size_t count)
{
    const model_fragment *fragments = state->scene->fragments;
    uint32_t low = MODEL_NEAR;
    for (uint64_t layers = 0;; layers++) {
        uint32_t high = UINT32_MAX;
        for (size_t i = 0; i < count; i++) {
            const uint32_t z = state->codes[order[i]];
            if (!fragments[order[i]].sorted && z > low && z < high)
                high = z;
        }
        for (size_t i = 0; i < count; i++)
            if (state->codes[order[i]] > low && state->codes[order[i]] < high)
                model_composite(state, &fragments[order[i]]);
        if (high == UINT32_MAX)
            return layers;
        for (size_t i = 0; i < count; i++)
            if (state->codes[order[i]] == high)
                model_composite(state, &fragments[order[i]]);
        low = high;
    }
}

model_result model_hybrid(const model_scene *scene, bool printed)
{
    model_state state;
    size_t *order, *start;
    if (printed)
        return printed_form(scene);
    if (!model_start(&state, scene))
        return (model_result){0};
    if (!model_gather(&state, &order, &start)) {
        model_result result = model_finish(&state);
        model_free(&result);
        return result;
    }
    uint64_t most = 0;
    for (uint32_t s = 0; s < scene->sample_count; s++) {
        const uint64_t layers = mended_sample(&state, order + start[s], start[s + 1] - start[s]);
        most = layers > most ? layers : most;
    }
    free(order);
    free(start);
    state.result.iterations = most + 1;
    state.result.unsorted_passes = 2 * most + 1;
    state.result.sorted_passes = most + 1;
    state.result.passes = 2 * most + 2;  // those at a layer's depth replay both classes
    return model_finish(&state);
}
