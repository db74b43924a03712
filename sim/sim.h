// The simulator: traces, recording, machines, replay, results. One way through:
//
//   mesh, scene --record_scenes--> trace file --trace_open--> fragments --replay_run--> run_result --result_write_json-->
//
// Stages do not include each other; they meet here. Every pointer that a call hands out says who frees it.
// Unless a call says otherwise, it returns STATUS_OK or says why through `report` and leaves its outputs NULL.
#ifndef ROPSIM_SIM_H
#define ROPSIM_SIM_H

#include "../isa/isa.h"

#define ROPSIM_VERSION "0.1.0"

// ---- Traces (sim/trace) --------------------------------------------------------------------------------

enum { TRACE_SIZE_MAX = 32768, TRACE_SAMPLES_MAX = 16, TRACE_DRAWS_MAX = 65536 };

typedef struct trace_draw {
    char name[NAME_SIZE];
    draw_class class;
    uint64_t triangles, vertices, fragments;
} trace_draw;

// What is known of a trace before its fragments.
typedef struct trace_info {
    uint32_t width, height, samples;                 // pixels, pixels, samples a pixel: 1, 2, 4, 8 or 16
    int16_t sample_positions[TRACE_SAMPLES_MAX][2];  // x, y from the pixel's centre in 1/256 pixel, y down
    float background[4];                             // straight RGBA
    bool nonfinite;       // infinities and NaN are allowed in depth and colour
    bool reversed_depth;  // the device stored 1 - depth; depth in the trace is 0 at the near plane all the same
    int depth_bits;       // 64, or 32: every depth is a float
    trace_draw *draws;
    uint32_t draw_count;
    uint64_t fragment_count;
    char hash[33];        // XXH3-128 of the content, in hex; the same for the text and the binary form
} trace_info;

// Sets D3D11.3's standard positions for `samples` of 1, 2, 4, 8 or 16 (19.2.4.1).
void trace_standard_positions(trace_info *info);

// A run of fragments of one draw in raster order, one array a column.
typedef struct fragments {
    uint32_t draw;   // index into trace_info.draws
    uint32_t count;
    const uint16_t *x, *y;
    const uint8_t *sample;
    const double *depth;   // 0 nearest, 1 farthest
    const float *rgba[4];  // straight
    const uint32_t *primitive;
} fragments;

typedef struct trace trace;
// Opens .ropt or .rtxt, by content. Checks the header, the index and (text) every line; fragments of the
// binary form are checked as they are read.
status trace_open(const char *path, const report *report, trace **trace);
void trace_close(trace *trace);
const trace_info *trace_get_info(const trace *trace);
// The next run, in raster order; count 0 at the end. The arrays belong to the trace until the next call.
status trace_next(trace *trace, fragments *fragments);
status trace_rewind(trace *trace);
// From the next rewind on, runs without any fragment in pixels [x0, x1) x [y0, y1) may be left out.
void trace_select(trace *trace, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1);
// From the next rewind on, runs may leave out all but x, y and sample (the other arrays are then NULL), which is read faster.
void trace_places_only(trace *trace, bool only);

// A trace whose fragments come from calls instead of a file, which mean what trace_next and trace_rewind mean. What they
// hand out is not checked: it must keep every rule of `info`, which is copied. Free with trace_close.
typedef struct trace_source {
    status (*next)(void *user, fragments *fragments);
    status (*rewind)(void *user);
    void *user;
} trace_source;
status trace_from_source(const trace_info *info, const trace_source *source, const report *report, trace **trace);

typedef struct trace_writer trace_writer;
// Writes aside and renames into place in trace_finish. `info`: size, samples, positions, background, flags;
// draws and counts come from what is written. Ending .rtxt: text; else binary.
status trace_create(const char *path, const trace_info *info, const report *report, trace_writer **writer);
status trace_begin_draw(trace_writer *writer, const char *name, draw_class class);
status trace_append(trace_writer *writer, const fragments *fragments);  // fragments->draw is ignored
status trace_end_draw(trace_writer *writer, uint64_t triangles, uint64_t vertices);
status trace_finish(trace_writer *writer, char hash[33]);  // frees the writer, also on failure
void trace_abandon(trace_writer *writer);                   // frees it and leaves no file; NULL is fine

