// A run whose tiles are done in, its result out: counts, image, planes on request, distance from the exact result.
#include "run.h"

#include <stdlib.h>
#include <string.h>

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
    if (r->bins.shared)  // without exact depths
        bins_free(&r->bins);
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
    for (int w = 0; w < r->threads; w++)
        r->result->batches_foregone += worker_foregone(r->workers[w]);
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

status finish_run(replay *r, const machine *machine)
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
    result->writes = r->plan.writes;  // so is this
    r->plan.writes = NULL;
    result->wall_seconds = r->seconds;
    result->fragments_per_second = r->seconds > 0 ? (double)result->fragments_replayed / r->seconds : 0;
    if (result->iteration_limit_reached && !r->options->max_iterations && !r->plan.program->max_iterations)
        report_warning(r->report, "program '%s' had not ended after %llu iterations, more than %llu layers can need",
                       result->program, (unsigned long long)r->plan.max_iterations, (unsigned long long)r->counts.deepest);
    return status;
}
