// What every algorithm of the model shares: depth codes, the opaque surfaces, front-to-back compositing.
#include "model.h"

#include <stdlib.h>
#include <string.h>

// A depth as the depth buffer keeps it: clamped, NaN as 0, binary32. The bits of floats from 0 on order as the floats
// do.
static uint32_t depth_code(double depth)
{
    const float stored = depth > 0 ? depth < 1 ? (float)depth : 1.0f : 0.0f;
    uint32_t code;
    memcpy(&code, &stored, sizeof code);
    return code;
}

bool model_start(model_state *state, const model_scene *scene)
{
    const size_t samples = scene->sample_count ? scene->sample_count : 1;
    memset(state, 0, sizeof *state);
    state->scene = scene;
    state->opaque = malloc(samples * sizeof *state->opaque);
    state->base = malloc(samples * sizeof *state->base);
    state->front = malloc(samples * sizeof *state->front);
    state->codes = malloc((scene->fragment_count + 1) * sizeof *state->codes);
    if (!state->opaque || !state->base || !state->front || !state->codes) {
        model_finish(state);
        model_free(&state->result);
        return false;
    }
    for (size_t s = 0; s < samples; s++) {
        state->opaque[s] = MODEL_FAR;
        for (int c = 0; c < 3; c++) {
            state->base[s][c] = scene->background[c];
            state->front[s][c] = 0;
        }
        state->front[s][3] = 1;
    }
    for (size_t i = 0; i < scene->fragment_count; i++) {
        const model_fragment *f = &scene->fragments[i];
        state->codes[i] = depth_code(f->depth);
        if (!f->opaque || state->codes[i] >= state->opaque[f->sample])
            continue;
        state->opaque[f->sample] = state->codes[i];
        memcpy(state->base[f->sample], f->rgba, sizeof state->base[0]);
    }
    return true;
}

void model_composite(model_state *state, const model_fragment *fragment)
{
    double *front = state->front[fragment->sample];
    for (int c = 0; c < 3; c++)
        front[c] += front[3] * fragment->rgba[3] * fragment->rgba[c];
    front[3] *= 1 - fragment->rgba[3];
    state->result.composited++;
}

model_result model_finish(model_state *state)
{
    for (uint32_t s = 0; state->front && state->base && s < state->scene->sample_count; s++)
        for (int c = 0; c < 3; c++)
            state->base[s][c] = state->front[s][c] + state->front[s][3] * state->base[s][c];
    state->result.rgb = state->base;
    free(state->opaque);
    free(state->front);
    free(state->codes);
    return state->result;
}

void model_free(model_result *result)
{
    free(result->rgb);
    result->rgb = NULL;
}

bool model_gather(const model_state *state, size_t **order, size_t **start)
{
    const model_scene *scene = state->scene;
    *order = malloc((scene->fragment_count + 1) * sizeof **order);
    *start = calloc(scene->sample_count + 2u, sizeof **start);
    if (!*order || !*start) {
        free(*order);
        free(*start);
        return false;
    }
    size_t *const next = *start + 1;  // of each sample; holds its start, and at the end its end
    for (int turn = 0; turn < 2; turn++) {
        for (size_t i = 0; i < scene->fragment_count; i++) {
            const model_fragment *f = &scene->fragments[i];
            if (f->opaque || state->codes[i] == MODEL_NEAR || state->codes[i] >= state->opaque[f->sample])
                continue;
            if (turn == 1)
                (*order)[next[f->sample]] = i;
            next[f->sample]++;
        }
        if (turn == 1)
            break;
        size_t sum = 0;
        for (uint32_t s = 0; s < scene->sample_count; s++) {
            const size_t count = next[s];
            next[s] = sum;
            sum += count;
        }
    }
    return true;
}
