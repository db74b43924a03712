// Traces to deep images and back. A deep image has one list a pixel and no draws: what does not fit is said.
//
// Out: colour is premultiplied, depth becomes a float, the primitive goes to channel `id`, the sample index, if there are several,
// to channel `sample`. In: colour is divided by alpha; the fragments become one transparent draw, pixel after pixel.
#include "convert.h"

#include "../io/deep.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

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

static void warn_losses(const trace_info *info, const char *path)
{
    bool plain = info->draw_count <= 1 && (info->draw_count == 0 || info->draws[0].class == CLASS_TRANSPARENT);
    report_warning(&command_report, "%s: a deep image keeps no background, and colour times alpha only%s%s%s", path,
                   info->depth_bits == 64 ? "; depth is rounded to 32 bits" : "",
                   plain ? "" : "; draws and their classes are lost",
                   info->samples > 1 ? "; the sample index is in channel `sample`, which other programs ignore" : "");
}

status convert_trace_to_deep(trace *trace, const char *path)
{
    const trace_info *info = trace_get_info(trace);
    size_t pixels = (size_t)info->width * info->height;
    deep_image image = {.width = info->width, .height = info->height};
    if (info->fragment_count > DEEP_COUNT_MAX)
        return report_error(&command_report, STATUS_REFUSED, "%s: %" PRIu64 " fragments; a deep image is made in memory, of at most %d",
                            path, info->fragment_count, DEEP_COUNT_MAX);
    uint64_t *next = malloc(pixels * sizeof *next);
    image.pixel_counts = calloc(pixels, sizeof *image.pixel_counts);
    status result = STATUS_OK;
    if (!next || !image.pixel_counts || !allocate(&image, info->fragment_count, info->samples > 1))
        result = report_error(&command_report, STATUS_IO, "%s: no memory", path);
    if (result == STATUS_OK)
        result = count_pixels(trace, &image);
    if (result == STATUS_OK)
        result = trace_rewind(trace);
    if (result == STATUS_OK)
        result = place_fragments(trace, &image, next);
    if (result == STATUS_OK)
        result = deep_write(path, &image, &command_report);
    if (result == STATUS_OK)
        warn_losses(info, path);
    free(next);
    deep_destroy(&image);
    return result;
}

// Depths of renderers are distances. Those outside [0, 1] are mapped affinely to [1/16, 15/16]: order and ties stay.
typedef struct depth_map {
    double scale, offset;
} depth_map;

static depth_map map_depths(const deep_image *image, const char *path)
{
    double least = INFINITY, most = -INFINITY;
    for (uint64_t i = 0; i < image->count; i++) {
        double depth = (double)image->depth[i];
        least = isfinite(depth) && depth < least ? depth : least;
        most = isfinite(depth) && depth > most ? depth : most;
    }
    if (least > most || (least >= 0 && most <= 1))
        return (depth_map){1, 0};
    depth_map map = {most > least ? 0.875 / (most - least) : 0, 0.0625};
    map.offset = 0.0625 - least * map.scale;
    report_warning(&command_report, "%s: depths from %g to %g are mapped to 0.0625 to 0.9375 (times %.9g plus %.9g)", path, least, most,
                   map.scale, map.offset);
    return map;
}

// One sample as a fragment; false if a value is not finite.
static bool straighten(const deep_image *image, uint64_t i, const depth_map *map, double *depth, float rgba[4])
{
    *depth = (double)image->depth[i] * map->scale + map->offset;
    rgba[3] = image->has_alpha ? image->rgba[3][i] : 1.0f;
    bool finite = isfinite(*depth) && isfinite(rgba[3]);
    for (int c = 0; c < 3; c++) {
        float premultiplied = image->rgba[c][i];
        rgba[c] = !image->has_color ? 1.0f : rgba[3] != 0 ? premultiplied / rgba[3] : premultiplied;
        finite = finite && isfinite(rgba[c]);
    }
    return finite;
}

static status append_pixels(const deep_image *image, const char *path, trace_writer *writer)
{
    depth_map map = map_depths(image, path);
    uint64_t i = 0, dropped = 0;
    status result = STATUS_OK;
    for (size_t p = 0; p < (size_t)image->width * image->height; p++)
        for (uint32_t s = 0; result == STATUS_OK && s < image->pixel_counts[p]; s++, i++) {
            uint16_t x = (uint16_t)(p % image->width), y = (uint16_t)(p / image->width);
            uint8_t sample = image->sample ? (uint8_t)image->sample[i] : 0;
            uint32_t primitive = image->id ? image->id[i] : 0;
            double depth;
            float rgba[4];
            if (!straighten(image, i, &map, &depth, rgba)) {
                dropped++;
                continue;
            }
            fragments one = {.count = 1, .x = &x, .y = &y, .sample = &sample, .depth = &depth,
                             .rgba = {&rgba[0], &rgba[1], &rgba[2], &rgba[3]}, .primitive = &primitive};
            result = trace_append(writer, &one);
        }
    if (dropped > 0)
        report_warning(&command_report, "%s: %" PRIu64 " samples with an infinity or a NaN were left out", path, dropped);
    return result;
}

// Samples a pixel: enough for the largest index of the channel; 0 if that is none that a trace can have.
static uint32_t sample_count(const deep_image *image)
{
    uint32_t samples = 1;
    for (uint64_t i = 0; image->sample && i < image->count; i++) {
        if (image->sample[i] >= TRACE_SAMPLES_MAX)
            return 0;
        while (samples <= image->sample[i])
            samples *= 2;
    }
    return samples;
}

static status write_trace(const deep_image *image, const char *from, const char *path)
{
    trace_info info = {.width = image->width, .height = image->height, .samples = sample_count(image), .depth_bits = 64};
    if (info.samples == 0)
        return report_error(&command_report, STATUS_REFUSED, "%s: channel `sample` goes beyond %d", from, TRACE_SAMPLES_MAX - 1);
    trace_standard_positions(&info);
    if (image->has_back)
        report_warning(&command_report, "%s: volumes are not known here: channel ZBack is ignored", from);
    if (!image->has_color || !image->has_alpha)
        report_warning(&command_report, "%s: no %s; taken as %s", from, image->has_color ? "channel A" : "channels R, G and B",
                       image->has_color ? "1" : "white");
    trace_writer *writer;
    char hash[33];
    status result = trace_create(path, &info, &command_report, &writer);
    if (result != STATUS_OK)
        return result;
    result = trace_begin_draw(writer, "deep", CLASS_TRANSPARENT);
    if (result == STATUS_OK)
        result = append_pixels(image, from, writer);
    if (result == STATUS_OK)
        result = trace_end_draw(writer, 0, 0);
    if (result == STATUS_OK)
        return trace_finish(writer, hash);
    trace_abandon(writer);
    return result;
}

status convert_deep_to_trace(const char *from, const char *path)
{
    deep_image image;
    status result = deep_read(from, &command_report, &image);
    if (result == STATUS_OK)
        result = write_trace(&image, from, path);
    deep_destroy(&image);
    return result;
}
