// Algorithm 2 of the paper, line by line: ideal coherent layer peeling. Numbers in comments are its lines.
//
// Mended (printed = false): the reset also sets z3 to zOpaque, once zPeel has its old value, and the composite of line
// 32 asks for zNear < z < zOpaque. Otherwise a finished sample composites its last layer again in each iteration.
#include "model.h"

#include <stdlib.h>

typedef struct samples {
    uint32_t *peel, *z1, *z2, *z3;
    bool *post;
} samples;

// Pass 1 for one fragment; true if gChanged is set.
static bool search(samples *p, model_state *state, const model_fragment *f, uint32_t z, bool printed)
{
    const uint32_t s = f->sample;
    if (p->peel[s] < z && z < p->z2[s]) {  // 14
        if (z < p->z1[s]) {                // 16
            p->z2[s] = p->z1[s];
            p->z1[s] = z;
            p->z3[s] = p->z1[s];
            p->post[s] = false;
        } else if (p->post[s]) {  // 21
            if (z < p->z3[s])
                p->z3[s] = z;
        } else {  // 25
            if (z < p->z3[s])
                p->post[s] = true;
            p->z3[s] = z;
        }
        return true;
    }
    if (z == p->peel[s] && (printed || (z > MODEL_NEAR && z < state->opaque[s])))  // 31
        model_composite(state, f);
    return false;
}

static void reset(samples *p, const model_state *state, bool printed)  // 7 to 12
{
    for (uint32_t s = 0; s < state->scene->sample_count; s++) {
        p->z1[s] = p->z2[s] = state->opaque[s];
        p->peel[s] = p->z3[s];
        if (!printed)
            p->z3[s] = state->opaque[s];
        p->post[s] = false;
    }
}

static void run(samples *p, model_state *state, bool printed)
{
    const model_scene *scene = state->scene;
    for (bool changed = true; changed;) {
        changed = false;
        state->result.iterations++;
        reset(p, state, printed);
        state->result.passes++;
        for (size_t i = 0; i < scene->fragment_count; i++)
            if (!scene->fragments[i].opaque)
                changed |= search(p, state, &scene->fragments[i], state->codes[i], printed);
        if (!changed)
            continue;
        state->result.passes++;
        for (size_t i = 0; i < scene->fragment_count; i++) {  // 36
            const model_fragment *f = &scene->fragments[i];
            if (!f->opaque && p->peel[f->sample] < state->codes[i] && state->codes[i] < p->z3[f->sample])
                model_composite(state, f);
        }
    }
}

model_result model_ideal(const model_scene *scene, bool printed)
{
    const size_t count = scene->sample_count + 1u;
    samples p = {calloc(count, 4), calloc(count, 4), calloc(count, 4), calloc(count, 4), calloc(count, sizeof(bool))};
    model_state state;
    model_result result = {0};
    if (p.peel && p.z1 && p.z2 && p.z3 && p.post && model_start(&state, scene)) {
        run(&p, &state, printed);  // z3 is zNear at first (2): calloc
        result = model_finish(&state);
    }
    free(p.peel);
    free(p.z1);
    free(p.z2);
    free(p.z3);
    free(p.post);
    return result;
}
