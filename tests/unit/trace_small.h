// Small traces for tests of programs: fragments added one by one, as a scene of the model and as a trace on disk.
#ifndef ROPSIM_TEST_TRACE_SMALL_H
#define ROPSIM_TEST_TRACE_SMALL_H

#include "../../sim/sim.h"
#include "../model/model.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct small_trace {
    uint32_t width, height, samples;
    float background[4];
    model_fragment *fragments;  // raster order
    draw_class *classes;        // of each
    size_t count, capacity;
} small_trace;

static inline void small_add(small_trace *t, uint32_t x, uint32_t y, uint32_t sample, draw_class class, double depth,
                             const float rgba[4])
{
    if (t->count == t->capacity) {
        t->capacity = t->capacity ? 2 * t->capacity : 64;
        t->fragments = realloc(t->fragments, t->capacity * sizeof *t->fragments);
        t->classes = realloc(t->classes, t->capacity * sizeof *t->classes);
        assert(t->fragments && t->classes);
    }
    model_fragment *f = &t->fragments[t->count];
    *f = (model_fragment){
        .sample = (y * t->width + x) * t->samples + sample, .opaque = class == CLASS_OPAQUE, .sorted = class == CLASS_SORTED, .depth = depth};
    for (int c = 0; c < 4; c++)
        f->rgba[c] = (double)rgba[c];
    t->classes[t->count++] = class;
}

static inline model_scene small_scene(const small_trace *t)
{
    return (model_scene){t->width * t->height * t->samples,
                         t->fragments,
                         t->count,
                         {(double)t->background[0], (double)t->background[1], (double)t->background[2]}};
}

// Writes it to a file of its own, a draw for each run of one class, and opens that; NULL if anything fails.
static inline trace *small_open(const small_trace *t)
{
    char folder[] = "/tmp/ropsim-small-XXXXXX", path[64];
    trace_writer *writer;
    trace *opened = NULL;
    trace_info info = {.width = t->width, .height = t->height, .samples = t->samples, .depth_bits = 64};
    memcpy(info.background, t->background, sizeof info.background);
    trace_standard_positions(&info);
    if (!mkdtemp(folder))
        return NULL;
    snprintf(path, sizeof path, "%s/trace.ropt", folder);
    if (trace_create(path, &info, NULL, &writer) == STATUS_OK) {
        for (size_t i = 0; i < t->count; i++) {
            const model_fragment *f = &t->fragments[i];
            const uint32_t pixel = f->sample / t->samples, primitive = (uint32_t)i;
            const uint16_t x = (uint16_t)(pixel % t->width), y = (uint16_t)(pixel / t->width);
            const uint8_t sample = (uint8_t)(f->sample % t->samples);
            const float rgba[4] = {(float)f->rgba[0], (float)f->rgba[1], (float)f->rgba[2], (float)f->rgba[3]};
            const fragments one = {.count = 1,
                                   .x = &x,
                                   .y = &y,
                                   .sample = &sample,
                                   .depth = &f->depth,
                                   .rgba = {&rgba[0], &rgba[1], &rgba[2], &rgba[3]},
                                   .primitive = &primitive};
            if (i == 0 || t->classes[i] != t->classes[i - 1])
                trace_begin_draw(writer, "draw", t->classes[i]);
            trace_append(writer, &one);
            if (i + 1 == t->count || t->classes[i] != t->classes[i + 1])
                trace_end_draw(writer, 0, 0);
        }
        char hash[33];
        if (trace_finish(writer, hash) == STATUS_OK)
            trace_open(path, NULL, &opened);
    }
    unlink(path);
    rmdir(folder);
    return opened;
}

static inline void small_free(small_trace *t)
{
    free(t->fragments);
    free(t->classes);
    memset(t, 0, sizeof *t);
}

// One pixel with one transparent layer a number, in that order of arrival; colours differ from layer to layer.
static inline small_trace small_layers(const double *depths, size_t count)
{
    small_trace t = {.width = 1, .height = 1, .samples = 1, .background = {0.25f, 0.5f, 0.75f, 1}};
    for (size_t i = 0; i < count; i++) {
        const float rgba[4] = {(float)(i % 3) / 2, (float)(i % 5) / 4, (float)(i % 7) / 6, count > 64 ? 0.02f : 0.5f};
        small_add(&t, 0, 0, 0, CLASS_TRANSPARENT, depths[i], rgba);
    }
    return t;
}

static inline program *small_program(const char *stem)
{
    char path[4096];
    program *program = NULL;
    snprintf(path, sizeof path, "%s/programs/%.100s.rop", ROPSIM_SOURCE, stem);
    assemble_file(path, NULL, &program);
    return program;
}

// Replays the trace on a shipped machine, with limits as in run_options; NULL if anything fails. Free with result_destroy.
static inline run_result *small_run_limited(const program *program, const char *machine_name, const small_trace *t,
                                            uint64_t max_iterations, double occlusion_ratio)
{
    machine machine;
    run_result *result = NULL;
    const run_options options = {
        .threads = 1, .max_iterations = max_iterations, .occlusion_ratio = occlusion_ratio, .reference = true};
    trace *opened = small_open(t);
    if (program && opened && machine_load(machine_name, NULL, &machine) == STATUS_OK)
        replay_run(program, &machine, opened, &options, NULL, &result);
    trace_close(opened);
    return result;
}

static inline run_result *small_run(const program *program, const char *machine_name, const small_trace *t)
{
    return small_run_limited(program, machine_name, t, 0, -1);
}

#endif