// Reads every byte and checks every rule.
status trace_check(const char *path, const report *report);

// Figures of a whole trace: how deep its samples are and how near to front-to-back order they arrive.
enum { SUMMARY_BINS = 1025 };  // the last one: 1024 and more

typedef struct trace_summary {
    double depth_min, depth_max;        // of the finite depths of all fragments; 0 and 0 if there are none
    uint64_t depth_outside;             // finite depths below 0 or above 1: the ROP clamps them
    uint64_t nonfinite;                 // fragments with an infinity or a NaN
    // Of the transparent and sorted fragments, by sample:
    uint64_t samples, covered_samples;  // of the picture; with at least one such fragment
    uint64_t fragments;
    uint64_t deepest;                   // most fragments at one sample
    uint64_t histogram[SUMMARY_BINS];   // [k]: samples with k fragments
    uint64_t pairs;                     // neighbours in arrival order at one sample: fragments - covered_samples
    uint64_t pairs_in_order, pairs_tied;  // the second is not nearer than the first; has the same depth
    uint64_t runs, runs_most;           // stretches in front-to-back order: in total, most at one sample
} trace_summary;

// Reads the trace from its start, in bands of rows so that it needs at most 512 MiB; leaves it rewound, whole.
status trace_summarize(trace *trace, const report *report, trace_summary *summary);

// ---- Meshes and pictures (sim/io) ----------------------------------------------------------------------

// A triangle soup as the file has it: polygons triangulated in fan order, nothing merged or dropped but what
// `dropped_faces` counts (fewer than three distinct corners, or an index or coordinate that is not there).
typedef struct mesh {
    float (*positions)[3];
    uint32_t vertex_count;
    uint32_t (*triangles)[3];
    uint32_t triangle_count;
    uint32_t *face_of_triangle;    // the file's face number
    float (*vertex_normals)[3];    // from the file, else area-weighted
    float (*vertex_colors)[4];     // NULL if the file has none; straight RGBA in [0, 1]
    float (*face_colors)[4];       // NULL if the file has none; indexed by triangle
    bool colors_have_alpha;        // some colour of the file is not opaque
    uint32_t face_count, dropped_faces;
} mesh;

// Loads OBJ, PLY, OFF, STL or OM. Thread-safe. Free with mesh_destroy.
status mesh_load(const char *path, const report *report, mesh **mesh);
void mesh_destroy(mesh *mesh);

// Writes linear RGB floats, row by row from the top. Ending .exr or .pfm: as they are; .png: 8-bit sRGB.
status image_write_rgb(const char *path, uint32_t width, uint32_t height, const float *rgb, const report *report);
// STATUS_USAGE for an ending that it would refuse: to be asked before a long run.
status image_check_ending(const char *path, const report *report);
// Reads it back: .exr and .pfm as they are, .png from 8-bit sRGB to linear. Free *rgb with free().
status image_read_rgb(const char *path, const report *report, uint32_t *width, uint32_t *height, float **rgb);

// Deep EXR images: docs/trace.md says what a conversion keeps; what it loses is said as a warning. In memory as a whole.
status deep_export(trace *trace, const char *path, const report *report);  // the trace stands at its start
status deep_import(const char *from, const char *path, const report *report);  // writes a trace at `path`

// ---- Recording (sim/raster) ----------------------------------------------------------------------------

typedef struct camera {
    bool ortho;
    double fov_degrees;               // vertical, perspective
    double ortho_height;              // of the view in world units; 0: fit
    double eye[3], target[3], up[3];
    bool eye_set, target_set, up_set; // what is not set is fitted to the scene
    double near, far;                 // distances along the view; 0: fit
    bool reverse_z;
} camera;

typedef enum triangle_order { ORDER_NONE, ORDER_FRONT, ORDER_BACK, ORDER_BUCKET, ORDER_SHUFFLE } triangle_order;

