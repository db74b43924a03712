// A deep image as plain arrays, for C and for the C++ of the image module.
#ifndef ROPSIM_MODULE_DEEP_IMAGE_H
#define ROPSIM_MODULE_DEEP_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

typedef struct deep_image {
    uint32_t width, height;
    uint64_t count;          // samples of all pixels
    uint32_t *pixel_counts;  // width * height, rows from the top
    float *depth, *rgba[4];  // pixel after pixel, each in the file's order; colour premultiplied, as is the custom
    uint32_t *id, *sample;   // primitive and sample index, or NULL
    bool has_color, has_alpha, has_back;  // as read: R, G and B; A; ZBack, whose values are not kept
} deep_image;

#endif
