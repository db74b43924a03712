// A program, a machine and a trace in, a run_result out.
//
// Bands of tiles are binned and run, deepest tiles first, since what they add to the loops' conditions lets
// the others go on without waiting. When every tile waits or is done, the earliest condition waited for is
// known to fail, and the next round goes on behind it. Three or four rounds are the rule.
#include "replay.h"

#include <stdlib.h>
#include <string.h>

static const uint64_t DEFAULT_MEMORY = 4ull << 30;

typedef struct replay {
    plan plan;
    trace *trace;
    const trace_info *info;
    const report *report;
    const run_options *options;
    tiling tiling;
    sample_counts counts;
    bin_request request;
    bins bins;              // of the band that is in memory
    bool whole;             // the one band is the whole image: it stays
    tile *tiles;
    uint32_t *storage;
    tile empty;             // stands for all samples of tiles without a fragment
    uint32_t *empty_storage;
    uint32_t *order;        // tiles of a band, deepest first
    global *global;
    worker **workers;
    worker *empty_worker;
    int threads;
    uint32_t order_count;
    atomic_bool failed;
    error_sum *errors;      // one a tile
    run_result *result;
    double seconds;
} replay;

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

static uint32_t *allocate_storage(size_t words)
{
    uint32_t *storage = aligned_alloc(64, words ? words * sizeof *storage : 64);
    if (storage)
        memset(storage, 0, words * sizeof *storage);
    return storage;
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
        empty_samples += r->tiles[t].done ? (uint64_t)__builtin_popcountll(lanes) : 0;
    }
    r->storage = allocate_storage((size_t)used * r->plan.tile_words);
    r->empty_storage = allocate_storage(r->plan.tile_words);
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

static status load_band(replay *r, uint32_t first, uint32_t end)
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

