// Small images in memory for the tests of the peeling programs that go beyond the papers: fragments of one transparent
// draw, perhaps behind an opaque one; replayed without a file, so that tens of thousands take seconds.
#ifndef ROPSIM_TEST_BEYOND_FIXTURE_H
#define ROPSIM_TEST_BEYOND_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../sim/sim.h"

#include <stdlib.h>
#include <string.h>

enum { IMAGE_FRAGMENTS_MAX = 400000 };

// Opaque fragments come first. Fragment i of the transparent ones is fragment opaque + i.
typedef struct small_image {
    uint32_t width, height;  // samples are pixels
    uint32_t count, opaque;
    uint16_t x[IMAGE_FRAGMENTS_MAX], y[IMAGE_FRAGMENTS_MAX];
    uint8_t sample[IMAGE_FRAGMENTS_MAX];
    double depth[IMAGE_FRAGMENTS_MAX];
    float rgba[4][IMAGE_FRAGMENTS_MAX];
    uint32_t primitive[IMAGE_FRAGMENTS_MAX];
    int next_draw;  // of the walk
} small_image;

static inline uint64_t image_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static inline uint32_t image_below(uint64_t *state, uint32_t count)
{
    return (uint32_t)(image_random(state) >> 32) % count;
}

// Colours differ from fragment to fragment, so that two in the wrong order, one lost and one twice are all seen.
static inline void image_add(small_image *image, uint32_t pixel, bool opaque, double depth)
{
    const uint32_t i = image->count++;
    uint64_t state = i;
    assert_true(i < IMAGE_FRAGMENTS_MAX && (!opaque || i == image->opaque));
    image->opaque += opaque;
    image->x[i] = (uint16_t)(pixel % image->width);
    image->y[i] = (uint16_t)(pixel / image->width);
    image->sample[i] = 0;
    image->depth[i] = depth;
    image->primitive[i] = i;
    for (int c = 0; c < 3; c++)
        image->rgba[c][i] = (float)(image_random(&state) >> 40) * 0x1p-24f;
    image->rgba[3][i] = 0.2f + 0.4f * (float)(image_random(&state) >> 40) * 0x1p-24f;
}

static inline status image_rewind(void *user)
{
    ((small_image *)user)->next_draw = 0;
    return STATUS_OK;
}

static inline status image_next(void *user, fragments *run)
{
    small_image *image = user;
    const int draw = image->next_draw++;
    const uint32_t first = draw == 0 ? 0 : image->opaque;
    *run = (fragments){
        .draw = (uint32_t)draw,
        .count = draw == 0   ? image->opaque
                 : draw == 1 ? image->count - image->opaque
                             : 0,
        .x = image->x + first,
        .y = image->y + first,
        .sample = image->sample + first,
        .depth = image->depth + first,
        .rgba = {image->rgba[0] + first, image->rgba[1] + first, image->rgba[2] + first, image->rgba[3] + first},
        .primitive = image->primitive + first};
    return run->count == 0 && draw == 0 ? image_next(user, run) : STATUS_OK;  // an empty run would be the end
}

// Free with result_destroy. `iterations`: at most so many; 0: as many as it takes.
static inline run_result *image_run(const program *program, const machine *machine, small_image *image,
                                    uint64_t iterations)
{
    trace_draw draws[] = {{.name = "opaque", .class = CLASS_OPAQUE, .fragments = image->opaque},
                          {.name = "layers", .class = CLASS_TRANSPARENT, .fragments = image->count - image->opaque}};
    trace_info info = {.width = image->width,
                       .height = image->height,
                       .samples = 1,
                       .background = {0.25f, 0.5f, 0.75f, 1},
                       .depth_bits = 64,
                       .draws = draws,
                       .draw_count = 2,
                       .fragment_count = image->count};
    const trace_source source = {image_next, image_rewind, image};
    const run_options options = {.threads = 1, .max_iterations = iterations, .occlusion_ratio = -1, .reference = true};
    trace *trace;
    run_result *result;
    trace_standard_positions(&info);
    image_rewind(image);
    assert_int_equal(trace_from_source(&info, &source, NULL, &trace), STATUS_OK);
    assert_int_equal(replay_run(program, machine, trace, &options, NULL, &result), STATUS_OK);
    trace_close(trace);
    assert_true(iterations > 0 || !result->iteration_limit_reached);
    return result;
}