typedef struct record_options {
    uint32_t width, height, samples;
    camera camera;
    double alpha;                     // of surfaces without an alpha of their own
    float background[4];
    triangle_order order;
    uint64_t order_parameter;         // buckets or seed
} record_options;

void record_defaults(record_options *options);
// Records scenes (see interfaces of `ropsim record`: [class:]FILE or [class:]scene:NAME,key=value...) to a trace.
status record_scenes(const char *const *scenes, int scene_count, const record_options *options, const char *path,
                     const report *report);
// Lists the built-in scenes and their keys with ranges and defaults.
void record_print_scenes(FILE *out);

// ---- Machines ------------------------------------------------------------------------------------------

typedef struct machine {
    char name[NAME_SIZE];
#define PARAM_INT(key, min, max, unit, meaning) int64_t key;
#define PARAM_BOOL(key, meaning) bool key;
#define PARAM_FORMAT(key, class, meaning) format key;
#define PARAM_CHOICE(key, words, meaning) int key;
#define PARAM_SET(key, table, meaning) uint32_t key;
#include "params.def"
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_FORMAT
#undef PARAM_CHOICE
#undef PARAM_SET
} machine;

// Loads a shipped machine by name or a machine file by path (a name with a '/' or an ending .yaml).
status machine_load(const char *name, const report *report, machine *machine);
status machine_set(machine *machine, const char *assignment, const report *report);  // "key=value"
status machine_print(const machine *machine, FILE *out);                             // a machine file again
status machine_print_keys(FILE *out);                                                // every key, as a Markdown table
void machine_hash(const machine *machine, char hash[33]);                            // of all values, not of the name
void machine_limits(const machine *machine, rop_limits *limits);
// Whether both have the same limits, which are all that the function level knows of a machine: every program gives the same result on both.
bool machine_same_limits(const machine *a, const machine *b);

// A key with its value as text, as machine files write it, and as a number where it is one.
typedef enum machine_value_kind { MACHINE_VALUE_INTEGER, MACHINE_VALUE_BOOL, MACHINE_VALUE_TEXT } machine_value_kind;
typedef struct machine_value {
    const char *key;
    machine_value_kind kind;
    int64_t number;    // BOOL: 0 or 1; TEXT: 0
    char text[1024];
} machine_value;
// The keys in their order from index 0; false past the last.
bool machine_get_value(const machine *machine, int index, machine_value *value);

// ---- Files and words -----------------------------------------------------------------------------------

// The path of a shipped file: `folder` is programs or machines, `name` has its ending ("" : the folder).
// Looked up in $ROPSIM_DATA, the installation, the source tree. Says nothing when it is not there.
status data_path(const char *folder, const char *name, char *path, size_t size);
// Stems of the shipped files of a folder with that ending, sorted; at most `max`. Returns how many.
int data_names(const char *folder, const char *ending, char (*names)[NAME_SIZE], int max);

// The word of a list that is closest to `word`, for "did you mean"; NULL if none is close.
const char *nearest_word(const char *word, const char *const *words, size_t count);

// A file written aside and renamed into place by aside_finish, so that nobody sees half a result.
typedef struct aside aside;
status aside_open(const char *path, const report *report, aside **aside, FILE **file);  // `file` is the aside's
status aside_create(const char *path, const report *report, aside **aside);  // for who opens aside_path itself
const char *aside_path(const aside *aside);
status aside_finish(aside *aside);   // closes, renames and frees; on failure no file stays
void aside_discard(aside *aside);    // frees it and leaves no file; NULL is fine

// A library of ours that is opened when it is first needed, found beside the command, a folder above it (test programs lie
// one deeper in a build folder), or in the installation's lib/ropsim. NULL, with the reason in `why`, if it is not there or
// does not open. It is never closed: the loader keeps what is open, so calling this again is cheap.
void *module_open(const char *name, char *why, size_t why_size);

// Loads a program as a user names it: the stem of a file of programs/ or a path (of text or of words), then values
// for its parameters: NAME[,PARAMETER=INTEGER...]. `path`: its file, for messages. Free with program_destroy.
status program_load(const char *words, const report *report, char *path, size_t size, program **program);
// Writes words as bytes, little-endian.
status program_save_words(const char *path, const uint32_t *words, size_t count, const report *report);

