// Random images for tests of programs: blocks of surfaces in ascending, descending or no order, of every class, with
// ties, alphas of 0 and 1, several samples. The same seed gives the same image.
#ifndef ROPSIM_TEST_TRACE_IMAGES_H
#define ROPSIM_TEST_TRACE_IMAGES_H

#include "trace_small.h"

static inline uint64_t random_next(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static inline uint32_t below(uint64_t *state, uint32_t count)
{
    return (uint32_t)(random_next(state) >> 32) % count;
}

static inline double unit(uint64_t *state)
{
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

// A surface's depth: on a coarse grid, so that depths tie, the ends of the range among them; or anywhere.
static inline double random_depth(uint64_t *state, bool coarse)
{
    return coarse ? below(state, 13) / 12.0 : unit(state);
}

static inline int ascending(const void *left, const void *right)
{
    const double a = *(const double *)left, b = *(const double *)right;
    return a < b ? -1 : a > b;
}

static inline int descending(const void *left, const void *right)
{
    return ascending(right, left);
}

// One draw: a block of surfaces in ascending, descending or no order, each covering part of the samples.
static inline void add_block(small_trace *t, uint64_t *state, bool coarse)
{
    enum { SURFACES_MAX = 12 };
    double depths[SURFACES_MAX];
    const uint32_t surfaces = 1 + below(state, SURFACES_MAX), order = below(state, 4), kind = below(state, 8);
    const draw_class class = kind == 0 ? CLASS_OPAQUE : kind == 1 ? CLASS_SORTED : CLASS_TRANSPARENT;
    for (uint32_t i = 0; i < surfaces; i++)
        depths[i] = random_depth(state, coarse);
    if (order < 3)
        qsort(depths, surfaces, sizeof *depths, order == 2 ? descending : ascending);
    const uint32_t coverage = 20 + below(state, 81);  // percent
    for (uint32_t i = 0; i < surfaces; i++) {
        const float rgba[4] = {(float)unit(state), (float)unit(state), (float)unit(state),
                               below(state, 10) ? (float)unit(state) : (float)below(state, 2)};
        for (uint32_t s = 0; s < t->width * t->height * t->samples; s++)
            if (below(state, 100) < coverage)
                small_add(t, s / t->samples % t->width, s / t->samples / t->width, s % t->samples, class, depths[i],
                          rgba);
    }
}

static inline small_trace random_image(uint64_t seed)
{
    uint64_t state = seed;
    small_trace t = {.width = 1 + below(&state, 4), .height = 1 + below(&state, 3), .samples = 1u << below(&state, 4)};
    for (int c = 0; c < 4; c++)
        t.background[c] = (float)unit(&state);
    const bool coarse = seed % 3 != 0;
    for (uint32_t blocks = below(&state, 6); blocks > 0; blocks--)
        add_block(&t, &state, coarse);
    return t;
}

#endif
