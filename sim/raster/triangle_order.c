// Draw order of a draw's triangles, by the distance of their centroids along the view.
//
// Sorts are stable: triangles at one distance stay in the file's order. A draw of class sorted promises to be front
// to back, so back and shuffle leave it alone.
#include "raster.h"

#include <stdlib.h>

typedef struct keyed {
    double distance;
    uint32_t triangle;
} keyed;

static int compare_front(const void *left, const void *right)
{
    const keyed *a = left, *b = right;
    if (a->distance != b->distance)
        return a->distance < b->distance ? -1 : 1;
    return a->triangle < b->triangle ? -1 : a->triangle > b->triangle;
}

static int compare_back(const void *left, const void *right)
{
    const keyed *a = left, *b = right;
    if (a->distance != b->distance)
        return a->distance > b->distance ? -1 : 1;
    return a->triangle < b->triangle ? -1 : a->triangle > b->triangle;
}

static double centroid_distance(const model *model, const view *view, uint32_t triangle)
{
    double distance = 0;
    for (int corner = 0; corner < 3; corner++) {
        const float *position = model->mesh->positions[model->mesh->triangles[triangle][corner]];
        for (int i = 0; i < 3; i++)
            distance += view->forward[i] * ((double)position[i] - view->eye[i]);
    }
    return distance / 3;
}

// Distances become bucket numbers: equal slices of the draw's range, as in the papers' bucket sort.
static void to_buckets(keyed *keys, uint32_t count, uint64_t buckets)
{
    double low = keys[0].distance, high = low;
    for (uint32_t i = 1; i < count; i++) {
        low = keys[i].distance < low ? keys[i].distance : low;
        high = keys[i].distance > high ? keys[i].distance : high;
    }
    for (uint32_t i = 0; i < count; i++) {
        double place = high > low ? (keys[i].distance - low) / (high - low) * (double)buckets : 0;
        uint64_t bucket = (uint64_t)place;
        keys[i].distance = (double)(bucket < buckets ? bucket : buckets - 1);
    }
}

static void shuffle(uint32_t *order, uint32_t count, uint64_t seed)
{
    for (uint32_t i = count; i > 1; i--) {
        uint32_t j = (uint32_t)random_below(&seed, i), swapped = order[i - 1];
        order[i - 1] = order[j];
        order[j] = swapped;
    }
}

status triangle_order_fill(const model *model, const view *view, triangle_order kind, uint64_t parameter,
                           const report *report, uint32_t *order)
{
    uint32_t count = model->mesh->triangle_count;
    for (uint32_t i = 0; i < count; i++)
        order[i] = i;
    bool sorted = model->class == CLASS_SORTED;
    if (kind == ORDER_NONE || count == 0 || (sorted && (kind == ORDER_BACK || kind == ORDER_SHUFFLE)))
        return STATUS_OK;
    if (kind == ORDER_SHUFFLE) {
        shuffle(order, count, parameter);
        return STATUS_OK;
    }
    keyed *keys = malloc(count * sizeof *keys);
    if (!keys)
        return report_error(report, STATUS_IO, "%s: out of memory", model->name);
    for (uint32_t i = 0; i < count; i++)
        keys[i] = (keyed){centroid_distance(model, view, i), i};
    if (kind == ORDER_BUCKET)
        to_buckets(keys, count, parameter ? parameter : 1);
    qsort(keys, count, sizeof *keys, kind == ORDER_BACK ? compare_back : compare_front);
    for (uint32_t i = 0; i < count; i++)
        order[i] = keys[i].triangle;
    free(keys);
    return STATUS_OK;
}
