// Peeling with one geometry pass a layer, in Everitt's form and in VTK's: of the fragments at one depth, the first.
// Everitt's composites each; VTK's, which knows a stored peel by its alpha, passes over an alpha of 0.
#include "model.h"

#include <stdlib.h>

enum { NONE = -1 };

// One peel: what the depth test leaves at each sample, and how many fragments passed it.
static uint64_t peel(const model_state *state, const uint32_t *last, uint32_t *next, long *kept)
{
    const model_scene *scene = state->scene;
    uint64_t changed = 0;
    for (uint32_t s = 0; s < scene->sample_count; s++) {
        next[s] = MODEL_FAR;
        kept[s] = NONE;
    }
    for (size_t i = 0; i < scene->fragment_count; i++) {
        const model_fragment *f = &scene->fragments[i];
        const uint32_t s = f->sample, z = state->codes[i];
        if (!f->opaque && z > last[s] && z < state->opaque[s] && z < next[s]) {
            next[s] = z;
            kept[s] = (long)i;
            changed++;
        }
    }
    return changed;
}

static model_result peel_all(const model_scene *scene, uint64_t peels, double ratio, bool alpha_zero)
{
    model_state state;
    const size_t count = scene->sample_count + 1u;
    uint32_t *last = calloc(count, sizeof *last), *next = calloc(count, sizeof *next);
    long *kept = calloc(count, sizeof *kept);
    model_result result = {0};
    if (last && next && kept && model_start(&state, scene)) {
        bool more = true;
        while (more) {
            const uint64_t changed = peel(&state, last, next, kept);
            state.result.passes = ++state.result.iterations;
            for (uint32_t s = 0; s < scene->sample_count; s++) {
                if (kept[s] != NONE && (alpha_zero || scene->fragments[kept[s]].rgba[3] > 0))
                    model_composite(&state, &scene->fragments[kept[s]]);
                last[s] = next[s];
            }
            more = (double)changed > ratio * scene->sample_count && state.result.iterations != peels;
        }
        result = model_finish(&state);
    }
    free(last);
    free(next);
    free(kept);
    return result;
}

model_result model_everitt(const model_scene *scene)
{
    return peel_all(scene, 0, 0, true);
}

model_result model_vtk(const model_scene *scene, uint64_t peels, double ratio)
{
    return peel_all(scene, peels, ratio, false);
}
