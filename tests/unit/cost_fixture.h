// Hand-made traces for tests of what passes cost: boxes of fragments, one primitive each, replayed at the level cycle
// by a program in text. Every box is full, so that a test's arithmetic needs its corners alone.
#ifndef ROPSIM_TEST_COST_FIXTURE_H
#define ROPSIM_TEST_COST_FIXTURE_H

#include "messages.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <stdlib.h>

// Pixels [x0, x1) x [y0, y1), all samples; a draw for each run of boxes of one class.
typedef struct box {
    uint32_t x0, y0, x1, y1;
    double depth;
    draw_class class;
} box;

enum { COST_DRAWS_MAX = 8, COST_RUN = 4096 };

typedef struct box_scene {
    uint32_t width, height, samples;
    const box *boxes;
    uint32_t count;
    uint64_t triangles, vertices;  // of the first draw
    // Where the reader stands:
    uint32_t at, x, y, sample;
    trace_draw draws[COST_DRAWS_MAX];
    uint16_t xs[COST_RUN], ys[COST_RUN];
    uint8_t samples_of[COST_RUN];
    double depths[COST_RUN];
    float rgba[4][COST_RUN];
    uint32_t primitives[COST_RUN];
} box_scene;

static inline uint32_t cost_draw_of(const box_scene *s, uint32_t at)
{
    uint32_t draw = 0;
    for (uint32_t i = 1; i <= at; i++)
        draw += s->boxes[i].class != s->boxes[i - 1].class;
    return draw;
}

static inline void cost_enter(box_scene *s)
{
    s->sample = 0;
    s->x = s->at < s->count ? s->boxes[s->at].x0 : 0;
    s->y = s->at < s->count ? s->boxes[s->at].y0 : 0;
}

static inline status cost_rewind(void *user)
{
    box_scene *s = user;
    s->at = 0;
    cost_enter(s);
    return STATUS_OK;
}

// Fragments of one draw, row by row.
static inline status cost_next(void *user, fragments *run)
{
    box_scene *s = user;
    const uint32_t first = s->at;
    uint32_t n = 0;
    while (n < COST_RUN && s->at < s->count && s->boxes[s->at].class == s->boxes[first].class) {
        const box *b = &s->boxes[s->at];
        s->xs[n] = (uint16_t)s->x;
        s->ys[n] = (uint16_t)s->y;
        s->samples_of[n] = (uint8_t)s->sample;
        s->depths[n] = b->depth;
        for (int c = 0; c < 4; c++)
            s->rgba[c][n] = 0.5f;
        s->primitives[n++] = s->at;
        if (++s->sample < s->samples)
            continue;
        s->sample = 0;
        if (++s->x < b->x1)
            continue;
        s->x = b->x0;
        if (++s->y < b->y1)
            continue;
        s->at++;
        cost_enter(s);
    }
    *run = (fragments){.draw = n ? cost_draw_of(s, first) : 0,
                       .count = n,
                       .x = s->xs,
                       .y = s->ys,
                       .sample = s->samples_of,
                       .depth = s->depths,
                       .rgba = {s->rgba[0], s->rgba[1], s->rgba[2], s->rgba[3]},
                       .primitive = s->primitives};
    return STATUS_OK;
}

static inline trace *cost_trace(box_scene *s)
{
    trace_info info = {
        .width = s->width, .height = s->height, .samples = s->samples, .depth_bits = 64, .draws = s->draws};
    trace_standard_positions(&info);
    memset(s->draws, 0, sizeof s->draws);
    for (uint32_t i = 0; i < s->count; i++) {
        const box *b = &s->boxes[i];
        const uint64_t count = (uint64_t)(b->x1 - b->x0) * (b->y1 - b->y0) * s->samples;
        info.draw_count += i == 0 || b->class != s->boxes[i - 1].class;
        assert_true(info.draw_count <= COST_DRAWS_MAX);
        trace_draw *draw = &s->draws[info.draw_count - 1];
        snprintf(draw->name, sizeof draw->name, "boxes");
        draw->class = b->class;
        draw->fragments += count;
        info.fragment_count += count;
    }
    s->draws[0].triangles = s->triangles;
    s->draws[0].vertices = s->vertices;
    cost_rewind(s);
    trace *opened = NULL;
    assert_int_equal(trace_from_source(&info, &(trace_source){cost_next, cost_rewind, s}, NULL, &opened), STATUS_OK);
    return opened;
}

// A shipped machine with keys set: "key=value" words parted by blanks.
static inline machine cost_machine(const char *name, const char *sets)
{
    machine machine;
    char word[256];
    assert_int_equal(machine_load(name, NULL, &machine), STATUS_OK);
    for (const char *at = sets ? sets : ""; *at;) {
        const size_t length = strcspn(at, " ");
        snprintf(word, sizeof word, "%.*s", (int)length, at);
        if (length && machine_set(&machine, word, NULL) != STATUS_OK)
            fail_msg("%s: %s", name, word);
        at += length + strspn(at + length, " ");
    }
    return machine;
}

// Replays and times it, with every check of detail_run; fails the test with what was said. Free with detail_destroy.
static inline detail_result *cost_trace_at(const program *program, const machine *machine, trace *trace,
                                           detail_level level)
{
    messages said;
    run_result *function = NULL;
    detail_result *detail = NULL;
    messages_start(&said);
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    if (replay_run(program, machine, trace, &options, &said.report, &function) != STATUS_OK ||
        detail_run(program, machine, trace, function, &(detail_options){.level = level}, &said.report, &detail) !=
            STATUS_OK)
        fail_msg("%s on %s: %s", program->name, machine->name, said.text);
    result_destroy(function);
    return detail;
}

static inline program *cost_program(const char *text)
{
    messages said;
    program *program = NULL;
    messages_start(&said);
    if (assemble_text("test", text, strlen(text), &said.report, &program) != STATUS_OK)
        fail_msg("%s", said.text);
    return program;
}

static inline detail_result *cost_run(const char *text, const machine *machine, box_scene *scene)
{
    program *program = cost_program(text);
    trace *trace = cost_trace(scene);
    detail_result *detail = cost_trace_at(program, machine, trace, DETAIL_CYCLE);
    trace_close(trace);
    program_destroy(program);
    return detail;
}

// The last pass that draws.
static inline const pass_record *cost_draw(const detail_result *detail)
{
    const pass_record *found = NULL;
    for (uint64_t i = 0; i < detail->pass_count; i++)
        if (detail->passes[i].info.kind == PASS_DRAW)
            found = &detail->passes[i];
    assert_non_null(found);
    return found;
}

// `layers` boxes that fill the image, from the back to the front, so that each passes a test for less.
static inline box *cost_layers(uint32_t width, uint32_t height, uint32_t layers, draw_class class)
{
    box *boxes = calloc(layers, sizeof *boxes);
    assert_non_null(boxes);
    for (uint32_t i = 0; i < layers; i++)
        boxes[i] = (box){0, 0, width, height, 1 - (i + 1.0) / (layers + 2), class};
    return boxes;
}

#endif
