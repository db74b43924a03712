// Scenes of single fragments as traces in memory, and their order, for tests of visibility ordering.
#ifndef ROPSIM_TEST_ORDER_FIXTURE_H
#define ROPSIM_TEST_ORDER_FIXTURE_H

#include "messages.h"
#include "order_model.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

typedef struct scene_reader {
    const order_scene *scene;
    size_t at;
} scene_reader;

static inline status scene_next(void *user, fragments *run)
{
    static uint16_t x, y;
    static uint8_t sample;
    static const float one[1] = {1};
    scene_reader *reader = user;
    memset(run, 0, sizeof *run);
    if (reader->at == reader->scene->count)
        return STATUS_OK;
    const order_fragment *f = &reader->scene->fragments[reader->at++];
    x = (uint16_t)f->x;
    y = (uint16_t)f->y;
    sample = (uint8_t)f->sample;
    *run = (fragments){f->draw, 1, &x, &y, &sample, &f->depth, {one, one, one, one}, &f->primitive};
    return STATUS_OK;
}

static inline status scene_rewind(void *user)
{
    ((scene_reader *)user)->at = 0;
    return STATUS_OK;
}

// Orders the scene on `machine` as changed by `assignment` (NULL: not). What was said is kept in `said`.
static inline status scene_order(const order_scene *scene, const char *machine_name, const char *assignment,
                                 const order_options *options, messages *said, order_result **result)
{
    machine machine;
    trace_draw draws[4] = {0};
    for (uint32_t d = 0; d < scene->draw_count; d++) {
        strcpy(draws[d].name, "draw");
        draws[d].class = scene->classes[d];
        draws[d].triangles = scene->triangles[d];
    }
    for (size_t i = 0; i < scene->count; i++)
        draws[scene->fragments[i].draw].fragments++;
    const trace_info info = {.width = scene->width,
                             .height = scene->height,
                             .samples = scene->samples,
                             .depth_bits = 64,
                             .draws = draws,
                             .draw_count = scene->draw_count,
                             .fragment_count = scene->count};
    scene_reader reader = {scene, 0};
    trace *trace;
    messages_start(said);
    assert_int_equal(machine_load(machine_name, &said->report, &machine), STATUS_OK);
    if (assignment)
        assert_int_equal(machine_set(&machine, assignment, &said->report), STATUS_OK);
    assert_int_equal(trace_from_source(&info, &(trace_source){scene_next, scene_rewind, &reader}, NULL, &trace),
                     STATUS_OK);
    const status status = order_run(trace, &machine, options, &said->report, result);
    trace_close(trace);
    return status;
}

// The same, where nothing may go wrong.
static inline order_result *scene_ordered(const order_scene *scene, const order_options *options)
{
    messages said;
    order_result *result;
    if (scene_order(scene, "programmable", NULL, options, &said, &result) != STATUS_OK)
        fail_msg("%s", said.text);
    return result;
}

static inline const order_primitive *find_primitive(const order_result *result, uint32_t draw, uint32_t primitive)
{
    for (uint64_t i = 0; i < result->primitive_count; i++)
        if (result->primitives[i].draw == draw && result->primitives[i].primitive == primitive)
            return &result->primitives[i];
    return NULL;
}

// One draw of class transparent, one sample a pixel, one row.
#define ROW_SCENE(pixels, table) \
    { \
        .width = (pixels), .height = 1, .samples = 1, .draw_count = 1, .classes = {CLASS_TRANSPARENT}, \
        .fragments = (table), .count = sizeof(table) / sizeof *(table) \
    }

#endif
