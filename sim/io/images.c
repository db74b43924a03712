// Pictures: linear RGB floats to .exr, .pfm or .png by the file's ending, and back.
//
// EXR and PFM keep every float's bits. PNG is 8-bit sRGB: NaN to 0, clamped to [0, 1], IEC 61966-2-1's curve
// in double, then floor(255 v + 1/2), as D3D11.3 3.2.3.6 converts floats to normalised bytes.
#include "image_module.h"
#include "pfm.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef enum image_kind { IMAGE_EXR, IMAGE_PFM, IMAGE_PNG, IMAGE_KIND_COUNT } image_kind;
static const struct {
    const char *ending, *module_name;
} image_kinds[IMAGE_KIND_COUNT] = {{".exr", "openexr"}, {".pfm", NULL}, {".png", "png"}};

enum { WHY_SIZE = 512 };
static const uint64_t pixels_max = (uint64_t)TRACE_SIZE_MAX * TRACE_SIZE_MAX;

static status find_kind(const char *path, const report *report, image_kind *kind)
{
    size_t length = strlen(path);
    for (int i = 0; i < IMAGE_KIND_COUNT; i++) {
        size_t tail = strlen(image_kinds[i].ending);
        if (length > tail && strcasecmp(path + length - tail, image_kinds[i].ending) == 0) {
            *kind = (image_kind)i;
            return STATUS_OK;
        }
    }
    return report_error(report, STATUS_USAGE, "%s: an image's name must end in .exr, .pfm or .png", path);
}

status image_check_ending(const char *path, const report *report)
{
    image_kind kind = IMAGE_KIND_COUNT;
    return find_kind(path, report, &kind);
}

static uint8_t srgb_from_linear(float linear)
{
    double value = linear > 0 ? (double)linear : 0;  // false for NaN
    if (value > 1)
        value = 1;
    double curved = value <= 0.0031308 ? 12.92 * value : 1.055 * pow(value, 1 / 2.4) - 0.055;
    return (uint8_t)(255 * curved + 0.5);
}

static float linear_from_srgb(float srgb)
{
    double value = (double)srgb;
    return (float)(value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4));
}

static status write_by_module(aside *aside, const char *path, image_kind kind, uint32_t width, uint32_t height,
                              const float *rgb, const report *report)
{
    image_functions functions;
    char why[WHY_SIZE];
    size_t count = (size_t)width * height * 3;
    uint8_t *bytes = NULL;
    status result = image_module(report, &functions);
    if (result != STATUS_OK)
        return result;
    if (kind == IMAGE_PNG) {
        bytes = malloc(count);
        if (!bytes)
            return report_error(report, STATUS_IO, "%s: out of memory", path);
        for (size_t i = 0; i < count; i++)
            bytes[i] = srgb_from_linear(rgb[i]);
    }
    if (functions.write_rgb(aside_path(aside), image_kinds[kind].module_name, width, height, kind == IMAGE_EXR,
                            bytes ? (const void *)bytes : rgb, why, sizeof why))
        result = report_error(report, STATUS_IO, "%s: cannot be written: %s", path, why);
    free(bytes);
    return result;
}

status image_write_rgb(const char *path, uint32_t width, uint32_t height, const float *rgb, const report *report)
{
    image_kind kind = IMAGE_KIND_COUNT;
    aside *aside = NULL;
    FILE *file = NULL;
    status result = find_kind(path, report, &kind);
    if (result != STATUS_OK)
        return result;
    if (width == 0 || height == 0 || width > TRACE_SIZE_MAX || height > TRACE_SIZE_MAX)
        return report_error(report, STATUS_REFUSED, "%s: an image of %u x %u pixels; each must be 1 to %d", path, width,
                            height, TRACE_SIZE_MAX);
    if (kind == IMAGE_PFM) {
        result = aside_open(path, report, &aside, &file);
        if (result == STATUS_OK && !pfm_write(file, width, height, rgb))
            result = report_error(report, STATUS_IO, "%s: cannot be written: %s", path, strerror(errno));
    } else {
        result = aside_create(path, report, &aside);
        if (result == STATUS_OK)
            result = write_by_module(aside, path, kind, width, height, rgb, report);
    }
    if (result == STATUS_OK)
        return aside_finish(aside);
    aside_discard(aside);
    return result;
}

static status read_pfm(const char *path, const report *report, uint32_t *width, uint32_t *height, float **rgb)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    const char *why = pfm_read(file, pixels_max, width, height, rgb);
    fclose(file);
    return why ? report_error(report, STATUS_REFUSED, "%s: %s", path, why) : STATUS_OK;
}

status image_read_rgb(const char *path, const report *report, uint32_t *width, uint32_t *height, float **rgb)
{
    image_kind kind = IMAGE_KIND_COUNT;
    image_functions functions;
    char why[WHY_SIZE];
    *rgb = NULL;
    *width = *height = 0;
    status result = find_kind(path, report, &kind);
    if (result != STATUS_OK)
        return result;
    if (kind == IMAGE_PFM)
        return read_pfm(path, report, width, height, rgb);
    result = image_module(report, &functions);
    if (result != STATUS_OK)
        return result;
    if (functions.read_rgb(path, image_kinds[kind].module_name, pixels_max, width, height, rgb, why, sizeof why))
        return report_error(report, STATUS_REFUSED, "%s: cannot be read as an image: %s", path, why);
    size_t count = (size_t)*width * *height * 3;
    for (size_t i = 0; kind == IMAGE_PNG && i < count; i++)
        (*rgb)[i] = linear_from_srgb((*rgb)[i]);
    return STATUS_OK;
}