// ---- Replay (sim/replay) -------------------------------------------------------------------------------

typedef struct run_options {
    int threads;               // 0: one a processor
    int vector_bytes;          // 0: the widest
    uint64_t max_iterations;   // of each repeat; 0: the program's limit, else 2 * deepest sample + 16
    double occlusion_ratio;    // negative: the program's
    uint64_t stop_after_pass;  // end right after that pass, geometry (but opaque) and full-screen counted from 1; 0: never
    uint64_t memory_bytes;     // budget of the bins; 0: 4 GiB. A trace that needs more is replayed in bands.
    bool reference;            // also compute the exact result and the error
    bool keep_planes;          // also hand out every plane's values at the end
    bool log_conditions;       // also hand out how each `while` and `if` went, and the batches of draws
    bool every_batch;          // execute each batch, even if its outcome is foregone: the same comes out, later
} run_options;

// The draws of a `batches` step, nearest first, by the given number, after Wexler et al. 2005. Batch i owns the depths from
// `near_code` up to, not with, `far_code`, and draws every draw that reaches into them.
typedef struct draw_batch {
    uint32_t near_code, far_code;
    uint8_t *draws;                          // of each draw of the trace: whether it is drawn
    uint64_t class_fragments[CLASS_COUNT];   // of those
} draw_batch;

typedef struct draw_batches {
    draw_batch *batches;
    uint32_t count;
} draw_batches;
enum { BATCHES_MAX = 4 };  // `batches` steps of a schedule

// One evaluation of a `while` or `if`, over all samples of the image.
typedef struct condition_result {
    uint64_t count;  // of its query
    bool holds;      // false also for a `while` that stood at the limit of iterations
} condition_result;

typedef struct plane_result {
    char name[NAME_SIZE];
    format format;
    uint64_t bytes_read, bytes_written;   // at the ROP by kernels and copies, before any cache
    uint64_t bytes_cleared;               // by clears, which hardware does by marking blocks
    uint64_t texture_bytes_read;          // by the fragment shader's range clip
} plane_result;

typedef struct error_result {
    bool exact;                // max_abs <= 1e-5
    double max_abs, rmse;      // over the R, G and B of all samples
    double psnr_db;            // peak 1; infinity if rmse is 0
    uint64_t samples_wrong;    // samples with a component off by more than 1e-5
} error_result;

typedef struct run_result {
    char program[NAME_SIZE], machine[NAME_SIZE], machine_hash[33], trace_hash[33];
    uint32_t width, height, samples;
    uint64_t geometry_passes, passes_by_class[CLASS_COUNT], fullscreen_passes;
    uint64_t iterations;               // executions of the repeat bodies, the last empty one included
    bool iteration_limit_reached;
    uint64_t fragments_in_trace, fragments_replayed, fragments_composited;
    bool has_list, list_composites;    // the schedule has a `list` step; its blend state composites
    uint64_t list_kept, list_lost;     // fragments that lists kept, and lost since they were full
    uint64_t list_entry_bytes;         // memory of one: its depth and colour in the planes' formats
    uint64_t deepest_sample;           // most transparent fragments at one sample
    plane_result planes[PLANE_MAX];
    int plane_count;
    error_result error;                // if options.reference
    bool error_known;
    double wall_seconds, fragments_per_second;   // of the replay itself
    uint64_t batches_foregone;         // batches of a tile that were counted and not executed
    float *image;                      // width * height * 3, samples averaged, over the background
    float *sample_rgb;                 // width * height * samples * 3, before averaging
    uint32_t *plane_values[PLANE_MAX]; // if options.keep_planes: a word a sample, in sample_rgb's order; of a colour
                                       // plane four, float bits
    condition_result *conditions;      // if options.log_conditions: in the order of evaluation
    uint64_t condition_count;
    draw_batches batches[BATCHES_MAX]; // if options.log_conditions: of each `batches` step, in the schedule's order
    struct write_log *writes;          // the same, if a deeper level had read the trace: for that alone; else NULL
} run_result;

