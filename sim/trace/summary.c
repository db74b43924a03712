// One pass a band of rows: each sample of the band keeps how many fragments it saw, its last depth and its runs.
#include "../sim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct sample_state {
    uint32_t count, runs;
    double last;
} sample_state;

enum { BAND_SAMPLES = 1 << 25 };  // of 16 bytes: 512 MiB

static void note_depth(trace_summary *summary, const fragments *run, uint32_t i)
{
    double depth = run->depth[i];
    bool finite = isfinite(depth);
    for (int c = 0; c < 4; c++)
        finite = finite && isfinite(run->rgba[c][i]);
    summary->nonfinite += !finite;
    if (!isfinite(depth))
        return;
    summary->depth_outside += depth < 0 || depth > 1;
    summary->depth_min = depth < summary->depth_min ? depth : summary->depth_min;
    summary->depth_max = depth > summary->depth_max ? depth : summary->depth_max;
}

static void note_sample(trace_summary *summary, sample_state *sample, double depth)
{
    summary->fragments++;
    bool in_order = sample->count > 0 && depth >= sample->last;
    if (sample->count > 0) {
        summary->pairs++;
        summary->pairs_in_order += in_order;
        summary->pairs_tied += depth == sample->last;
    }
    sample->runs += !in_order;
    sample->count++;
    sample->last = depth;
}

static void close_band(trace_summary *summary, const sample_state *samples, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t deep = samples[i].count;
        summary->histogram[deep < SUMMARY_BINS - 1 ? deep : SUMMARY_BINS - 1]++;
        summary->covered_samples += deep > 0;
        summary->deepest = deep > summary->deepest ? deep : summary->deepest;
        summary->runs += samples[i].runs;
        summary->runs_most = samples[i].runs > summary->runs_most ? samples[i].runs : summary->runs_most;
    }
}

// Rows [y0, y1) of the trace, whose states are `samples`.
static status summarize_band(trace *trace, const report *report, uint32_t y0, uint32_t y1, sample_state *samples,
                             trace_summary *summary)
{
    const trace_info *info = trace_get_info(trace);
    trace_select(trace, 0, y0, info->width, y1);
    status result = trace_rewind(trace);
    uint64_t done = 0;
    while (result == STATUS_OK) {
        fragments run;
        result = trace_next(trace, &run);
        if (result != STATUS_OK || run.count == 0)
            break;
        bool blended = info->draws[run.draw].class != CLASS_OPAQUE;
        for (uint32_t i = 0; i < run.count; i++) {
            if (run.y[i] < y0 || run.y[i] >= y1)
                continue;
            note_depth(summary, &run, i);
            if (blended)
                note_sample(
                    summary,
                    &samples[((size_t)(run.y[i] - y0) * info->width + run.x[i]) * info->samples + run.sample[i]],
                    run.depth[i]);
        }
        done += run.count;
        report_progress(report, "reading", done, info->fragment_count);
    }
    return result;
}

status trace_summarize(trace *trace, const report *report, trace_summary *summary)
{
    const trace_info *info = trace_get_info(trace);
    size_t row = (size_t)info->width * info->samples;  // at most 2^19
    size_t rows = BAND_SAMPLES / row < info->height ? BAND_SAMPLES / row : info->height;
    *summary = (trace_summary){.depth_min = INFINITY, .depth_max = -INFINITY, .samples = (uint64_t)row * info->height};
    sample_state *samples = malloc(rows * row * sizeof *samples);
    if (!samples)
        return report_error(report, STATUS_IO, "no memory for %zu samples", rows * row);
    status result = STATUS_OK;
    for (uint32_t y0 = 0; result == STATUS_OK && y0 < info->height; y0 += (uint32_t)rows) {
        uint32_t y1 = info->height - y0 < rows ? info->height : y0 + (uint32_t)rows;
        memset(samples, 0, (y1 - y0) * row * sizeof *samples);
        result = summarize_band(trace, report, y0, y1, samples, summary);
        close_band(summary, samples, (y1 - y0) * row);
    }
    free(samples);
    if (summary->depth_min > summary->depth_max)
        summary->depth_min = summary->depth_max = 0;
    trace_select(trace, 0, 0, info->width, info->height);
    return result == STATUS_OK ? trace_rewind(trace) : result;
}
