// The visibility order as the relation itself says it, for tests: who is in front of whom at any sample, closed
// transitively, without passes. For small traces only: it takes n^3 for n primitives.
#ifndef ROPSIM_TEST_ORDER_MODEL_H
#define ROPSIM_TEST_ORDER_MODEL_H

#include "../../sim/sim.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { MODEL_PRIMITIVES = 64 };

typedef struct order_fragment {
    uint32_t draw, x, y, sample;
    double depth;
    uint32_t primitive;
} order_fragment;

// Draw d is of class classes[d] and has triangles[d]; fragments come by draw.
typedef struct order_scene {
    uint32_t width, height, samples, draw_count;
    draw_class classes[4];
    uint64_t triangles[4];
    const order_fragment *fragments;
    size_t count;
} order_scene;

typedef struct order_model {
    uint32_t count;
    order_primitive primitives[MODEL_PRIMITIVES];    // in order of appearance
    bool front[MODEL_PRIMITIVES][MODEL_PRIMITIVES];  // [a][b]: a is in front of b at some sample
    bool reach[MODEL_PRIMITIVES][MODEL_PRIMITIVES];  // or in front of one that is
    uint32_t layer_count;
} order_model;

static inline uint32_t model_index(order_model *model, uint32_t draw, uint32_t primitive)
{
    for (uint32_t i = 0; i < model->count; i++)
        if (model->primitives[i].draw == draw && model->primitives[i].primitive == primitive)
            return i;
    assert(model->count < MODEL_PRIMITIVES);
    model->primitives[model->count] = (order_primitive){.draw = draw, .primitive = primitive};
    return model->count++;
}

static inline void model_relate(order_model *model, const order_scene *scene)
{
    for (size_t i = 0; i < scene->count; i++) {
        const order_fragment *a = &scene->fragments[i];
        if (scene->classes[a->draw] == CLASS_OPAQUE)
            continue;
        const uint32_t first = model_index(model, a->draw, a->primitive);
        for (size_t j = i + 1; j < scene->count; j++) {
            const order_fragment *b = &scene->fragments[j];
            if (scene->classes[b->draw] == CLASS_OPAQUE || a->x != b->x || a->y != b->y || a->sample != b->sample)
                continue;
            const uint32_t second = model_index(model, b->draw, b->primitive);
            if (a->depth <= b->depth)  // a arrived first
                model->front[first][second] = true;
            else
                model->front[second][first] = true;
        }
    }
}

static inline void model_close(order_model *model)
{
    memcpy(model->reach, model->front, sizeof model->reach);
    for (uint32_t k = 0; k < model->count; k++)
        for (uint32_t a = 0; a < model->count; a++)
            for (uint32_t b = 0; b < model->count; b++)
                model->reach[a][b] |= model->reach[a][k] && model->reach[k][b];
}

// The place follows from who reaches whom; the layer is the length of the longest chain in front.
static inline void model_place(order_model *model)
{
    for (uint32_t i = 0; i < model->count; i++) {
        order_place place = PLACE_LAYER;
        for (uint32_t j = 0; j < model->count; j++)
            if (model->reach[j][j] && model->reach[j][i])
                place = PLACE_BEHIND;
        model->primitives[i].place = model->reach[i][i] ? PLACE_CYCLE : place;
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (uint32_t a = 0; a < model->count; a++) {
            for (uint32_t b = 0; b < model->count; b++) {
                order_primitive *p = &model->primitives[a], *q = &model->primitives[b];
                if (model->front[a][b] && q->place == PLACE_LAYER && q->layer <= p->layer) {
                    q->layer = p->layer + 1;
                    changed = true;
                }
            }
        }
    }
    for (uint32_t i = 0; i < model->count; i++)
        if (model->primitives[i].place == PLACE_LAYER && model->primitives[i].layer >= model->layer_count)
            model->layer_count = model->primitives[i].layer + 1;
}

static inline void model_order(const order_scene *scene, order_model *model)
{
    memset(model, 0, sizeof *model);
    model_relate(model, scene);
    model_close(model);
    model_place(model);
}

#endif
