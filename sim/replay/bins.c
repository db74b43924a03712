// A trace in, its fragments by tile and batch out.
//
// Two passes over the trace: the first counts each sample's fragments, from which every batch's lanes follow
// (batch r has the lanes with more than r fragments), and so each fragment's place; the second puts them there.
// Stored lanes are dense, so that memory follows the number of fragments, however uneven the tiles are.
#include "lane_runs.h"

#include <math.h>
#include <stdlib.h>

static void widen(draw_range *range, const fragments *run)
{
    for (uint32_t i = 0; i < run->count; i++) {
        range->nearest = run->depth[i] < range->nearest ? run->depth[i] : range->nearest;
        range->farthest = run->depth[i] > range->farthest ? run->depth[i] : range->farthest;
    }
}

static draw_range *make_ranges(uint32_t draw_count)
{
    draw_range *ranges = malloc((draw_count + 1) * sizeof *ranges);
    for (uint32_t i = 0; ranges && i < draw_count; i++)
        ranges[i] = (draw_range){INFINITY, -INFINITY};
    return ranges;
}

// Counts the fragments of a run. False: out of memory.
static bool count_run(const tiling *tiling, const fragments *run, lane_runs *lane_runs, uint32_t *array)
{
    if (!lane_runs_find(lane_runs, tiling, run, false))
        return false;
    for (uint32_t i = 0, length; i < run->count; i += length) {
        uint32_t *const samples = array + tiling_place(tiling, run->x[i], run->y[i], run->sample[i]);
        length = lane_runs_length(lane_runs, i);
        for (uint32_t lane = 0; lane < length; lane++)
            samples[lane]++;
    }
    return true;
}

static status count_runs(trace *trace, const tiling *tiling, const report *report, lane_runs *lane_runs, sample_counts *counts)
{
    const trace_info *info = trace_get_info(trace);
    status status = trace_rewind(trace);
    trace_places_only(trace, false);  // the next who rewinds gets whole fragments
    uint64_t done = 0;
    for (fragments run; status == STATUS_OK && (status = trace_next(trace, &run)) == STATUS_OK && run.count;) {
        const draw_class class = info->draws[run.draw].class;
        if (!count_run(tiling, &run, lane_runs, class == CLASS_OPAQUE ? counts->opaque : counts->transparent))
            return report_error(report, STATUS_IO, "out of memory: a run of %u fragments", run.count);
        if (counts->ranges)
            widen(&counts->ranges[run.draw], &run);
        counts->class_fragments[class] += run.count;
        report_progress(report, "counting fragments", done += run.count, info->fragment_count);
    }
    return status;
}

bool sample_counts_make(const tiling *tiling, sample_counts *counts)
{
    const size_t places = (size_t)tiling->tile_count * TILE_LANES;
    memset(counts, 0, sizeof *counts);
    counts->opaque = calloc(places, sizeof *counts->opaque);
    counts->transparent = calloc(places, sizeof *counts->transparent);
    return counts->opaque && counts->transparent;
}

void sample_counts_deepest(const tiling *tiling, sample_counts *counts)
{
    for (size_t place = 0; place < (size_t)tiling->tile_count * TILE_LANES; place++)
        counts->deepest = counts->transparent[place] > counts->deepest ? counts->transparent[place] : counts->deepest;
}

status bins_count(trace *trace, const tiling *tiling, bool ranges, const report *report, sample_counts *counts)
{
    const trace_info *info = trace_get_info(trace);
    bool good = sample_counts_make(tiling, counts);
    if (ranges)
        good = (counts->ranges = make_ranges(info->draw_count)) && good;
    if (!good) {
        sample_counts_free(counts);
        return report_error(report, STATUS_IO, "out of memory: %zu samples", (size_t)tiling->tile_count * TILE_LANES);
    }
    trace_select(trace, 0, 0, info->width, info->height);
    trace_places_only(trace, !ranges);
    lane_runs lane_runs = {0};
    const status status = count_runs(trace, tiling, report, &lane_runs, counts);
    lane_runs_free(&lane_runs);
    sample_counts_deepest(tiling, counts);
    if (status != STATUS_OK)
        sample_counts_free(counts);
    return status;
}

