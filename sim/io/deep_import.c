// A deep image to a trace: colour is divided by alpha; the fragments become one transparent draw, pixel after pixel.
#include "deep.h"

#include <inttypes.h>
#include <math.h>

// Depths of renderers are distances. Those outside [0, 1] are mapped affinely to [1/16, 15/16]: order and ties stay.
typedef struct depth_map {
    double scale, offset;
} depth_map;

static depth_map map_depths(const deep_image *image, const char *path, const report *report)
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
    report_warning(report, "%s: depths from %g to %g are mapped to 0.0625 to 0.9375 (times %.9g plus %.9g)", path,
                   least, most, map.scale, map.offset);
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

static status append_pixels(const deep_image *image, const char *path, trace_writer *writer, const report *report)
{
    depth_map map = map_depths(image, path, report);
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
            fragments one = {.count = 1,
                             .x = &x,
                             .y = &y,
                             .sample = &sample,
                             .depth = &depth,
                             .rgba = {&rgba[0], &rgba[1], &rgba[2], &rgba[3]},
                             .primitive = &primitive};
            result = trace_append(writer, &one);
        }
    if (dropped > 0)
        report_warning(report, "%s: %" PRIu64 " samples with an infinity or a NaN were left out", path, dropped);
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

static status write_trace(const deep_image *image, const char *from, const char *path, const report *report)
{
    trace_info info = {
        .width = image->width, .height = image->height, .samples = sample_count(image), .depth_bits = 64};
    if (info.samples == 0)
        return report_error(report, STATUS_REFUSED, "%s: channel `sample` goes beyond %d", from, TRACE_SAMPLES_MAX - 1);
    trace_standard_positions(&info);
    if (image->has_back)
        report_warning(report, "%s: volumes are not known here: channel ZBack is ignored", from);
    if (!image->has_color || !image->has_alpha)
        report_warning(report, "%s: no %s; taken as %s", from, image->has_color ? "channel A" : "channels R, G and B",
                       image->has_color ? "1" : "white");
    trace_writer *writer;
    char hash[33];
    status result = trace_create(path, &info, report, &writer);
    if (result != STATUS_OK)
        return result;
    result = trace_begin_draw(writer, "deep", CLASS_TRANSPARENT);
    if (result == STATUS_OK)
        result = append_pixels(image, from, writer, report);
    if (result == STATUS_OK)
        result = trace_end_draw(writer, 0, 0);
    if (result == STATUS_OK)
        return trace_finish(writer, hash);
    trace_abandon(writer);
    return result;
}

status deep_import(const char *from, const char *path, const report *report)
{
    deep_image image;
    status result = deep_read(from, report, &image);
    if (result == STATUS_OK)
        result = write_trace(&image, from, path, report);
    deep_destroy(&image);
    return result;
}