status replay_run(const program *program, const machine *machine, trace *trace, const run_options *options,
                  const report *report, run_result **result);
void result_destroy(run_result *result);

// The replay of ideal_coherent_layer_peel against hand-written C over the same bins, in turns, on one thread.
typedef struct bench_result {
    double replay_seconds, native_seconds;  // least of all turns
    double read_seconds;                    // to read the bins once and do nothing else
    uint64_t replay_visits;                 // fragments times geometry passes, as counted
    uint64_t native_visits;                 // those that the native loop really makes
    uint64_t bin_bytes;                     // of the bins: 20 a fragment
    uint64_t checksum;                      // of what was read; means nothing
} bench_result;

// `ideal`: the program; `machine`: must have 32-bit float depth and colour. STATUS_REFUSED if images differ.
status bench_run(const program *ideal, const machine *machine, trace *trace, const run_options *options, int turns,
                 const report *report, bench_result *result);

// ---- Pixel history (sim/history) -----------------------------------------------------------------------

// What each step of the schedule did to one sample, fragment by fragment in raster order. Each call replays the trace
// for the conditions of loops, which ask about all samples; then it runs the one sample on its own and compares: planes or
// colours that differ from the replay's are an internal error, STATUS_REFUSED.
typedef struct history_options {
    run_options run;          // threads, max_iterations and occlusion_ratio count
    uint64_t pass;            // show this pass only; 0: all. Geometry and full-screen passes are numbered together from 1
                              // in the order in which they run; opaque draws have no number, as in run_result
    uint64_t iteration;       // show this iteration of the outermost repeats only, from 1; 0: all
    const char *trace_name;   // for the heading, NULL: none
} history_options;

// As text of at most 100 columns where names allow it. `sample` below trace_info.samples.
status history_print(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y, uint32_t sample,
                     const history_options *options, const report *report, FILE *out);
// As one JSON object; docs/history.md lists its keys.
status history_print_json(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                          uint32_t sample, const history_options *options, const report *report, FILE *out);
// A plane's value at the sample right after pass `options->pass` (of iteration `options->iteration`, if that is not 0: then
// passes are numbered within the iteration); pass 0: at the end. One word, of a colour plane four float bits.
// STATUS_REFUSED if there is no such plane or no such pass.
status history_plane_value(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                           uint32_t sample, const char *plane, const history_options *options, const report *report,
                           uint32_t value[4]);

// ---- Visibility ordering (sim/order) -------------------------------------------------------------------

typedef struct order_options {
    int threads;            // 0: one a processor
    uint32_t block_pixels;  // side of the blocks in which planes are read back and scanned; 0: the whole image
    uint64_t memory_bytes;  // budget of fragments and samples held in memory; 0: 4 GiB. What needs more is refused
    bool printed;           // the paper's own rule of what goes back, which can put a hidden primitive too early
} order_options;

typedef enum order_place {
    PLACE_LAYER,    // in order
    PLACE_CYCLE,    // lies, by way of others or of itself, in front of itself
    PLACE_BEHIND,   // lies behind such a one, so that no layer can take it
    PLACE_NOWHERE,  // covers no sample: edge-on, outside the view, or too small
    PLACE_COUNT
} order_place;

typedef struct order_primitive {
    uint32_t draw, primitive;  // together its identity: the numbers of two draws may be the same
    order_place place;
    uint32_t layer;            // PLACE_LAYER: from 0, the nearest
} order_primitive;

typedef struct order_counts { uint64_t bytes_read, samples_scanned; } order_counts;

typedef struct order_result {
    char machine[NAME_SIZE], machine_hash[33], trace_hash[33];
    uint32_t width, height, samples, block_pixels;
    bool printed;
    order_primitive *primitives;  // those in order first, by layer, draw, number; then the others, by place, draw, number
    uint64_t primitive_count, place_counts[PLACE_COUNT];
    uint64_t nowhere_unnamed;     // cover no sample and cannot be named, as the trace's numbering does not tell
    bool several_draws;           // a number occurs in more than one draw
    uint32_t layer_count;
    uint64_t item_passes, complexity_passes, complexity_passes_most;  // the most that a layer took
    uint64_t fragments, fragments_replayed;
    order_counts whole, blocks;   // had whole planes been read back each time; what was read
    uint64_t pairs, pairs_wrong;  // neighbours in depth at a sample, both in order; whose layers contradict the trace's depths
    double wall_seconds;
} order_result;

