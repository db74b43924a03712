// The draws of a trace in, batches of them out, after Wexler, Gritz, Enderton and Rice 2005.
//
// Transparent and sorted draws that have a fragment are put in order of their nearest depth, ties in order of the trace, and cut
// into batches of a fixed number. The depths are cut where batches start, so that each fragment belongs to one batch; a draw that
// reaches over a cut is drawn in each batch that it reaches into, and the clip leaves it its share. All in codes of the
// machine's depth format, so that the cuts are what the clip compares.
#include "replay.h"

#include <stdlib.h>

typedef struct object { uint32_t near_code, far_code, draw; } object;

static int nearest_first(const void *a, const void *b)
{
    const object *x = a, *y = b;
    if (x->near_code != y->near_code)
        return x->near_code < y->near_code ? -1 : 1;
    return x->draw < y->draw ? -1 : 1;
}

static uint32_t gather(const trace_info *info, const draw_range *ranges, format depth_format, object *objects)
{
    uint32_t count = 0;
    for (uint32_t d = 0; d < info->draw_count; d++) {
        if (info->draws[d].class == CLASS_OPAQUE || !info->draws[d].fragments)
            continue;
        objects[count++] = (object){format_depth_to_code(depth_format, ranges[d].nearest, info->reversed_depth),
                                    format_depth_to_code(depth_format, ranges[d].farthest, info->reversed_depth), d};
    }
    qsort(objects, count, sizeof *objects, nearest_first);
    return count;
}

static bool fill(draw_batch *batch, const trace_info *info, const object *objects, uint32_t object_count, bool last)
{
    batch->draws = calloc(info->draw_count, sizeof *batch->draws);
    for (uint32_t i = 0; batch->draws && i < object_count; i++) {
        const object *o = &objects[i];
        if (o->far_code < batch->near_code || (o->near_code >= batch->far_code && !last))
            continue;
        batch->draws[o->draw] = 1;
        batch->class_fragments[info->draws[o->draw].class] += info->draws[o->draw].fragments;
    }
    return batch->draws;
}

status batches_make(const trace_info *info, const draw_range *ranges, uint32_t draws_each, format depth_format,
                    const report *report, draw_batches *batches)
{
    *batches = (draw_batches){0};
    object *objects = malloc((info->draw_count + 1) * sizeof *objects);
    const uint32_t object_count = objects ? gather(info, ranges, depth_format, objects) : 0;
    const uint32_t count = (object_count + draws_each - 1) / draws_each;
    batches->batches = calloc(count + 1, sizeof *batches->batches);
    bool good = objects && batches->batches;
    for (uint32_t i = 0; good && i < count; i++) {
        draw_batch *batch = &batches->batches[i];
        const bool last = i + 1 == count;
        batch->near_code = i ? objects[i * draws_each].near_code : 0;
        batch->far_code = last ? format_far_code(depth_format) : objects[(i + 1) * draws_each].near_code;
        good = fill(batch, info, objects, object_count, last);
        batches->count = i + 1;
    }
    free(objects);
    return good ? STATUS_OK : report_error(report, STATUS_IO, "out of memory: %u batches of draws", count);
}

void batches_free(draw_batches *batches)
{
    for (uint32_t i = 0; i < batches->count; i++)
        free(batches->batches[i].draws);
    free(batches->batches);
    *batches = (draw_batches){0};
}
