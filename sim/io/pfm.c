// Portable float maps, bit exact: "PF", width, height, -1 (little endian), then rows from the bottom up.
#include "pfm.h"

#include <stdlib.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "floats are written as they lie in memory");

bool pfm_write(FILE *file, uint32_t width, uint32_t height, const float *rgb)
{
    size_t row = (size_t)width * 3;
    if (fprintf(file, "PF\n%u %u\n-1.0\n", width, height) < 0)
        return false;
    for (uint32_t y = height; y-- > 0;) {
        if (fwrite(rgb + y * row, sizeof *rgb, row, file) != row)
            return false;
    }
    return true;
}

const char *pfm_read(FILE *file, uint64_t pixels_max, uint32_t *width, uint32_t *height, float **rgb)
{
    double scale = 0;
    *rgb = NULL;
    if (fscanf(file, "PF %9u %9u %lf", width, height, &scale) != 3 || fgetc(file) != '\n')
        return "not a colour PFM: it must open with PF, width, height and scale";
    if (scale >= 0)
        return "a big-endian PFM (its scale is not negative)";
    if (*width == 0 || *height == 0 || (uint64_t)*width * *height > pixels_max)
        return "no pixels, or more than this reader takes";
    size_t row = (size_t)*width * 3;
    *rgb = malloc(row * *height * sizeof **rgb);
    if (!*rgb)
        return "out of memory";
    for (uint32_t y = *height; y-- > 0;) {
        if (fread(*rgb + y * row, sizeof **rgb, row, file) != row) {
            free(*rgb);
            *rgb = NULL;
            return "the file ends before its pixels do";
        }
    }
    return NULL;
}
