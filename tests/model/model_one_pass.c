// What needs one pass, or one a handful of fragments: blending as fragments arrive, weighted sums, k-buffers.
#include "model.h"

#include <math.h>
#include <stdlib.h>

// Calls body with each sample's visible fragments in raster order.
static model_result each_sample(const model_scene *scene, uint32_t k,
                                void (*body)(model_state *, uint32_t sample, size_t *order, size_t count, uint32_t k))
{
    model_state state;
    size_t *order, *start;
    if (!model_start(&state, scene))
        return (model_result){0};
    state.result.passes = 1;
    if (model_gather(&state, &order, &start)) {
        for (uint32_t s = 0; s < scene->sample_count; s++)
            body(&state, s, order + start[s], start[s + 1] - start[s], k);
        free(order);
        free(start);
    }
    return model_finish(&state);
}

static void composite_all(model_state *state, uint32_t s, size_t *order, size_t count, uint32_t k)
{
    (void)s;
    (void)k;
    for (size_t i = 0; i < count; i++)
        model_composite(state, &state->scene->fragments[order[i]]);
}

model_result model_sorted_blend(const model_scene *scene)
{
    return each_sample(scene, 0, composite_all);
}

// Replaces the sample's front by rgb, behind which the background has weight `passes`.
static void weigh(model_state *state, uint32_t s, size_t *order, size_t count, bool average)
{
    double sum[4] = {0};
    for (size_t i = 0; i < count; i++) {
        const double *rgba = state->scene->fragments[order[i]].rgba;
        for (int c = 0; c < 3; c++)
            sum[c] += rgba[3] * rgba[c];
        sum[3] += rgba[3];
    }
    state->result.composited += count;
    if (!(sum[3] > 0))
        return;
    const double passes = average ? pow(1 - sum[3] / (double)count, (double)count) : 1 - sum[3];
    for (int c = 0; c < 3; c++)
        state->front[s][c] = average ? sum[c] / sum[3] * (1 - passes) : sum[c];
    state->front[s][3] = passes;
}

static void weigh_average(model_state *state, uint32_t s, size_t *order, size_t count, uint32_t k)
{
    (void)k;
    weigh(state, s, order, count, true);
}

static void weigh_sum(model_state *state, uint32_t s, size_t *order, size_t count, uint32_t k)
{
    (void)k;
    weigh(state, s, order, count, false);
}

model_result model_weighted_average(const model_scene *scene)
{
    return each_sample(scene, 0, weigh_average);
}

model_result model_weighted_sum(const model_scene *scene)
{
    return each_sample(scene, 0, weigh_sum);
}

// Takes the nearest of the first `count` out, the first to arrive of equals, and composites it.
static void composite_nearest(model_state *state, size_t *order, size_t count)
{
    size_t nearest = 0;
    for (size_t i = 1; i < count; i++)
        if (state->codes[order[i]] < state->codes[order[nearest]])
            nearest = i;
    model_composite(state, &state->scene->fragments[order[nearest]]);
    for (size_t i = nearest; i + 1 < count; i++)
        order[i] = order[i + 1];
}

static void keep_k(model_state *state, uint32_t s, size_t *order, size_t count, uint32_t k)
{
    (void)s;
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        order[kept++] = order[i];
        if (kept > k)
            composite_nearest(state, order, kept--);
    }
    for (; kept > 0; kept--)
        composite_nearest(state, order, kept);
}

model_result model_k_buffer(const model_scene *scene, uint32_t k)
{
    return each_sample(scene, k, keep_k);
}

// k at a time while the last place's stencil, k + 1 more each pass from k + 1 on, fits 8 bits.
static void capture(model_state *state, uint32_t s, size_t *order, size_t count, uint32_t k)
{
    (void)s;
    uint64_t passes = 1;
    for (uint32_t first = k + 1; first <= 255; first += k, passes++) {
        const size_t taken = count < k ? count : k;
        for (size_t left = taken; left > 0; left--)
            composite_nearest(state, order, left);
        order += taken;
        count -= taken;
        if (count == 0)
            break;
    }
    state->result.passes = passes > state->result.passes ? passes : state->result.passes;
}

model_result model_stencil_routed(const model_scene *scene, uint32_t k)
{
    model_result result = each_sample(scene, k, capture);
    result.iterations = result.passes;
    return result;
}