// Calls body for each band of tiles that fits the memory budget.
static status each_band(replay *r, status (*body)(replay *, uint32_t first, uint32_t end))
{
    status status = STATUS_OK;
    for (uint32_t first = 0, end; status == STATUS_OK && first < r->tiling.tile_count; first = end) {
        end = bins_band_end(&r->tiling, &r->counts, &r->request, first);
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

static status run_rounds(replay *r)
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

// ---- Results -------------------------------------------------------------------------------------------

static void finish_one(void *context, int thread, uint32_t t)
{
    (void)thread;
    replay *r = context;
    const bin *bin = &r->bins.bins[t];
    t += r->bins.first_tile;
    float rgb[TILE_LANES][3];
    double exact[TILE_LANES][3];
    const tile *tile = &r->tiles[t];
    if (!tile->storage)
        return;
    resolve_tile(&r->plan, tile, rgb);
    if (!reference_tile(&r->bins, bin, tile->lanes, r->info->background, exact))
        atomic_store(&r->failed, true);
    else
        r->errors[t] = error_of_tile(tile->lanes, rgb, exact);
}

static status compare_band(replay *r, uint32_t first, uint32_t end)
{
    const status status = load_band(r, first, end);
    if (status == STATUS_OK)
        parallel_for(r->threads, end - first, finish_one, r);
    return atomic_load(&r->failed) ? report_error(r->report, STATUS_IO, "out of memory: exact result") : status;
}

static status compare(replay *r)
{
    const status status = each_band(r, compare_band);
    if (status != STATUS_OK)
        return status;
    error_sum sum = {0};
    for (uint32_t t = 0; t < r->tiling.tile_count; t++)
        error_add(&sum, r->errors[t]);
    if (r->empty.weight) {
        float rgb[TILE_LANES][3];
        double exact[TILE_LANES][3];
        resolve_tile(&r->plan, &r->empty, rgb);
        for (int c = 0; c < 3; c++)
            exact[0][c] = (double)r->info->background[c];
        error_sum one = error_of_tile(1, rgb, exact);
        one.squares *= (double)r->empty.weight;
        one.components *= r->empty.weight;
        one.wrong *= r->empty.weight;
        error_add(&sum, one);
    }
    error_finish(&sum, &r->result->error);
    r->result->error_known = true;
    return STATUS_OK;
}

static status make_image(replay *r)
{
    run_result *result = r->result;
    const size_t pixels = (size_t)result->width * result->height;
    result->image = malloc(pixels * 3 * sizeof *result->image);
    result->sample_rgb = malloc(pixels * result->samples * 3 * sizeof *result->sample_rgb);
    if (!result->image || !result->sample_rgb)
        return report_error(r->report, STATUS_IO, "out of memory: image of %u x %u", result->width, result->height);
    float rgb[TILE_LANES][3];
    for (uint32_t t = 0; t < r->tiling.tile_count; t++) {
        const bool empty = !r->tiles[t].storage;
        resolve_tile(&r->plan, empty ? &r->empty : &r->tiles[t], rgb);
        for (int lane = 1; empty && lane < TILE_LANES; lane++)
            memcpy(rgb[lane], rgb[0], sizeof rgb[0]);
        resolve_store(&r->tiling, t, r->tiles[t].lanes, rgb, result);
    }
    resolve_average(result);
    return STATUS_OK;
}

static status sum_counts(replay *r)
{
    const uint32_t total = r->plan.count_total;
    uint64_t *counts = calloc((size_t)total + 1, sizeof *counts);
    if (!counts)
        return report_error(r->report, STATUS_IO, "out of memory");
    for (uint32_t i = 0; i < total; i++) {
        for (int w = 0; w < r->threads; w++)
            counts[i] += worker_counts(r->workers[w])[i];
        counts[i] += worker_counts(r->empty_worker)[i] * r->empty.weight;
    }
    const bool counted =
        totals_count(&r->plan, r->global, counts, r->info, &r->counts, r->options->log_conditions, r->result);
    free(counts);
    return counted ? STATUS_OK : report_error(r->report, STATUS_IO, "out of memory: log of conditions");
}

static void describe(replay *r, const machine *machine)
{
    run_result *result = r->result;
    const program *program = r->plan.program;
    memcpy(result->program, program->name, NAME_SIZE);
    memcpy(result->machine, machine->name, NAME_SIZE);
    machine_hash(machine, result->machine_hash);
    memcpy(result->trace_hash, r->info->hash, sizeof result->trace_hash);
    result->width = r->info->width;
    result->height = r->info->height;
    result->samples = r->info->samples;
    result->fragments_in_trace = r->info->fragment_count;
    result->deepest_sample = r->counts.deepest;
    result->plane_count = program->plane_count;
    for (int i = 0; i < program->plane_count; i++) {
        memcpy(result->planes[i].name, program->planes[i].name, NAME_SIZE);
        result->planes[i].format = bound_plane_format(r->plan.bound, i);
    }
}

static status finish(replay *r, const machine *machine)
{
    describe(r, machine);
    status status = sum_counts(r);
    if (status == STATUS_OK)
        status = make_image(r);
    if (status == STATUS_OK && r->options->keep_planes)
        status = keep_planes(&r->plan, &r->tiling, r->tiles, &r->empty, r->report, r->result);
    if (status == STATUS_OK && r->options->reference)
        status = compare(r);
    run_result *result = r->result;
    for (int i = 0; i < BATCHES_MAX && r->options->log_conditions; i++) {
        result->batches[i] = r->plan.batches[i];  // handed over
        r->plan.batches[i] = (draw_batches){0};
    }
    result->wall_seconds = r->seconds;
    result->fragments_per_second = r->seconds > 0 ? (double)result->fragments_replayed / r->seconds : 0;
    if (result->iteration_limit_reached && !r->options->max_iterations && !r->plan.program->max_iterations)
        report_warning(r->report, "program '%s' had not ended after %llu iterations, more than %llu layers can need",
                       result->program, (unsigned long long)r->plan.max_iterations, (unsigned long long)r->counts.deepest);
    return status;
}

// ---- The run -------------------------------------------------------------------------------------------

// `list` steps compare the fragment's depth as well, without an instruction that says so.
static uint32_t list_depth_formats(const plan *plan)
{
    uint32_t formats = 0;
    for (int s = 0; s < plan->program->step_count; s++)
        if (plan->program->steps[s].kind == STEP_LIST)
            formats |= 1u << bound_plane_format(plan->bound, plan->program->steps[s].source);
    return formats;
}

static void set_limits(replay *r)
{
    const program *program = r->plan.program;
    const run_options *options = r->options;
    r->plan.max_iterations = options->max_iterations    ? options->max_iterations
                             : program->max_iterations ? program->max_iterations
                                                       : 2 * (uint64_t)r->counts.deepest + 16;
    const double ratio = options->occlusion_ratio >= 0 ? options->occlusion_ratio : program->occlusion_ratio;
    const double samples = (double)r->info->width * r->info->height * r->info->samples;
    r->plan.stop_after_pass = options->stop_after_pass;
    r->plan.threshold_while = (uint64_t)(ratio * samples);
    r->request = (bin_request){
        .depth_formats = bound_depth_formats(r->plan.bound) | list_depth_formats(&r->plan),
        .primitive = bound_reads(r->plan.bound, SOURCE_PRIMITIVE),
        .depth = options->reference,
        .draw = r->plan.has_batches,
        .memory_bytes = options->memory_bytes ? options->memory_bytes : DEFAULT_MEMORY,
    };
}

static status make_batches(replay *r, format depth_format)
{
    const program *program = r->plan.program;
    status status = STATUS_OK;
    for (int s = 0; status == STATUS_OK && s < program->step_count; s++)
        if (program->steps[s].kind == STEP_BATCHES)
            status = batches_make(r->info, r->counts.ranges, program->steps[s].entries, depth_format, r->report,
                                  &r->plan.batches[r->plan.batches_index[s]]);
    return status;
}

static status run_bound(replay *r, const program *program, const bound_program *bound, const machine *machine)
{
    status status = plan_make(&r->plan, program, bound, r->report);
    if (status == STATUS_OK && !(r->plan.execute = execute_select(r->options->vector_bytes)))
        status = report_error(r->report, STATUS_USAGE, "vectors of %d bytes: this processor or build has none", r->options->vector_bytes);
    if (status == STATUS_OK)
        status = bins_count(r->trace, &r->tiling, r->plan.has_batches, r->report, &r->counts);
    if (status == STATUS_OK)
        status = make_batches(r, machine->depth_format);
    if (status != STATUS_OK)
        return status;
    set_limits(r);
    status = make_tiles(r);
    if (status == STATUS_OK)
        status = make_workers(r);
    if (status == STATUS_OK)
        status = run_rounds(r);
    return status == STATUS_OK ? finish(r, machine) : status;
}

static void release(replay *r)
{
    for (int i = 0; r->workers && i < r->threads; i++)
        worker_destroy(r->workers[i]);
    free(r->workers);
    worker_destroy(r->empty_worker);
    global_destroy(r->global);
    for (int i = 0; i < BATCHES_MAX; i++)
        batches_free(&r->plan.batches[i]);
    sample_counts_free(&r->counts);
    bins_free(&r->bins);
    free(r->tiles);
    free(r->order);
    free(r->errors);
    free(r->storage);
    free(r->empty_storage);
}

status replay_run(const program *program, const machine *machine, trace *trace, const run_options *options,
                  const report *report, run_result **result)
{
    *result = NULL;
    rop_limits limits;
    machine_limits(machine, &limits);
    status status = verify_program(program, program->name, &limits, report);
    if (status != STATUS_OK)
        return status;
    const trace_info *info = trace_get_info(trace);
    bound_program *bound;
    status = bind_program(program, &limits, info->reversed_depth, info->background, report, &bound);
    if (status != STATUS_OK)
        return status;
    replay r = {.trace = trace, .info = info, .report = report, .options = options};
    tiling_init(&r.tiling, info);
    r.result = calloc(1, sizeof *r.result);
    status = r.result ? run_bound(&r, program, bound, machine) : report_error(report, STATUS_IO, "out of memory");
    release(&r);
    bound_destroy(bound);
    if (status == STATUS_OK)
        *result = r.result;
    else
        result_destroy(r.result);
    return status;
}

void result_destroy(run_result *result)
{
    if (!result)
        return;
    free(result->image);
    free(result->sample_rgb);
    free(result->conditions);
    for (int i = 0; i < BATCHES_MAX; i++)
        batches_free(&result->batches[i]);
    for (int i = 0; i < PLANE_MAX; i++)
        free(result->plane_values[i]);
    free(result);
}
