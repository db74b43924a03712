// Fused and two-ended coherent layer peeling: passes from what the spans are, not from registers.
//
// The picture of both is the exact one. A span from the front, beyond depth `low`: it starts at the nearest layer's
// first fragment; whatever arrived before that bounds it; from there on it is the run of arrivals that does not
// descend. A span from the back is all that is deeper than every fragment with a deeper one before it.
#include "model.h"

#include <stdlib.h>

typedef struct middle {
    uint32_t *z;  // codes in raster order
    size_t count;
} middle;

// The last depth that the front takes.
static uint32_t front_end(const middle *m)
{
    size_t first = 0;
    for (size_t i = 1; i < m->count; i++)
        if (m->z[i] < m->z[first])
            first = i;
    uint32_t bound = UINT32_MAX;
    for (size_t i = 0; i < first; i++)
        bound = m->z[i] < bound ? m->z[i] : bound;
    uint32_t end = m->z[first];
    bool descended = false;
    for (size_t i = first + 1; i < m->count; i++) {
        if (m->z[i] >= bound)
            continue;
        if (!descended) {
            descended = m->z[i] < end;
            end = m->z[i];
        } else if (m->z[i] < end) {
            end = m->z[i];
        }
    }
    return end;
}

// The deepest fragment with a deeper one before it.
static uint32_t back_end(const middle *m)
{
    uint32_t end = MODEL_NEAR;
    for (size_t i = 0; i < m->count; i++)
        for (size_t j = 0; j < i; j++)
            if (m->z[j] > m->z[i] && m->z[i] > end)
                end = m->z[i];
    return end;
}

// Passes until nothing is left, the empty one not counted.
static uint64_t rounds(middle *m, bool two_ended)
{
    uint64_t count = 0;
    for (; m->count > 0; count++) {
        const uint32_t low = front_end(m), high = two_ended ? back_end(m) : UINT32_MAX;
        size_t kept = 0;
        for (size_t i = 0; i < m->count; i++)
            if (m->z[i] > low && m->z[i] <= high)
                m->z[kept++] = m->z[i];
        m->count = kept;
    }
    return count;
}

static model_result with_exact_picture(const model_scene *scene, bool two_ended)
{
    model_result result = model_exact(scene);
    model_state state;
    size_t *order, *start;
    if (!result.rgb || !model_start(&state, scene))
        return result;
    uint32_t *codes = malloc((scene->fragment_count + 1) * sizeof *codes);
    if (codes && model_gather(&state, &order, &start)) {
        for (uint32_t s = 0; s < scene->sample_count; s++) {
            middle middle = {codes, 0};
            for (size_t i = start[s]; i < start[s + 1]; i++)
                codes[middle.count++] = state.codes[order[i]];
            const uint64_t count = rounds(&middle, two_ended) + 1;
            result.passes = count > result.passes ? count : result.passes;
        }
        free(order);
        free(start);
    }
    result.iterations = result.passes;
    free(codes);
    model_result unused = model_finish(&state);
    model_free(&unused);
    return result;
}

model_result model_fused(const model_scene *scene)
{
    return with_exact_picture(scene, false);
}

model_result model_two_ended(const model_scene *scene)
{
    return with_exact_picture(scene, true);
}
