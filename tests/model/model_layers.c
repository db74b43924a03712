// The exact result by sorting, and layer peeling as section 8 of the paper counts it: two passes an iteration.
#include "model.h"

#include <stdlib.h>

typedef struct entry {
    uint32_t code;
    size_t order;
} entry;

static int compare_entries(const void *left, const void *right)
{
    const entry *a = left, *b = right;
    if (a->code != b->code)
        return a->code < b->code ? -1 : 1;
    return a->order < b->order ? -1 : a->order > b->order;
}

model_result model_exact(const model_scene *scene)
{
    model_state state;
    entry *entries = malloc((scene->fragment_count + 1) * sizeof *entries);
    if (!entries || !model_start(&state, scene)) {
        free(entries);
        return (model_result){0};
    }
    for (size_t i = 0; i < scene->fragment_count; i++)
        entries[i] = (entry){state.codes[i], i};
    qsort(entries, scene->fragment_count, sizeof *entries, compare_entries);
    for (size_t i = 0; i < scene->fragment_count; i++) {
        const model_fragment *f = &scene->fragments[entries[i].order];
        if (!f->opaque && entries[i].code > MODEL_NEAR && entries[i].code < state.opaque[f->sample])
            model_composite(&state, f);
    }
    free(entries);
    return model_finish(&state);
}

model_result model_layer_peel(const model_scene *scene)
{
    model_state state;
    uint32_t *peel = calloc(scene->sample_count + 1u, sizeof *peel),
             *next = calloc(scene->sample_count + 1u, sizeof *next);
    if (!peel || !next || !model_start(&state, scene)) {
        free(peel);
        free(next);
        return (model_result){0};
    }
    for (bool found = true; found;) {
        found = false;
        state.result.iterations++;
        for (uint32_t s = 0; s < scene->sample_count; s++)
            next[s] = MODEL_FAR;
        state.result.passes++;
        for (size_t i = 0; i < scene->fragment_count; i++) {
            const model_fragment *f = &scene->fragments[i];
            const uint32_t z = state.codes[i], s = f->sample;
            if (!f->opaque && z > peel[s] && z < state.opaque[s] && z < next[s]) {
                next[s] = z;
                found = true;
            }
        }
        state.result.passes += found;
        for (size_t i = 0; found && i < scene->fragment_count; i++) {
            const model_fragment *f = &scene->fragments[i];
            const uint32_t z = state.codes[i], s = f->sample;
            if (!f->opaque && z == next[s] && z < state.opaque[s])
                model_composite(&state, f);
        }
        for (uint32_t s = 0; s < scene->sample_count; s++)
            peel[s] = next[s];
    }
    free(peel);
    free(next);
    return model_finish(&state);
}
