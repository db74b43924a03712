// The replay's parts, in the order in which data flows:
//
//   trace --bins_build--> bins --tile_run--> planes of each tile, counts --result_resolve--> image, error
//                                    |                     bins --reference_tile--> exact colours
//                       global_* settles loop conditions between tiles
//
// Tiles are independent but for the conditions of `while` and `if`, which ask about all samples. See tile.c.
#ifndef ROPSIM_REPLAY_H
#define ROPSIM_REPLAY_H

#include "../sim.h"

#include <stdatomic.h>

// ---- Bins (bins.c) -------------------------------------------------------------------------------------

// How samples lie in tiles of 64 lanes: lane = (y * width + x) * samples + sample inside the tile.
typedef struct tiling {
    uint32_t image_width, image_height, samples;
    uint32_t tile_width, tile_height;    // pixels, powers of two
    uint32_t shift_x, shift_y;           // their logarithms
    uint32_t columns, rows, tile_count;
    uint64_t quad_corners;               // lanes: the first sample of each quad's top left pixel
} tiling;

void tiling_init(tiling *tiling, const trace_info *info);
// The place of a sample in an array of 64 lanes a tile.
static inline uint64_t tiling_place(const tiling *t, uint32_t x, uint32_t y, uint32_t sample)
{
    const uint64_t tile = (uint64_t)(y >> t->shift_y) * t->columns + (x >> t->shift_x);
    const uint32_t local_x = x & (t->tile_width - 1), local_y = y & (t->tile_height - 1);
    return tile * TILE_LANES + ((local_y << t->shift_x) + local_x) * t->samples + sample;
}
uint64_t tiling_valid_lanes(const tiling *tiling, uint32_t tile);  // lanes inside the image
// The sample that a lane holds, counted by rows, pixels, samples of a pixel.
uint64_t tiling_sample(const tiling *tiling, uint32_t tile, uint32_t lane);
// A row of a tile as far as it is inside the image: lanes that follow each other and hold samples that do.
typedef struct tiling_run { uint32_t lane, count; uint64_t sample; } tiling_run;
tiling_run tiling_row(const tiling *tiling, uint32_t tile, uint32_t row);

enum { COLUMNS_MAX = FORMAT_COUNT + 5 };  // of fragments: codes, rgba, primitive

// Codes of depth, or other words of a plane; least > most: not known.
typedef struct depth_range { uint32_t least, most; } depth_range;
// Least and greatest of so many codes of depth, and of those of the lanes of a batch (stamp_masks.c).
depth_range depth_range_of(const uint32_t *codes, uint32_t count);
depth_range depth_range_of_lanes(const uint32_t *codes, uint64_t lanes);

// Batch r of a tile holds the r-th fragment of each sample, so that no sample occurs twice and each sample's
// fragments keep their order. Its fragments lie together, in order of lanes, from `offset` on.
typedef struct bin_batch {
    uint64_t lanes, sorted;  // all; those from draws of class sorted
    uint64_t offset;
    depth_range depths;      // of all, in plan.depth_format, once they were asked for (foregone.c)
    uint32_t number;         // if shared: in the block's order of arrival
} bin_batch;

typedef struct bin {
    uint64_t first_batch;    // in bins.batches
    uint32_t opaque_count, transparent_count;  // batches; the opaque ones come first
} bin;

typedef struct bins {
    uint32_t *draw;                    // if asked for
    uint32_t first_tile, tile_count;   // the band
    bin *bins;                         // one a tile of the band
    bin_batch *batches;
    uint32_t *codes[FORMAT_COUNT];     // depth as codes, of the formats asked for
    float *rgba[4];
    uint32_t *primitive;               // if asked for
    double *depth;                     // if asked for
    bool shared;                       // columns are of others (bins_share.c) and have 64 places a batch: a lane's is offset + lane
} bins;

typedef struct bin_request {
    uint32_t depth_formats;  // bit f: codes of format f
    bool primitive, depth, draw;
    uint64_t memory_bytes;
} bin_request;

typedef struct draw_range { double nearest, farthest; } draw_range;  // of its fragments; nearest > farthest: none

// How many fragments each sample has, of opaque and of other draws; one pass over the trace.
typedef struct sample_counts {
    uint32_t *opaque, *transparent;  // tile by tile, 64 lanes each
    uint64_t class_fragments[CLASS_COUNT];
    uint32_t deepest;                // most fragments of other draws at one sample
    draw_range *ranges;              // of each draw, if asked for
} sample_counts;

status bins_count(trace *trace, const tiling *tiling, bool ranges, const report *report, sample_counts *counts);
// All 0, without ranges; false: out of memory. Then, once all are counted, `deepest`. Free also after a failure.
bool sample_counts_make(const tiling *tiling, sample_counts *counts);
void sample_counts_deepest(const tiling *tiling, sample_counts *counts);
void sample_counts_free(sample_counts *counts);
// One past the last tile of the band that starts at `first` and fits the budget (at least one tile).
uint32_t bins_band_end(const tiling *tiling, const sample_counts *counts, const bin_request *request, uint32_t first);
status bins_build(trace *trace, const tiling *tiling, const sample_counts *counts, const bin_request *request,
                  uint32_t first, uint32_t end, const report *report, bins *bins);
void bins_free(bins *bins);

// ---- Conditions of loops (global.c) --------------------------------------------------------------------

// The k-th evaluation of a condition in schedule order, over all tiles. Known true as soon as the tiles seen
// so far count above the threshold; known false once all tiles have added theirs and it is not.
typedef enum outcome { OUTCOME_UNKNOWN, OUTCOME_TRUE, OUTCOME_FALSE } outcome;

