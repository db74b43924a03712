// The twin of the replay: the same programs on the same traces, run in the order in which they are defined.
//
// Pass by pass over the whole image, in each pass one fragment after the other, in scalar code, with planes as
// arrays over all samples. Slow and plain, so that it can be read against the manual (opcodes.def, formats.def,
// states.def, isa.h). It shares no code with the replay but the tables, the decoder of words and fpow's series;
// a fixed-function pass is run as the state machine that it declares, never as lowered instructions.
//
//   twin_image --twin_run--> twin_result      a run_result of replay_run must equal it: twin_compare
#ifndef ROPSIM_TWIN_H
#define ROPSIM_TWIN_H

#include "../../sim/sim.h"

enum { TWIN_DRAW_MAX = 8 };

typedef struct twin_fragment {
    uint32_t draw, x, y, sample;
    double depth;
    float rgba[4];
    uint32_t primitive;
} twin_fragment;

// A trace in memory, in raster order.
typedef struct twin_image {
    uint32_t width, height, samples;
    float background[4];
    bool reversed_depth, nonfinite;
    draw_class classes[TWIN_DRAW_MAX];  // of each draw
    uint32_t draw_count, fragment_count;
    twin_fragment *fragments;
} twin_image;

typedef struct twin_plane {
    uint64_t bytes_read, bytes_written, bytes_cleared, texture_bytes_read;
    uint32_t components;  // 4 for a colour plane, else 1
    uint32_t *values;     // components words a sample; samples by row, pixel, sample
} twin_plane;

typedef struct twin_result {
    uint64_t geometry_passes, passes_by_class[CLASS_COUNT], fullscreen_passes, iterations;
    bool iteration_limit_reached;
    uint64_t fragments_replayed, fragments_composited, deepest_sample, list_kept, list_lost;
    twin_plane planes[PLANE_MAX];
    int plane_count;
    float *sample_rgb, *image;
    double max_abs, rmse;
    uint64_t samples_wrong;
} twin_result;

// max_iterations 0 and a negative occlusion_ratio: as the program says, as in run_options.
void twin_run(const program *program, const rop_limits *limits, const twin_image *image, uint64_t max_iterations,
              double occlusion_ratio, twin_result *result);
void twin_free(twin_result *result);

// Writes the first difference into `difference` and returns false, if there is one.
bool twin_compare(const program *program, const twin_result *twin, const run_result *run, char difference[256]);

// ---- Between the twin's files --------------------------------------------------------------------------

typedef struct twin_batches {
    uint32_t near_code[TWIN_DRAW_MAX], far_code[TWIN_DRAW_MAX];  // of each batch
    bool drawn[TWIN_DRAW_MAX][TWIN_DRAW_MAX];                    // batch, draw
    uint32_t count, current;
} twin_batches;

typedef struct twin {
    const program *program;
    const rop_limits *limits;
    const twin_image *image;
    uint64_t sample_count;
    format formats[PLANE_MAX];
    uint32_t largest[PLANE_MAX];  // all value bits of a plane
    uint64_t queries[QUERY_MAX];
    twin_batches batches;         // of the `batches` that the schedule is in
    twin_result *result;
} twin;

// Makes the batches of a `batches` step, and runs a `list` step (twin_draws.c).
void twin_make_batches(twin *twin, uint32_t draws_each);
void twin_list(twin *twin, const step *step);

// One fragment through a kernel's words; `fragment` NULL in a full-screen pass (twin_kernel.c).
void twin_kernel(twin *twin, const kernel_decl *kernel, uint64_t sample, const twin_fragment *fragment);
// One fragment through a pass's shader: what it leaves in its colours, and whether it keeps the fragment.
bool twin_shader(twin *twin, const pass_decl *pass, uint64_t sample, const twin_fragment *fragment,
                 uint32_t colors[COLOR_COUNT][4]);
// One fragment through a declared pass; `fragment` NULL in a full-screen pass (twin_pass.c).
void twin_pass(twin *twin, const pass_decl *pass, uint64_t sample, const twin_fragment *fragment);

typedef enum twin_access { TWIN_READ, TWIN_TEXTURE } twin_access;
// A sample's value in a plane: 1 or 4 words. Counts the bytes.
void twin_load(twin *twin, int plane, uint64_t sample, twin_access access, uint32_t *value);
void twin_store(twin *twin, int plane, uint64_t sample, const uint32_t *value);
// The fragment's colour, straight or premultiplied, and one blend state.
void twin_color(const twin_fragment *fragment, int source, uint32_t rgba[4]);
void twin_blend(twin *twin, int blend, const uint32_t source[4], const uint32_t destination[4], uint32_t out[4]);
uint32_t twin_value(const twin *twin, const value *value);

// Numbers (twin_numbers.c), each written from formats.def alone.
float twin_float(uint32_t bits);
uint32_t twin_bits(float value);  // a NaN becomes the canonical one
uint32_t twin_depth_code(format format, double depth, bool reversed);
float twin_code_depth(format format, uint32_t code, bool reversed);
uint32_t twin_far(format format);
uint32_t twin_round(format format, uint32_t component);

// The exact result of every sample by sorting, and the error figures (twin_error.c).
void twin_error(const twin_image *image, twin_result *result);

static inline uint64_t twin_sample(const twin_image *image, const twin_fragment *fragment)
{
    return ((uint64_t)fragment->y * image->width + fragment->x) * image->samples + fragment->sample;
}

#endif