void sample_counts_free(sample_counts *counts)
{
    free(counts->opaque);
    free(counts->transparent);
    free(counts->ranges);
    counts->opaque = counts->transparent = NULL;
    counts->ranges = NULL;
}

static uint32_t most(const uint32_t lanes[TILE_LANES])
{
    uint32_t count = 0;
    for (int i = 0; i < TILE_LANES; i++)
        count = lanes[i] > count ? lanes[i] : count;
    return count;
}

static uint64_t sum(const uint32_t lanes[TILE_LANES])
{
    uint64_t count = 0;
    for (int i = 0; i < TILE_LANES; i++)
        count += lanes[i];
    return count;
}

static uint64_t fragment_bytes(const bin_request *request)
{
    return 4 * (uint64_t)__builtin_popcount(request->depth_formats) + 16 + (request->primitive ? 4 : 0) +
           (request->depth ? 8 : 0) + (request->draw ? 4 : 0);
}

uint32_t bins_band_end(const tiling *tiling, const sample_counts *counts, const bin_request *request, uint32_t first)
{
    uint64_t bytes = 0;
    uint32_t end = first;
    while (end < tiling->tile_count) {
        const uint32_t *opaque = counts->opaque + (size_t)end * TILE_LANES;
        const uint32_t *transparent = counts->transparent + (size_t)end * TILE_LANES;
        bytes += (sum(opaque) + sum(transparent)) * fragment_bytes(request) +
                 ((uint64_t)most(opaque) + most(transparent)) * sizeof(bin_batch) + sizeof(bin);
        if (bytes > request->memory_bytes && end > first)
            break;
        end++;
    }
    return end;
}

// Lays out the batches of one tile and class group; returns the offset behind the last.
static uint64_t lay_out(bin_batch *batches, uint32_t batch_count, const uint32_t lanes[TILE_LANES], uint64_t offset)
{
    for (uint32_t r = 0; r < batch_count; r++) {
        uint64_t mask = 0;
        for (int lane = 0; lane < TILE_LANES; lane++)
            mask |= (uint64_t)(lanes[lane] > r) << lane;
        batches[r] = (bin_batch){mask, 0, offset, {UINT32_MAX, 0}, 0};
        offset += count_lanes(mask);
    }
    return offset;
}

static status lay_out_bins(const sample_counts *counts, uint32_t first, uint32_t end, const report *report, bins *bins,
                           uint64_t *fragment_count)
{
    bins->first_tile = first;
    bins->tile_count = end - first;
    bins->bins = calloc(bins->tile_count, sizeof *bins->bins);
    uint64_t batch_count = 0;
    for (uint32_t t = 0; bins->bins && t < bins->tile_count; t++) {
        bin *bin = &bins->bins[t];
        bin->first_batch = batch_count;
        bin->opaque_count = most(counts->opaque + (size_t)(first + t) * TILE_LANES);
        bin->transparent_count = most(counts->transparent + (size_t)(first + t) * TILE_LANES);
        batch_count += bin->opaque_count + bin->transparent_count;
    }
    bins->batches = malloc(batch_count ? batch_count * sizeof *bins->batches : 1);
    if (!bins->bins || !bins->batches)
        return report_error(report, STATUS_IO, "out of memory: %llu batches", (unsigned long long)batch_count);
    uint64_t offset = 0;
    for (uint32_t t = 0; t < bins->tile_count; t++) {
        const bin *bin = &bins->bins[t];
        bin_batch *batches = bins->batches + bin->first_batch;
        offset = lay_out(batches, bin->opaque_count, counts->opaque + (size_t)(first + t) * TILE_LANES, offset);
        offset = lay_out(batches + bin->opaque_count, bin->transparent_count,
                         counts->transparent + (size_t)(first + t) * TILE_LANES, offset);
    }
    *fragment_count = offset;
    return STATUS_OK;
}

