// Deep images through the image module.
#include "deep.h"

#include "image_module.h"

#include <stdlib.h>
#include <unistd.h>

enum { WHY_SIZE = 512 };

status deep_write(const char *path, const deep_image *image, const report *report)
{
    image_functions functions;
    aside *aside = NULL;
    char why[WHY_SIZE];
    status result = image_module(report, &functions);
    if (result == STATUS_OK)
        result = aside_create(path, report, &aside);
    if (result == STATUS_OK && functions.write_deep(aside_path(aside), image, why, sizeof why))
        result = report_error(report, STATUS_IO, "%s: cannot be written as a deep image: %s", path, why);
    if (result == STATUS_OK)
        return aside_finish(aside);
    aside_discard(aside);
    return result;
}

status deep_read(const char *path, const report *report, deep_image *image)
{
    image_functions functions;
    char why[WHY_SIZE];
    *image = (deep_image){0};
    if (access(path, R_OK) != 0)
        return report_error(report, STATUS_IO, "%s: cannot be opened", path);
    status result = image_module(report, &functions);
    if (result == STATUS_OK && functions.read_deep(path, DEEP_COUNT_MAX, image, why, sizeof why))
        result = report_error(report, STATUS_REFUSED, "%s: cannot be read as a deep image: %s", path, why);
    if (result != STATUS_OK)
        deep_destroy(image);
    return result;
}

void deep_destroy(deep_image *image)
{
    free(image->pixel_counts);
    free(image->depth);
    for (int c = 0; c < 4; c++)
        free(image->rgba[c]);
    free(image->id);
    free(image->sample);
    *image = (deep_image){0};
}
