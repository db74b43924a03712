// The exact result by sorting, one sample at a time, and how far the image is from it.
#include "twin.h"

#include <math.h>
#include <stdlib.h>

typedef struct layer {
    double depth;
    uint32_t order;
} layer;

static int nearest_first(const void *a, const void *b)
{
    const layer *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth < y->depth ? -1 : 1;
    return x->order < y->order ? -1 : x->order > y->order;
}

// Back to front: the opposite of what the replay's reference does.
static void exact_color(const twin_image *image, const uint32_t *own, uint32_t count, layer *layers, double rgb[3])
{
    double opaque = 1.0;
    for (int c = 0; c < 3; c++)
        rgb[c] = (double)image->background[c];
    for (uint32_t i = 0; i < count; i++) {
        const twin_fragment *f = &image->fragments[own[i]];
        const double depth = fmax(f->depth, 0.0);
        if (image->classes[f->draw] != CLASS_OPAQUE || !(depth < opaque))
            continue;
        opaque = depth;
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)f->rgba[c];
    }
    uint32_t layer_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const twin_fragment *f = &image->fragments[own[i]];
        if (image->classes[f->draw] != CLASS_OPAQUE && f->depth > 0.0 && f->depth < opaque)
            layers[layer_count++] = (layer){f->depth, own[i]};
    }
    qsort(layers, layer_count, sizeof *layers, nearest_first);
    while (layer_count-- > 0) {
        const float *rgba = image->fragments[layers[layer_count].order].rgba;
        for (int c = 0; c < 3; c++)
            rgb[c] = (double)rgba[3] * (double)rgba[c] + (1.0 - (double)rgba[3]) * rgb[c];
    }
}

void twin_error(const twin_image *image, twin_result *result)
{
    const uint64_t sample_count = (uint64_t)image->width * image->height * image->samples;
    uint32_t *own = malloc(((size_t)image->fragment_count + 1) * sizeof *own);
    layer *layers = malloc(((size_t)image->fragment_count + 1) * sizeof *layers);
    uint32_t *first = calloc(sample_count + 1, sizeof *first);
    // Fragments by sample: counted, then placed.
    for (uint32_t i = 0; i < image->fragment_count; i++)
        first[twin_sample(image, &image->fragments[i]) + 1]++;
    for (uint64_t s = 0; s < sample_count; s++)
        first[s + 1] += first[s];
    uint32_t *next = malloc((sample_count + 1) * sizeof *next);
    for (uint64_t s = 0; s < sample_count; s++)
        next[s] = first[s];
    for (uint32_t i = 0; i < image->fragment_count; i++)
        own[next[twin_sample(image, &image->fragments[i])]++] = i;
    double squares = 0.0;
    for (uint64_t s = 0; s < sample_count; s++) {
        double rgb[3];
        bool wrong = false;
        exact_color(image, own + first[s], first[s + 1] - first[s], layers, rgb);
        for (int c = 0; c < 3; c++) {
            const double value = (double)result->sample_rgb[3 * s + (uint64_t)c];
            const bool same = value == rgb[c] || (isnan(value) && isnan(rgb[c]));
            const double error = same ? 0.0 : isnan(value - rgb[c]) ? INFINITY : fabs(value - rgb[c]);
            result->max_abs = fmax(result->max_abs, error);
            squares += error * error;
            wrong |= error > 1e-5;
        }
        result->samples_wrong += wrong;
    }
    result->rmse = sqrt(squares / (3.0 * (double)sample_count));
    free(own);
    free(layers);
    free(first);
    free(next);
}
