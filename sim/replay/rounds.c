// Tiles in rounds, until every tile has run the whole schedule.
//
// Bands of tiles are binned and run, deepest tiles first, since what they add to the loops' conditions lets
// the others go on without waiting. When every tile waits or is done, the earliest condition waited for is
// known to fail, and the next round goes on behind it. Three or four rounds are the rule.
#include "run.h"

#include <stdlib.h>
#include <string.h>

static uint32_t tile_depth(const replay *r, uint32_t t)
{
    uint32_t depth = 0;
    for (size_t i = (size_t)t * TILE_LANES, end = i + TILE_LANES; i < end; i++) {
        const uint32_t count = r->counts.transparent[i] + r->counts.opaque[i];
        depth = count > depth ? count : depth;
    }
    return depth;
}

static void tile_init(const replay *r, tile *tile, uint32_t *storage, uint64_t lanes, uint64_t weight)
{
    memset(tile, 0, sizeof *tile);
    tile->storage = storage;
    tile->lanes = lanes;
    tile->weight = weight;
    for (int i = 0; i < r->plan.program->plane_count; i++)
        tile->plane_at[i] = (uint8_t)i;
}

// Storage for the tiles that have a fragment; the others share one sample.
static status make_tiles(replay *r)
{
    const uint32_t count = r->tiling.tile_count;
    r->tiles = calloc(count, sizeof *r->tiles);
    r->order = malloc(count * sizeof *r->order);
    r->errors = calloc(count, sizeof *r->errors);
    if (!r->tiles || !r->order || !r->errors)
        return report_error(r->report, STATUS_IO, "out of memory: %u tiles", count);
    uint64_t used = 0, empty_samples = 0;
    for (uint32_t t = 0; t < count; t++) {
        const uint64_t lanes = tiling_valid_lanes(&r->tiling, t);
        tile_init(r, &r->tiles[t], NULL, lanes, 1);
        r->tiles[t].done = tile_depth(r, t) == 0;
        used += !r->tiles[t].done;
        empty_samples += r->tiles[t].done ? count_lanes(lanes) : 0;
    }
    r->storage = storage_make((size_t)used * r->plan.tile_words);
    r->empty_storage = storage_make(r->plan.tile_words);
    if (!r->storage || !r->empty_storage)
        return report_error(r->report, STATUS_IO, "out of memory: planes of %llu tiles", (unsigned long long)used);
    uint32_t *next = r->storage;
    for (uint32_t t = 0; t < count; t++) {
        if (r->tiles[t].done)
            continue;
        r->tiles[t].storage = next;
        next += r->plan.tile_words;
    }
    tile_init(r, &r->empty, r->empty_storage, 1, empty_samples);
    return STATUS_OK;
}

static status make_workers(replay *r)
{
    r->threads = r->options->threads > 0 ? r->options->threads : parallel_default();
    if ((uint32_t)r->threads > r->tiling.tile_count)
        r->threads = (int)r->tiling.tile_count;
    r->global = global_create();
    r->workers = calloc((size_t)r->threads, sizeof *r->workers);
    bool good = r->global && r->workers;
    for (int i = 0; good && i < r->threads; i++)
        good = (r->workers[i] = worker_create(&r->plan, r->global));
    good = good && (r->empty_worker = worker_create(&r->plan, r->global));
    return good ? STATUS_OK : report_error(r->report, STATUS_IO, "out of memory: %d threads", r->threads);
}

static void run_one(void *context, int thread, uint32_t i)
{
    replay *r = context;
    const uint32_t t = r->order[i];
    if (!tile_run(r->workers[thread], &r->tiles[t], &r->bins, &r->bins.bins[t - r->bins.first_tile]))
        atomic_store(&r->failed, true);
    if (thread == 0)
        report_progress(r->report, "replaying tiles", i + 1, r->order_count);
}

typedef struct depth_of_tile { uint32_t depth, tile; } depth_of_tile;

static int deepest_first(const void *a, const void *b)
{
    const depth_of_tile *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth < y->depth ? 1 : -1;
    return x->tile < y->tile ? -1 : 1;
}

// The tiles [first, end) that are not done, deepest first.
static status order_tiles(replay *r, uint32_t first, uint32_t end)
{
    depth_of_tile *depths = malloc((size_t)(end - first) * sizeof *depths);
    if (!depths)
        return report_error(r->report, STATUS_IO, "out of memory: %u tiles", end - first);
    r->order_count = 0;
    for (uint32_t t = first; t < end; t++)
        if (!r->tiles[t].done)
            depths[r->order_count++] = (depth_of_tile){tile_depth(r, t), t};
    qsort(depths, r->order_count, sizeof *depths, deepest_first);
    for (uint32_t i = 0; i < r->order_count; i++)
        r->order[i] = depths[i].tile;
    free(depths);
    return STATUS_OK;
}

status load_band(replay *r, uint32_t first, uint32_t end)
{
    if (r->whole && r->bins.bins)
        return STATUS_OK;
    bins_free(&r->bins);
    return bins_build(r->trace, &r->tiling, &r->counts, &r->request, first, end, r->report, &r->bins);
}

static status run_band(replay *r, uint32_t first, uint32_t end)
{
    status status = order_tiles(r, first, end);
    if (status != STATUS_OK || r->order_count == 0)
        return status;
    status = load_band(r, first, end);
    if (status != STATUS_OK)
        return status;
    const double start = seconds_now();
    parallel_for(r->threads, r->order_count, run_one, r);
    r->seconds += seconds_now() - start;
    return atomic_load(&r->failed) ? report_error(r->report, STATUS_IO, "out of memory: conditions of loops") : STATUS_OK;
}

status each_band(replay *r, band_body *body)
{
    status status = STATUS_OK;
    for (uint32_t first = 0, end; status == STATUS_OK && first < r->tiling.tile_count; first = end) {
        end = r->bins.shared ? r->tiling.tile_count : bins_band_end(&r->tiling, &r->counts, &r->request, first);
        r->whole = first == 0 && end == r->tiling.tile_count;
        status = body(r, first, end);
    }
    return status;
}

// The earliest condition that a tile waits for; UINT64_MAX if all are done.
static uint64_t earliest_wait(const replay *r)
{
    uint64_t earliest = r->empty.done ? UINT64_MAX : r->empty.evaluation;
    for (uint32_t t = 0; t < r->tiling.tile_count; t++)
        if (!r->tiles[t].done && r->tiles[t].evaluation < earliest)
            earliest = r->tiles[t].evaluation;
    return earliest;
}

status rounds_run(replay *r)
{
    for (;;) {
        if (!r->empty.done && !tile_run(r->empty_worker, &r->empty, NULL, NULL))
            return report_error(r->report, STATUS_IO, "out of memory: conditions of loops");
        const status status = each_band(r, run_band);
        if (status != STATUS_OK)
            return status;
        const uint64_t waiting = earliest_wait(r);
        if (waiting == UINT64_MAX)
            return STATUS_OK;
        global_close(r->global, waiting);
    }
}

status rounds_prepare(replay *r)
{
    const status status = make_tiles(r);
    return status == STATUS_OK ? make_workers(r) : status;
}