typedef struct global global;
global *global_create(void);
void global_destroy(global *global);
// Adds a tile's count to evaluation k, once a tile. False: out of memory.
bool global_add(global *global, uint64_t k, uint64_t count);
outcome global_ask(global *global, uint64_t k, uint64_t threshold);
// Every tile has added to evaluation k: what is not true there is false.
void global_close(global *global, uint64_t k);
uint64_t global_count(global *global, uint64_t k);  // of all tiles, once they are done

// ---- Batches of draws (batches.c) ----------------------------------------------------------------------

// Puts the draws of a trace into batches; see sim.h.
status batches_make(const trace_info *info, const draw_range *ranges, uint32_t draws_each, format depth_format,
                    const report *report, draw_batches *batches);
void batches_free(draw_batches *batches);

// ---- The schedule on one tile (tile.c) -----------------------------------------------------------------

enum { REPEAT_MAX = 16, EVALUATION_MAX = 64 };

// What all tiles share and no tile changes.
typedef struct plan {
    const program *program;
    const bound_program *bound;
    execute_kernel *execute;
    uint64_t max_iterations, threshold_while;  // a `while` goes on above the threshold
    uint64_t stop_after_pass;                  // 0: never
    uint32_t plane_offset[PLANE_MAX];          // words into a tile's storage
    uint32_t tile_words;
    uint32_t count_offset[KERNEL_MAX + 1];     // of a kernel's instructions in a counts array
    uint32_t list_kept_at, list_lost_at;       // in a counts array: fragments that lists kept and lost
    uint32_t count_total;
    uint8_t repeat_index[STEP_MAX];            // of STEP_REPEAT and its STEP_WHILE
    uint8_t batches_index[STEP_MAX];           // of STEP_BATCHES and its STEP_END_BATCHES
    draw_batches batches[BATCHES_MAX];
    bool has_batches;
    format depth_format;                       // in which batches know their ranges of depth
    struct foregone *foregone;                 // of each kernel, when its outcome is foregone; NULL: each batch is executed
    struct write_log *writes;                  // NULL, or where batches that write are noted
} plan;

// Zeros for planes, at least one line of them; NULL: out of memory. Free with free() (storage.c).
uint32_t *storage_make(size_t words);

// Whether the schedule ends after this step, `*passes` of which lay before it; counts it.
bool plan_stops_after(const plan *plan, const step *step, uint64_t *passes);
uint32_t list_depth_formats(const program *program, const bound_program *bound);  // bit f: that `list` steps compare with, without an instruction that says so
status plan_make(plan *plan, const program *program, const bound_program *bound, const report *report);

// A tile between two runs: its place in the schedule and what its planes hold.
typedef struct tile {
    uint32_t *storage;                   // plan.tile_words
    uint8_t plane_at[PLANE_MAX];         // plane i's contents lie at plane_offset[plane_at[i]]
    uint64_t lanes;
    uint64_t weight;                     // samples that each lane stands for; 1 but for the tile of all empty ones
    uint64_t evaluation;                 // how many conditions were settled
    uint32_t iterations[REPEAT_MAX];
    uint64_t passes;                     // begun, if plan.stop_after_pass is set
    uint64_t draws;                      // ended
    uint64_t query[QUERY_MAX];           // counted since the last reset
    uint32_t batch;                      // inside `batches`: which, and
    uint8_t batches;                     // of which plan.batches
    uint16_t step;
    bool waiting, done;                  // waiting: at a condition that it has added its count to
} tile;

// One thread's tools.
typedef struct worker worker;
worker *worker_create(const plan *plan, global *global);
void worker_destroy(worker *worker);
const uint64_t *worker_counts(const worker *worker);  // executions of each instruction; plan.count_offset
uint64_t worker_foregone(const worker *worker);       // batches that were counted and not run
// Runs a tile until it is done or waits for a condition. bin NULL: a tile without fragments.
// False: out of memory.
bool tile_run(worker *worker, tile *tile, const bins *bins, const bin *bin);

// ---- Threads (parallel.c) ------------------------------------------------------------------------------

// Calls body(context, thread, i) for each i below count, from up to `threads` threads at once.
void parallel_for(int threads, uint32_t count, void (*body)(void *context, int thread, uint32_t i), void *context);
double seconds_now(void);    // of a clock that only goes forward
int parallel_default(void);  // processors that this process may use

// ---- After the replay ----------------------------------------------------------------------------------

// Walks the schedule once with the settled conditions and fills passes, iterations and bytes, and the log of conditions
// if that is wanted. False: no memory for the log.
bool totals_count(const plan *plan, global *global, const uint64_t *counts, const trace_info *info,
                  const sample_counts *samples, bool log_conditions, run_result *result);

// The exact result of one tile in double: rgb of each lane (reference.c).
bool reference_tile(const bins *bins, const bin *bin, uint64_t lanes, const float background[4], double rgb[TILE_LANES][3]);

// The output of one tile as float rgb of each lane (resolve.c).
void resolve_tile(const plan *plan, const tile *tile, float rgb[TILE_LANES][3]);
void resolve_store(const tiling *tiling, uint32_t tile, uint64_t lanes, float rgb[TILE_LANES][3], run_result *result);
void resolve_average(run_result *result);  // sample_rgb to image
// Fills result->plane_values (keep_planes.c); `empty` stands for the tiles without storage.
status keep_planes(const plan *plan, const tiling *tiling, const tile *tiles, const tile *empty, const report *report,
                   run_result *result);

// Differences of float results from exact ones (compare.c).
typedef struct error_sum { double max_abs, squares; uint64_t components, wrong; } error_sum;
error_sum error_of_tile(uint64_t lanes, float rgb[TILE_LANES][3], double exact[TILE_LANES][3]);
void error_add(error_sum *sum, error_sum other);
void error_finish(const error_sum *sum, error_result *error);

#endif