static status allocate_columns(const bin_request *request, uint64_t count, const report *report, bins *bins)
{
    // A batch is read with whole vectors, so the last one needs room behind it.
    const size_t length = (size_t)count + TILE_LANES;
    bool good = true;
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (request->depth_formats >> f & 1)
            good = (bins->codes[f] = malloc(length * sizeof(uint32_t))) && good;
    for (int c = 0; c < 4; c++)
        good = (bins->rgba[c] = malloc(length * sizeof(float))) && good;
    if (request->primitive)
        good = (bins->primitive = malloc(length * sizeof(uint32_t))) && good;
    if (request->draw)
        good = (bins->draw = malloc(length * sizeof(uint32_t))) && good;
    if (request->depth)
        good = (bins->depth = malloc(length * sizeof(double))) && good;
    return good ? STATUS_OK : report_error(report, STATUS_IO, "out of memory: bins of %llu fragments", (unsigned long long)count);
}

typedef struct filling {
    const tiling *tiling;
    bins *bins;
    uint32_t *opaque_rank, *transparent_rank;  // fragments of the sample so far
    bool reversed;
    uint32_t formats;                          // whose codes are wanted
    lane_runs lane_runs;
    word_columns columns;                      // of the run at hand
    draw_class class;
} filling;

static bool start_run(filling *filling, const fragments *run, draw_class class)
{
    const bins *bins = filling->bins;
    if (!lane_runs_find(&filling->lane_runs, filling->tiling, run, false) ||
        !lane_runs_code(&filling->lane_runs, run, filling->formats, filling->reversed))
        return false;
    filling->class = class;
    filling->columns.count = 0;
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (bins->codes[f])
            word_columns_add(&filling->columns, filling->lane_runs.codes[f], bins->codes[f]);
    for (int c = 0; c < 4; c++)
        word_columns_add(&filling->columns, run->rgba[c], bins->rgba[c]);
    if (bins->primitive)
        word_columns_add(&filling->columns, run->primitive, bins->primitive);
    return true;
}

// How many samples from the first on have as many fragments so far as the first: their next ones go to one batch.
static uint32_t count_equal(const uint32_t *ranks, uint32_t count)
{
    if (count >= 8 && memcmp(ranks, ranks + 1, (count - 1) * sizeof *ranks) == 0)
        return count;
    uint32_t equal = 1;
    while (equal < count && ranks[equal] == ranks[0])
        equal++;
    return equal;
}

// Puts the fragments of a run from `from` on into lanes of a batch.
static void put_into_batch(const filling *filling, const fragments *run, uint32_t from, uint32_t lane, uint32_t count, const bin_batch *batch)
{
    const bins *bins = filling->bins;
    const uint64_t to = batch->offset + count_lanes(batch->lanes & ((1ull << lane) - 1));
    word_columns_copy(&filling->columns, from, to, count);
    if (bins->draw)
        for (uint32_t i = 0; i < count; i++)
            bins->draw[to + i] = run->draw;
    if (bins->depth)
        memcpy(&bins->depth[to], &run->depth[from], count * sizeof *bins->depth);
}

