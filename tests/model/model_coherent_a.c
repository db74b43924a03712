// Coherent layer peeling A, section 5 of the paper: six passes an iteration with an 8-bit stencil.
//
// Each pass is the OpenGL state that the paper prints: a z-buffer with its clear value and function, a stencil
// function with reference, three operations. Mended as in programs/: the clip of passes 3 and 4 is half-open, and
// pass 6 leaves alone what lies on the opaque surface.
#include "model.h"

#include <stdlib.h>

typedef struct samples {
    uint32_t *peeled, *first, *before, *run, *after;  // z-buffers: D(s_c), D(s_n), z_min_prev, pass 3's, z_min_post
    uint8_t *stencil;
} samples;

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static void fill(uint32_t *plane, uint32_t count, uint32_t value)
{
    for (uint32_t s = 0; s < count; s++)
        plane[s] = value;
}

static void clear_stencil(samples *p, uint32_t count)
{
    for (uint32_t s = 0; s < count; s++)
        p->stencil[s] = 0;
}

static uint8_t increment(uint8_t value, bool wrap)
{
    return value == 255 ? (wrap ? 0 : 255) : (uint8_t)(value + 1);
}

static uint8_t decrement(uint8_t value, bool wrap)
{
    return value == 0 ? (wrap ? 255 : 0) : (uint8_t)(value - 1);
}

// Passes 1 to 4 for one fragment: z, its depth; s, its sample.
static void pass1(samples *p, uint32_t s, uint32_t z, uint32_t opaque, bool wrap)
{
    if (z > p->peeled[s] && z < opaque && z < p->first[s]) {
        p->first[s] = z;
        p->stencil[s] = increment(p->stencil[s], wrap);
    }
}

static void pass2(samples *p, uint32_t s, uint32_t z, uint32_t opaque, bool wrap)
{
    if (z > p->peeled[s] && z < opaque && 1 < p->stencil[s] && z < p->before[s]) {
        p->before[s] = z;
        p->stencil[s] = decrement(p->stencil[s], wrap);
    }
}

static bool in_range(const samples *p, uint32_t s, uint32_t z, uint32_t opaque, bool closed)
{
    const uint32_t bound = least(p->before[s], opaque);
    return z >= p->first[s] && (closed ? z <= bound : z < bound);
}

static void pass3(samples *p, uint32_t s, uint32_t z)
{
    if (p->stencil[s] >= 128)  // GREATER: 128 > stencil
        return;
    if (z > p->run[s]) {
        p->run[s] = z;
        p->stencil[s]++;
    } else {
        p->stencil[s] = (uint8_t)~p->stencil[s];
    }
}

static void pass4(samples *p, uint32_t s, uint32_t z, bool wrap)
{
    if (p->stencil[s] != 255)
        p->stencil[s] = increment(p->stencil[s], wrap);
    else if (z < p->after[s])
        p->after[s] = z;
}

static uint64_t composite(model_state *state, const samples *p, bool bound_itself)
{
    const uint64_t before = state->result.composited;
    for (size_t i = 0; i < state->scene->fragment_count; i++) {
        const model_fragment *f = &state->scene->fragments[i];
        const uint32_t s = f->sample, z = state->codes[i], bound = least(p->before[s], p->after[s]);
        if (f->opaque || z >= state->opaque[s])
            continue;
        if (bound_itself ? z == bound : z >= p->first[s] && z < bound)
            model_composite(state, f);
    }
    return state->result.composited - before;
}

static uint64_t iterate(model_state *state, samples *p, const model_a_options *options, model_a_step *step)
{
    const model_scene *scene = state->scene;
    const uint32_t count = scene->sample_count;
    fill(p->first, count, MODEL_FAR);
    fill(p->before, count, MODEL_FAR);
    fill(p->run, count, MODEL_NEAR);
    fill(p->after, count, MODEL_FAR);
    for (int pass = 1; pass <= 4; pass++) {
        if (pass == 1 || pass == 3)
            clear_stencil(p, count);
        for (size_t i = 0; i < scene->fragment_count; i++) {
            const model_fragment *f = &scene->fragments[i];
            const uint32_t s = f->sample, z = state->codes[i], opaque = state->opaque[s];
            if (f->opaque)
                continue;
            if (pass == 1)
                pass1(p, s, z, opaque, options->wrap);
            else if (pass == 2)
                pass2(p, s, z, opaque, options->wrap);
            else if (in_range(p, s, z, opaque, options->closed_clip))
                pass == 3 ? pass3(p, s, z) : pass4(p, s, z, options->wrap);
        }
        if (step && pass == 1)
            step->stencil_first = p->stencil[0];
        if (step && pass == 2)
            step->stencil_before = p->stencil[0];
        if (step && pass == 3)
            step->stencil_run = p->stencil[0];
    }
    if (step) {
        step->after_first = p->first[0];
        step->before = p->before[0];
        step->run = p->run[0];
        step->after = p->after[0];
    }
    uint64_t composited = composite(state, p, false);
    composited += composite(state, p, true);
    for (uint32_t s = 0; s < count; s++)
        p->peeled[s] = least(p->before[s], least(p->after[s], state->opaque[s]));
    state->result.passes += 6;
    state->result.iterations++;
    return composited;
}

model_result model_coherent_a(const model_scene *scene, const model_a_options *options)
{
    static const model_a_options none;
    model_state state;
    options = options ? options : &none;
    const size_t count = scene->sample_count + 1u;
    samples p = {calloc(count, 4), calloc(count, 4), calloc(count, 4),
                 calloc(count, 4), calloc(count, 4), calloc(count, 1)};
    model_result result = {0};
    if (p.peeled && p.first && p.before && p.run && p.after && p.stencil && model_start(&state, scene)) {
        size_t k = 0;
        while (iterate(&state, &p, options, options->steps && k < options->step_max ? &options->steps[k] : NULL))
            k++;
        result = model_finish(&state);
    }
    free(p.peeled);
    free(p.first);
    free(p.before);
    free(p.run);
    free(p.after);
    free(p.stencil);
    return result;
}
