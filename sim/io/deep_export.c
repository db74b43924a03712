// A trace to a deep image: one list a pixel, in raster order, no draws. What does not fit is said.
//
// Colour is premultiplied, depth becomes a float, the primitive goes to channel `id`, the sample index, if there are
// several, to channel `sample`.
#include "deep.h"

#include <inttypes.h>
#include <stdlib.h>

static bool allocate(deep_image *image, uint64_t count, bool with_samples)
{
    size_t room = count ? (size_t)count : 1;
    bool there = (image->depth = malloc(room * sizeof *image->depth)) && (image->id = malloc(room * sizeof *image->id));
    for (int c = 0; c < 4; c++)
        there = (image->rgba[c] = malloc(room * sizeof **image->rgba)) && there;
    if (with_samples)
        there = (image->sample = malloc(room * sizeof *image->sample)) && there;
    image->count = count;
    return there;
}

// First pass: how many fragments each pixel has.
static status count_pixels(trace *trace, deep_image *image)
{
    fragments run = {0};
    status result;
    while ((result = trace_next(trace, &run)) == STATUS_OK && run.count > 0)
        for (uint32_t i = 0; i < run.count; i++)
            image->pixel_counts[(size_t)run.y[i] * image->width + run.x[i]]++;
    return result;
}

// Second pass: each fragment to its pixel's next place, so that a pixel keeps raster order.
static status place_fragments(trace *trace, deep_image *image, uint64_t *next)
{
    fragments run = {0};
    status result;
    uint64_t sum = 0;
    for (size_t p = 0; p < (size_t)image->width * image->height; p++) {
        next[p] = sum;
        sum += image->pixel_counts[p];
    }
    while ((result = trace_next(trace, &run)) == STATUS_OK && run.count > 0)
        for (uint32_t i = 0; i < run.count; i++) {
            uint64_t to = next[(size_t)run.y[i] * image->width + run.x[i]]++;
            image->depth[to] = (float)run.depth[i];
            for (int c = 0; c < 3; c++)
                image->rgba[c][to] = run.rgba[c][i] * run.rgba[3][i];
            image->rgba[3][to] = run.rgba[3][i];
            image->id[to] = run.primitive[i];
            if (image->sample)
                image->sample[to] = run.sample[i];
        }
    return result;
}

static void warn_losses(const trace_info *info, const char *path, const report *report)
{
    bool plain = info->draw_count <= 1 && (info->draw_count == 0 || info->draws[0].class == CLASS_TRANSPARENT);
    report_warning(report, "%s: a deep image keeps no background, and colour times alpha only%s%s%s", path,
                   info->depth_bits == 64 ? "; depth is rounded to 32 bits" : "",
                   plain ? "" : "; draws and their classes are lost",
                   info->samples > 1 ? "; the sample index is in channel `sample`, which other programs ignore" : "");
}

status deep_export(trace *trace, const char *path, const report *report)
{
    const trace_info *info = trace_get_info(trace);
    size_t pixels = (size_t)info->width * info->height;
    deep_image image = {.width = info->width, .height = info->height};
    if (info->fragment_count > DEEP_COUNT_MAX)
        return report_error(report, STATUS_REFUSED,
                            "%s: %" PRIu64 " fragments; a deep image is made in memory, of at most %d", path,
                            info->fragment_count, DEEP_COUNT_MAX);
    uint64_t *next = malloc(pixels * sizeof *next);
    image.pixel_counts = calloc(pixels, sizeof *image.pixel_counts);
    status result = STATUS_OK;
    if (!next || !image.pixel_counts || !allocate(&image, info->fragment_count, info->samples > 1))
        result = report_error(report, STATUS_IO, "%s: no memory", path);
    if (result == STATUS_OK)
        result = count_pixels(trace, &image);
    if (result == STATUS_OK)
        result = trace_rewind(trace);
    if (result == STATUS_OK)
        result = place_fragments(trace, &image, next);
    if (result == STATUS_OK)
        result = deep_write(path, &image, report);
    if (result == STATUS_OK)
        warn_losses(info, path, report);
    free(next);
    deep_destroy(&image);
    return result;
}
