// What a program costs against C written by hand: the ideal program's replay and native_ideal.c take turns
// over the same bins, on one thread; the least time of each counts, and only their ratio means anything on a
// machine that does other things as well. The images must be equal, bit for bit.
#include "expand.h"
#include "native_ideal.h"
#include "replay.h"

#include <stdlib.h>
#include <string.h>

typedef struct bench {
    trace *trace;
    const trace_info *info;
    const report *report;
    tiling tiling;
    sample_counts counts;
    bins bins;
    native_tile_run *native;
    native_batch *batches;
    uint32_t *lanes;       // spread columns of one tile's batches
    uint32_t deepest;      // batches of the deepest tile
    float *sample_rgb;
} bench;

static native_tile_run *select_native(int vector_bytes)
{
    execute_kernel *const chosen = execute_select(vector_bytes);
#if defined(__x86_64__)
    if (chosen == execute_select(64))
        return native_64;
    if (chosen == execute_select(32))
        return native_32;
#endif
    return chosen ? native_16 : NULL;
}

static status prepare(bench *b)
{
    tiling_init(&b->tiling, b->info);
    status status = bins_count(b->trace, &b->tiling, false, b->report, &b->counts);
    const bin_request request = {.depth_formats = 1u << FORMAT_z32f, .memory_bytes = UINT64_MAX};
    if (status == STATUS_OK)
        status = bins_build(b->trace, &b->tiling, &b->counts, &request, 0, b->tiling.tile_count, b->report, &b->bins);
    if (status != STATUS_OK)
        return status;
    for (uint32_t t = 0; t < b->tiling.tile_count; t++) {
        const uint32_t count = b->bins.bins[t].opaque_count + b->bins.bins[t].transparent_count;
        b->deepest = count > b->deepest ? count : b->deepest;
    }
    const size_t batches = (size_t)b->deepest + 1, samples = (size_t)b->info->width * b->info->height * b->info->samples;
    b->batches = malloc(batches * sizeof *b->batches);
    b->lanes = malloc(batches * 5 * TILE_LANES * sizeof *b->lanes);
    b->sample_rgb = malloc(samples * 3 * sizeof *b->sample_rgb);
    return b->batches && b->lanes && b->sample_rgb ? STATUS_OK : report_error(b->report, STATUS_IO, "out of memory");
}

static void spread_batch(const bench *b, const bin_batch *from, native_batch *to, uint32_t *lanes)
{
    to->lanes = from->lanes;
    to->depth = b->bins.codes[FORMAT_z32f] + from->offset;
    for (int c = 0; c < 4; c++)
        to->rgba[c] = b->bins.rgba[c] + from->offset;
    if (from->lanes == UINT64_MAX)
        return;
    memset(lanes, 0, 5 * TILE_LANES * sizeof *lanes);
    expand_lanes(lanes, to->depth, from->lanes);
    to->depth = lanes;
    for (int c = 0; c < 4; c++) {
        expand_lanes(lanes + (c + 1) * TILE_LANES, to->rgba[c], from->lanes);
        to->rgba[c] = (const float *)(const void *)(lanes + (c + 1) * TILE_LANES);
    }
}

// One run of the native loop over all tiles; returns its seconds and the fragment visits of its passes.
static double run_native(bench *b, uint64_t *visits)
{
    run_result view = {.width = b->info->width, .height = b->info->height, .samples = b->info->samples, .sample_rgb = b->sample_rgb};
    const double start = seconds_now();
    *visits = 0;
    for (uint32_t t = 0; t < b->tiling.tile_count; t++) {
        const bin *bin = &b->bins.bins[t];
        const uint32_t count = bin->opaque_count + bin->transparent_count;
        uint64_t fragments = 0;
        for (uint32_t r = 0; r < count; r++) {
            const bin_batch *from = &b->bins.batches[bin->first_batch + r];
            spread_batch(b, from, &b->batches[r], b->lanes + (size_t)r * 5 * TILE_LANES);
            fragments += r < bin->opaque_count ? 0 : (uint64_t)__builtin_popcountll(from->lanes);
        }
        float rgb[TILE_LANES][3];
        *visits += fragments * b->native(b->batches, bin->opaque_count, count, b->info->background, rgb);
        resolve_store(&b->tiling, t, tiling_valid_lanes(&b->tiling, t), rgb, &view);
    }
    return seconds_now() - start;
}

// Reads every column of the bins once: what the memory delivers to a loop that does nothing else.
static double read_columns(const bench *b, uint64_t *sum)
{
    const double start = seconds_now();
    const uint32_t tiles = b->tiling.tile_count;
    for (uint32_t t = 0; t < tiles; t++) {
        const bin *bin = &b->bins.bins[t];
        for (uint32_t r = 0; r < bin->opaque_count + bin->transparent_count; r++) {
            const bin_batch *from = &b->bins.batches[bin->first_batch + r];
            const int count = __builtin_popcountll(from->lanes);
            for (int i = 0; i < count; i++)
                *sum += b->bins.codes[FORMAT_z32f][from->offset + (uint64_t)i];
            for (int c = 0; c < 4; c++)
                for (int i = 0; i < count; i++)
                    *sum += ((const uint32_t *)(const void *)b->bins.rgba[c])[from->offset + (uint64_t)i];
        }
    }
    return seconds_now() - start;
}

static double least(double a, double b)
{
    return a == 0 || b < a ? b : a;
}

static status take_turns(bench *b, const program *program, const machine *machine, const run_options *options, int turns,
                         bench_result *result)
{
    const run_options alone = {.threads = 1, .vector_bytes = options->vector_bytes, .occlusion_ratio = -1, .memory_bytes = UINT64_MAX};
    const size_t samples = (size_t)b->info->width * b->info->height * b->info->samples;
    for (int turn = 0; turn < turns; turn++) {
        run_result *run;
        const status status = replay_run(program, machine, b->trace, &alone, b->report, &run);
        if (status != STATUS_OK)
            return status;
        result->replay_seconds = least(result->replay_seconds, run->wall_seconds);
        result->replay_visits = run->fragments_replayed;
        result->native_seconds = least(result->native_seconds, run_native(b, &result->native_visits));
        result->read_seconds = least(result->read_seconds, read_columns(b, &result->checksum));
        const bool equal = memcmp(run->sample_rgb, b->sample_rgb, samples * 3 * sizeof(float)) == 0;
        result_destroy(run);
        if (!equal)
            return report_error(b->report, STATUS_REFUSED, "the hand-written loop's image differs from the replay's");
        report_progress(b->report, "taking turns", (uint64_t)turn + 1, (uint64_t)turns);
    }
    result->bin_bytes = b->info->fragment_count * 20;
    return STATUS_OK;
}

status bench_run(const program *ideal, const machine *machine, trace *trace, const run_options *options, int turns,
                 const report *report, bench_result *result)
{
    memset(result, 0, sizeof *result);
    bench b = {.trace = trace, .info = trace_get_info(trace), .report = report};
    b.native = select_native(options->vector_bytes);
    status status = b.native ? prepare(&b) : report_error(report, STATUS_USAGE, "vectors of %d bytes: this processor or build has none", options->vector_bytes);
    if (status == STATUS_OK)
        status = take_turns(&b, ideal, machine, options, turns, result);
    sample_counts_free(&b.counts);
    bins_free(&b.bins);
    free(b.batches);
    free(b.lanes);
    free(b.sample_rgb);
    return status;
}