// Depths on a grid or anywhere, in blocks of ascending, descending or no order, with an opaque surface in half of them.
static inline void image_at_random(small_image *image, uint64_t seed, uint32_t width, uint32_t height, uint32_t most)
{
    uint64_t state = seed;
    image->width = width;
    image->height = height;
    image->count = image->opaque = 0;
    for (uint32_t pixel = 0; pixel < width * height; pixel++)
        if (image_below(&state, 4) == 0)
            image_add(image, pixel, true, 0.25 + image_below(&state, 13) / 16.0);
    const uint32_t fragments = image_below(&state, most * width * height + 1),
                   grid = image_below(&state, 2) ? 12 : 1000000;
    for (uint32_t i = 0; i < fragments;) {
        const uint32_t run = 1 + image_below(&state, 9), order = image_below(&state, 3);
        const uint32_t pixel = image_below(&state, width * height);
        uint32_t at = image_below(&state, grid + 1);
        for (uint32_t k = 0; k < run && i < fragments; k++, i++) {
            image_add(image, pixel, false, (double)at / grid);
            const uint32_t step = image_below(&state, grid / 10 + 1);
            at = order == 0 ? image_below(&state, grid + 1) : order == 1 ? at + step : at - step;
            at = at > grid ? (order == 1 ? grid : 0) : at;
        }
    }
}

// Programs under test, on the machine with the widest formats.
typedef struct contest {
    machine machine;
    program *programs[8];
    const char *names[8];
    int count;
} contest;

static inline void contest_start(contest *c, const char *const *names, int count)
{
    char path[4096];
    assert_int_equal(machine_load("programmable", NULL, &c->machine), STATUS_OK);
    c->count = count;
    for (int i = 0; i < count; i++) {
        c->names[i] = names[i];
        assert_int_equal(program_load(names[i], NULL, path, sizeof path, &c->programs[i]), STATUS_OK);
    }
}

static inline void contest_end(contest *c)
{
    for (int i = 0; i < c->count; i++)
        program_destroy(c->programs[i]);
}

// Runs each on the image, asks for the exact result and returns the passes of each.
static inline void contest_run(const contest *c, small_image *image, const char *what, uint64_t number,
                               uint64_t *passes)
{
    for (int i = 0; i < c->count; i++) {
        run_result *run = image_run(c->programs[i], &c->machine, image, 0);
        if (!run->error.exact)
            fail_msg("%s, %s %llu: off by %g at %llu samples", c->names[i], what, (unsigned long long)number,
                     run->error.max_abs, (unsigned long long)run->error.samples_wrong);
        passes[i] = run->geometry_passes;
        result_destroy(run);
    }
}

// One sample with layers at these ranks, in this order of arrival, near < rank 0 < ... < far.
static inline void image_of_ranks(small_image *image, const uint8_t *ranks, uint32_t count)
{
    image->width = image->height = 1;
    image->count = image->opaque = 0;
    for (uint32_t i = 0; i < count; i++)
        image_add(image, 0, false, (ranks[i] + 1) / 256.0);
}

// The next sequence of that length in which each rank up to the largest occurs, by counting in base `length`; start
// from all zeros. False after the last. These are all orders of arrival of `length` fragments, all ties among them.
static inline bool ranks_next(uint8_t *ranks, uint32_t length)
{
    for (;;) {
        uint32_t seen = 0, i = 0;
        while (i < length && ranks[i] + 1u == length)
            ranks[i++] = 0;
        if (i == length)
            return false;
        ranks[i]++;
        for (i = 0; i < length; i++)
            seen |= 1u << ranks[i];
        if ((seen & (seen + 1)) == 0)
            return true;
    }
}

