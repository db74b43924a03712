// The parts of visibility ordering, in the order in which data flows:
//
//   trace --geometry_load--> fragments by dense id --subset_open--> a trace of some primitives --pass_run--> planes
//     --layers_extract: scan by blocks--> layer of each id --cycles_find, nowhere_find--> the rest by name
//     --chains_make, chains_check--> whether the trace agrees
//
// An *id* numbers the primitives that have a fragment, 0, 1, 2, ... as they first appear; geometry.names tells who it
// is. Where a sample has no fragment the programs leave 2^32 - 1, which is no id.
#ifndef ROPSIM_ORDER_H
#define ROPSIM_ORDER_H

#include "../sim.h"

// ---- Fragments in memory (geometry.c, identity.c) ------------------------------------------------------

typedef struct identity {
    uint32_t draw, primitive;
} identity;

// The transparent and sorted fragments in raster order, one array a column.
typedef struct geometry {
    const trace_info *info;
    uint64_t count;
    uint16_t *x, *y;
    uint8_t *sample;
    double *depth;
    uint32_t *id;
    identity *names;  // of each id
    uint32_t id_count;
} geometry;

status geometry_load(trace *trace, uint64_t memory_bytes, const report *report, geometry *geometry);
void geometry_free(geometry *geometry);
static inline uint64_t geometry_sample(const geometry *g, uint64_t i)
{
    return ((uint64_t)g->y[i] * g->info->width + g->x[i]) * g->info->samples + g->sample[i];
}
static inline uint64_t geometry_sample_count(const geometry *g)
{
    return (uint64_t)g->info->width * g->info->height * g->info->samples;
}

// Hands out the next number to each identity that it has not met.
typedef struct identity_map identity_map;
identity_map *identity_map_create(void);
void identity_map_destroy(identity_map *map);
bool identity_map_id(identity_map *map, identity identity, uint32_t *id);  // false: no memory
identity *identity_map_take(identity_map *map, uint32_t *count);           // all of them by id; free with free()

// ---- Passes over subsets (subset.c, passes.c) ----------------------------------------------------------

// A trace of the fragments of those ids whose byte in *set is not 0, asked anew at each rewind. Its primitives are ids.
typedef struct subset subset;
status subset_open(const geometry *geometry, const uint8_t *const *set, const report *report, subset **subset);
void subset_close(subset *subset);  // NULL is fine
trace *subset_trace(subset *subset);

typedef enum pass { PASS_ITEM, PASS_COMPLEXITY, PASS_COUNT } pass;

typedef struct passes {
    const machine *machine;
    run_options options;
    program *programs[PASS_COUNT];
    int item_plane[PASS_COUNT], count_plane;
} passes;

// What a pass leaves in memory: a word a sample, by rows, pixels, samples of a pixel. `count` of PASS_COMPLEXITY only.
typedef struct readback {
    run_result *result;
    const uint32_t *item, *count;
} readback;

status passes_load(const machine *machine, int threads, const report *report, passes *passes);
void passes_free(passes *passes);
status pass_run(const passes *passes, pass pass, trace *trace, const report *report, readback *readback);
uint64_t pass_sample_bytes(pass pass);  // that a sample's readback has

// ---- Blocks of the image (blocks.c) --------------------------------------------------------------------

typedef struct blocks {
    uint32_t width, height, samples;
    uint32_t side, columns, count;
    bool *active;  // the last item buffer showed a primitive there
} blocks;

bool blocks_create(const trace_info *info, uint32_t side, blocks *blocks);  // false: no memory
void blocks_free(blocks *blocks);
// Rows [y0, y1) of samples [x0, x1), both counted in the image: x in samples, not in pixels.
typedef struct block_area {
    uint32_t x0, x1, y0, y1;
} block_area;
block_area blocks_area(const blocks *blocks, uint32_t block);
uint64_t blocks_active_samples(const blocks *blocks);

// ---- Layers (layers.c) ---------------------------------------------------------------------------------

#define LAYER_NONE UINT32_MAX
// Fills layers[id], LAYER_NONE for what no layer takes, and the counts of passes and scans in `result`.
status layers_extract(const geometry *geometry, const passes *passes, const order_options *options,
                      const report *report, uint32_t *layers, order_result *result);

// ---- What lies in front of what (chains.c, cycles.c, nowhere.c) -----------------------------------------

// Each sample's ids from front to back: ids[start[s]] to ids[start[s + 1] - 1]. Equal depths in order of arrival.
typedef struct chains {
    uint64_t *start;
    uint32_t *ids;
} chains;
// `format`: depths compared as its codes, or as the trace has them if it is FORMAT_COUNT.
status chains_make(const geometry *geometry, format format, const report *report, chains *chains);
void chains_free(chains *chains);
// Counts neighbours whose second has a layer, and those of them where the first has none before it.
void chains_check(const geometry *geometry, const chains *chains, const uint32_t *layers, order_result *result);

// Sets places[id] to PLACE_CYCLE or PLACE_BEHIND for each id without a layer, else to PLACE_LAYER.
status cycles_find(const geometry *geometry, const chains *chains, const uint32_t *layers, const report *report,
                   order_place *places);

// Primitives that the trace's draws must have and that have no fragment, if its numbering tells; free *names.
status nowhere_find(const geometry *geometry, uint64_t memory_bytes, const report *report, identity **names,
                    uint64_t *count, uint64_t *unnamed);

#endif