// Layers of the transparent and sorted draws' primitives, front to back. A fragment is in front of another of its sample if
// its depth, as the machine stores it, is less, or equal and it arrived first. docs/order.md.
// `trace` stands anywhere and is left rewound. Needs 2 bits of stencil and kernels. Free with order_destroy.
status order_run(trace *trace, const machine *machine, const order_options *options, const report *report,
                 order_result **result);
void order_destroy(order_result *result);  // NULL is fine
// A line for each primitive in order, front to back: its number, its layer, and its draw if several_draws.
status order_write(const order_result *result, const char *path, const report *report);
status order_write_json(const order_result *result, const char *trace_path, const char *path, const report *report);
status order_print(const order_result *result, FILE *out);

// ---- Trace tests (sim/tracetest) -----------------------------------------------------------------------

// Text files that hold a trace, programs, a machine and what must come out: docs/testing.md.
typedef struct trace_test_options {
    int threads;               // test files at once; 0: one a processor
    bool bless;                // replace expected figures that were not met by those seen, in the files
} trace_test_options;

typedef struct trace_test_totals {
    uint64_t files, passed, failed;  // passed, failed: runs, a program on a trace each; a file that is no test failed
    uint64_t expectations, blessed;  // expect lines of all runs; figures replaced
    double seconds;
} trace_test_totals;

typedef struct trace_tests trace_tests;
// Runs the tests of files and of folders (all *.rtest below). Tests that fail are in the outcome, not in the status.
status trace_tests_run(const char *const *paths, int path_count, const trace_test_options *options, const report *report,
                       trace_tests **tests);
void trace_tests_destroy(trace_tests *tests);
const trace_test_totals *trace_tests_totals(const trace_tests *tests);
status trace_tests_print(const trace_tests *tests, FILE *out);      // a line a file, failures in full, `N passed, M failed`
status trace_tests_print_tap(const trace_tests *tests, FILE *out);  // Test Anything Protocol 13
status trace_tests_write_junit(const trace_tests *tests, const char *path, const report *report);
status trace_tests_print_expectations(FILE *out);                   // what a test can expect, from the table

// ---- Results (sim/report) ------------------------------------------------------------------------------

// The object of `ropsim run --json`; `trace_path` as the user gave it. Written aside and renamed.
status result_write_json(const run_result *result, const machine *machine, const char *trace_path, const char *path,
                         const report *report);
status result_print(const run_result *result, FILE *out);

// Passes against bits a sample: programs and traces, and what each program took of each trace.
typedef struct curve_program {
    char name[256];              // as program_load takes it
    uint32_t bits;               // a sample, of all planes
    bool runs;                   // the machine takes it; if not, it has no points
    bool exact;                  // on all traces
    double error;                // the largest on any
} curve_program;

typedef struct curve_trace {
    char label[NAME_SIZE];
    uint32_t width, height, samples;
    uint64_t fragments, deepest;   // most transparent fragments at one sample
} curve_trace;

typedef struct trade_curve {
    curve_program *programs;     // in order of bits
    int program_count;
    curve_trace *traces;
    int trace_count;
    uint64_t *passes;            // geometry passes: passes[program * trace_count + trace]
} trade_curve;

// Whether no exact program of at most as many bits takes fewer passes, nor one of fewer bits as many.
bool curve_is_best(const trade_curve *curve, int program, int trace);
status curve_print(const trade_curve *curve, FILE *out);                                     // a Markdown table
status curve_write_csv(const trade_curve *curve, const char *path, const report *report);    // a line a point
status curve_write_svg(const trade_curve *curve, const char *path, const report *report);    // a plot

#endif
