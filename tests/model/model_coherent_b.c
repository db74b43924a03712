// Coherent layer peeling B, section 6 of the paper: the first pass keeps, by blending, the depth that the nearest
// surface replaced; the other four are passes 3 to 6 of section 5. One sample after another, since a sample's passes
// only meet those of others in the stop rule.
//
// Blending is single precision, as the hardware's: printed, the colour channel is the product of all earlier depths.
#include "model.h"

#include <stdlib.h>
#include <string.h>

static float to_float(uint32_t code)
{
    float value;
    memcpy(&value, &code, sizeof value);
    return value;
}

static uint32_t to_code(float value)
{
    uint32_t code;
    memcpy(&code, &value, sizeof code);
    return code;
}

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

// One iteration at one sample; returns how many fragments were composited.
static uint64_t iterate(model_state *state, uint32_t *peeled, const size_t *order, size_t count, bool printed)
{
    const uint64_t before = state->result.composited;
    uint32_t first = MODEL_FAR;
    float color = 1, alpha = 1;
    for (size_t i = 0; i < count; i++) {
        const uint32_t z = state->codes[order[i]];
        if (z <= *peeled || z >= first)
            continue;
        first = z;
        color = printed ? color * alpha : 1 * alpha;
        alpha = to_float(z);
    }
    const uint32_t previous = to_code(color);
    uint32_t run = MODEL_NEAR, after = MODEL_FAR;
    uint8_t stencil = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t z = state->codes[order[i]];
        if (z < first || z >= previous || stencil >= 128)
            continue;
        stencil = z > run ? (uint8_t)(stencil + 1) : (uint8_t)~stencil;
        run = z > run ? z : run;
    }
    for (size_t i = 0; i < count; i++) {
        const uint32_t z = state->codes[order[i]];
        if (z < first || z >= previous)
            continue;
        if (stencil != 255)
            stencil++;
        else
            after = least(after, z);
    }
    const uint32_t bound = least(previous, after);
    for (int at_bound = 0; at_bound < 2; at_bound++) {
        for (size_t i = 0; i < count; i++) {
            const uint32_t z = state->codes[order[i]];
            if (at_bound ? z == bound : z >= first && z < bound)
                model_composite(state, &state->scene->fragments[order[i]]);
        }
    }
    *peeled = bound;
    return state->result.composited - before;
}

model_result model_coherent_b(const model_scene *scene, bool printed, uint64_t iterations)
{
    model_state state;
    size_t *order = NULL, *start = NULL;
    uint32_t *peeled = calloc(scene->sample_count + 1u, sizeof *peeled);  // D(s_c)
    if (!peeled || !model_start(&state, scene)) {
        free(peeled);
        return (model_result){0};
    }
    uint64_t composited = model_gather(&state, &order, &start);
    while (composited > 0 && state.result.iterations < iterations) {
        composited = 0;
        for (uint32_t s = 0; s < scene->sample_count; s++)
            composited += iterate(&state, &peeled[s], order + start[s], start[s + 1] - start[s], printed);
        state.result.iterations++;
        state.result.passes += 5;
    }
    free(peeled);
    free(order);
    free(start);
    return model_finish(&state);
}