// Puts a lane run there. False if the file has more fragments there than when they were counted.
static bool put(const filling *filling, const fragments *run, uint32_t from, uint32_t count)
{
    const bins *const bins = filling->bins;
    const uint64_t place = tiling_place(filling->tiling, run->x[from], run->y[from], run->sample[from]) - (uint64_t)bins->first_tile * TILE_LANES;
    if (place >= (uint64_t)bins->tile_count * TILE_LANES)  // of another band; also wraps below zero
        return true;
    const bin *const bin = &bins->bins[place / TILE_LANES];
    const bool opaque = filling->class == CLASS_OPAQUE;
    const uint32_t batch_count = opaque ? bin->opaque_count : bin->transparent_count;
    bin_batch *const batches = &bins->batches[bin->first_batch + (opaque ? 0 : bin->opaque_count)];
    uint32_t *const ranks = (opaque ? filling->opaque_rank : filling->transparent_rank) + place;
    for (uint32_t done = 0, equal; done < count; done += equal) {
        equal = count_equal(ranks + done, count - done);
        const uint32_t rank = ranks[done], lane = (uint32_t)(place % TILE_LANES) + done;
        const uint64_t lanes = UINT64_MAX >> (TILE_LANES - equal) << lane;
        bin_batch *const batch = &batches[rank];
        if (rank >= batch_count || (batch->lanes & lanes) != lanes)
            return false;
        if (filling->class == CLASS_SORTED)
            batch->sorted |= lanes;
        for (uint32_t i = 0; i < equal; i++)
            ranks[done + i] = rank + 1;
        put_into_batch(filling, run, from + done, lane, equal, batch);
    }
    return true;
}

static void select_band(trace *trace, const tiling *tiling, uint32_t first, uint32_t end)
{
    const uint32_t y0 = first / tiling->columns << tiling->shift_y;
    const uint32_t y1 = ((end - 1) / tiling->columns + 1) << tiling->shift_y;
    trace_select(trace, 0, y0, tiling->image_width, y1 < tiling->image_height ? y1 : tiling->image_height);
}

static status fill(trace *trace, filling *filling, uint32_t end, const report *report)
{
    const trace_info *info = trace_get_info(trace);
    select_band(trace, filling->tiling, filling->bins->first_tile, end);
    status status = trace_rewind(trace);
    uint64_t done = 0;
    for (fragments run; status == STATUS_OK && (status = trace_next(trace, &run)) == STATUS_OK && run.count;) {
        if (!start_run(filling, &run, info->draws[run.draw].class))
            return report_error(report, STATUS_IO, "out of memory: a run of %u fragments", run.count);
        for (uint32_t i = 0, length; i < run.count; i += length) {
            length = lane_runs_length(&filling->lane_runs, i);
            if (!put(filling, &run, i, length))
                return report_error(report, STATUS_IO, "the trace changed while it was read");
        }
        report_progress(report, "binning fragments", done += run.count, info->fragment_count);
    }
    return status;
}

status bins_build(trace *trace, const tiling *tiling, const sample_counts *counts, const bin_request *request,
                  uint32_t first, uint32_t end, const report *report, bins *bins)
{
    memset(bins, 0, sizeof *bins);
    uint64_t fragment_count = 0;
    status status = lay_out_bins(counts, first, end, report, bins, &fragment_count);
    if (status == STATUS_OK)
        status = allocate_columns(request, fragment_count, report, bins);
    const size_t places = (size_t)(end - first) * TILE_LANES;
    filling filling = {.tiling = tiling, .bins = bins, .opaque_rank = calloc(places, sizeof(uint32_t)), .transparent_rank = calloc(places, sizeof(uint32_t)),
                       .reversed = trace_get_info(trace)->reversed_depth, .formats = request->depth_formats};
    if (status == STATUS_OK && (!filling.opaque_rank || !filling.transparent_rank))
        status = report_error(report, STATUS_IO, "out of memory: %zu samples", places);
    if (status == STATUS_OK)
        status = fill(trace, &filling, end, report);
    free(filling.opaque_rank);
    free(filling.transparent_rank);
    lane_runs_free(&filling.lane_runs);
    if (status != STATUS_OK)
        bins_free(bins);
    return status;
}

void bins_free(bins *bins)
{
    free(bins->bins);
    free(bins->batches);
    if (bins->shared) {
        memset(bins, 0, sizeof *bins);
        return;
    }
    for (int f = 0; f < FORMAT_COUNT; f++)
        free(bins->codes[f]);
    for (int c = 0; c < 4; c++)
        free(bins->rgba[c]);
    free(bins->primitive);
    free(bins->draw);
    free(bins->depth);
    memset(bins, 0, sizeof *bins);
}
