// The peeling algorithms as plain C, written from the papers and not from programs/: what a replay must agree with.
//
// Everything is per sample and pass-major: each pass walks all fragments in raster order. Depth is the exact code of
// binary32, kept as an integer; colour is double precision. Nothing here is fast.
#ifndef ROPSIM_MODEL_H
#define ROPSIM_MODEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct model_fragment {
    uint32_t sample;
    bool opaque, sorted;  // class of its draw; neither: unsorted
    double depth;         // 0 nearest
    double rgba[4];       // straight
} model_fragment;

// Fragments in raster order, those of opaque draws among them.
typedef struct model_scene {
    uint32_t sample_count;
    const model_fragment *fragments;
    size_t fragment_count;
    double background[3];
} model_scene;

typedef struct model_result {
    uint64_t passes, iterations;              // the last, empty iteration included; the opaque pass not counted
    uint64_t composited;                      // fragments that went into the image
    uint64_t unsorted_passes, sorted_passes;  // of hybrid layer peeling, by class of draws
    double (*rgb)[3];                         // a sample
} model_result;

// Working storage that all algorithms share: opaque depth, colour so far, transparent fragments.
typedef struct model_state {
    const model_scene *scene;
    uint32_t *opaque;    // depth code of the opaque surface, a sample
    double (*base)[3];   // its colour
    double (*front)[4];  // composited so far, and the transmittance
    uint32_t *codes;     // depth code, a fragment
    model_result result;
} model_state;

enum { MODEL_NEAR = 0, MODEL_FAR = 0x3f800000 };  // binary32 0 and 1

// False: out of memory. The result's image is taken over by model_finish; free it with model_free.
bool model_start(model_state *state, const model_scene *scene);
void model_composite(model_state *state, const model_fragment *fragment);
model_result model_finish(model_state *state);
void model_free(model_result *result);

// What each pass of coherent layer peeling A left at one sample, for iterations told apart by a number from 0.
typedef struct model_a_step {
    uint32_t after_first;    // pass 1: z-buffer, D(s_n)
    uint32_t stencil_first;  // and stencil
    uint32_t before;         // pass 2: z_min_prev
    uint32_t stencil_before;
    uint32_t run;  // pass 3: z-buffer
    uint32_t stencil_run;
    uint32_t after;  // pass 4: z_min_post
} model_a_step;

typedef struct model_a_options {
    bool closed_clip;     // passes 3 and 4 clip to a closed range, as section 5 prints it
    bool wrap;            // stencil counts wrap around where the paper's stop at the largest value
    model_a_step *steps;  // of sample 0, one an iteration; NULL: not wanted
    size_t step_max;
} model_a_options;

model_result model_exact(const model_scene *scene);  // sorted, ties in raster order; passes are 0
model_result model_layer_peel(const model_scene *scene);
model_result model_coherent_a(const model_scene *scene, const model_a_options *options);  // options NULL: none set
model_result model_ideal(const model_scene *scene, bool printed);
model_result model_sorted_blend(const model_scene *scene);
model_result model_everitt(const model_scene *scene);
// Stops after `peels` peels (0: no limit), or once a peel changed no more than `ratio` times the samples.
model_result model_vtk(const model_scene *scene, uint64_t peels, double ratio);
model_result model_hybrid(const model_scene *scene, bool printed);
// B composites again and again in its printed form where it starts too near: it is stopped after `iterations`.
model_result model_coherent_b(const model_scene *scene, bool printed, uint64_t iterations);
model_result model_fused(const model_scene *scene);
model_result model_two_ended(const model_scene *scene);
model_result model_dual(const model_scene *scene);
model_result model_weighted_average(const model_scene *scene);
model_result model_weighted_sum(const model_scene *scene);
model_result model_k_buffer(const model_scene *scene, uint32_t k);
model_result model_stencil_routed(const model_scene *scene, uint32_t k);

// Indices of the transparent fragments in front of the opaque surface and beyond the near plane, sample by sample, in
// raster order: those of sample s are order[start[s]] up to order[start[s + 1]]. Both are freed by the caller.
bool model_gather(const model_state *state, size_t **order, size_t **start);

#endif