// Layers of the deepest sample: distinct depths, as binary32, between the near plane and the opaque surface, both open.
static inline uint32_t image_layers(const small_image *image)
{
    uint32_t most = 0;
    for (uint32_t pixel = 0; pixel < image->width * image->height; pixel++) {
        float seen[256], bound = 1;
        uint32_t count = 0;
        for (uint32_t i = 0; i < image->count; i++) {
            const float z = (float)image->depth[i];
            uint32_t at = 0;
            if (image->x[i] + image->y[i] * image->width != pixel || z <= 0 || z >= bound)
                continue;
            if (i < image->opaque) {
                bound = z;
                continue;
            }
            while (at < count && seen[at] != z)
                at++;
            assert_true(at < 256);
            seen[at] = z;
            count += at == count;
        }
        most = count > most ? count : most;
    }
    return most;
}

// The fewest intervals of depth, each with all its fragments in order of arrival, that hold all layers of a sample; of
// the sample that needs most. Taken from the nearest layer on, each as long as it goes.
static inline uint32_t image_spans(const small_image *image)
{
    uint32_t most = 0;
    for (uint32_t pixel = 0; pixel < image->width * image->height; pixel++) {
        float bound = 1, floor = 0;
        uint32_t spans = 0;
        for (;; spans++) {
            // The span ends in front of the nearest fragment beyond `floor` that a nearer one follows.
            float end = bound;
            bool any = false;
            for (uint32_t i = 0; i < image->count; i++) {
                const float z = (float)image->depth[i];
                if (image->x[i] + image->y[i] * image->width != pixel)
                    continue;
                if (i < image->opaque) {
                    bound = end = z < bound ? z : bound;
                    continue;
                }
                if (z <= floor || z >= bound)
                    continue;
                any = true;
                for (uint32_t k = i + 1; k < image->count && z < end; k++)
                    if (image->x[k] + image->y[k] * image->width == pixel && (float)image->depth[k] > floor &&
                        (float)image->depth[k] < z)
                        end = z;
            }
            if (!any)
                break;
            float last = floor;  // the deepest of the span
            for (uint32_t i = image->opaque; i < image->count; i++)
                if (image->x[i] + image->y[i] * image->width == pixel && (float)image->depth[i] < end &&
                    (float)image->depth[i] > last)
                    last = (float)image->depth[i];
            floor = last;
        }
        most = spans > most ? spans : most;
    }
    return most;
}

// All orders of arrival of `length` fragments, at one sample each. `layers`: distinct depths of each sample.
enum { ORDERS_MAX = 47293, ORDERS_WIDTH = 256, ORDERS_LENGTH_MAX = 7 };
static inline uint32_t image_of_orders(small_image *image, uint32_t length, uint8_t *layers)
{
    uint8_t ranks[ORDERS_LENGTH_MAX + 1] = {0};
    uint32_t count = 0;
    image->width = ORDERS_WIDTH;
    image->count = image->opaque = 0;
    do {
        layers[count] = 0;
        for (uint32_t i = 0; i < length; i++) {
            layers[count] = ranks[i] + 1 > layers[count] ? (uint8_t)(ranks[i] + 1) : layers[count];
            image_add(image, count, false, (ranks[i] + 1) / 256.0);
        }
        count++;
    } while (ranks_next(ranks, length));
    image->height = (count + ORDERS_WIDTH - 1) / ORDERS_WIDTH;
    return count;
}

// The pass after which each sample has its colour, of a program with one pass an iteration: what it would take alone.
// Found by ending the program after 1, 2, ... passes.
static inline void image_sample_passes(const contest *c, int number, small_image *image, uint32_t samples,
                                       uint8_t *passes)
{
    run_result *whole = image_run(c->programs[number], &c->machine, image, 0);
    if (!whole->error.exact)
        fail_msg("%s: off by %g at %llu samples", c->names[number], whole->error.max_abs,
                 (unsigned long long)whole->error.samples_wrong);
    memset(passes, 0, samples);
    for (uint64_t pass = whole->iterations; pass > 0; pass--) {
        run_result *part = image_run(c->programs[number], &c->machine, image, pass);
        for (uint32_t i = 0; i < samples; i++)
            if ((passes[i] == 0 || passes[i] == pass + 1) &&
                memcmp(part->sample_rgb + 3 * i, whole->sample_rgb + 3 * i, 3 * sizeof(float)) == 0)
                passes[i] = (uint8_t)pass;
        result_destroy(part);
    }
    result_destroy(whole);
}

#endif
