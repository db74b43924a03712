// What the schedule does with whole draws: batches of them, and lists of their fragments.
#include "twin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct object {
    uint32_t draw, nearest, farthest;
} object;

// The transparent and sorted draws with a fragment, by nearest depth: an insertion sort, which keeps the draws' order among equals.
static uint32_t sort_draws(const twin *twin, object objects[TWIN_DRAW_MAX])
{
    uint32_t count = 0;
    for (uint32_t d = 0; d < twin->image->draw_count; d++) {
        double nearest = INFINITY, farthest = -INFINITY;
        bool any = false;
        for (uint32_t i = 0; i < twin->image->fragment_count; i++) {
            const twin_fragment *fragment = &twin->image->fragments[i];
            if (fragment->draw != d)
                continue;
            any = true;
            nearest = fmin(nearest, fragment->depth);
            farthest = fmax(farthest, fragment->depth);
        }
        if (!any || twin->image->classes[d] == CLASS_OPAQUE)
            continue;
        const format format = twin->limits->depth_format;
        const object object = {d, twin_depth_code(format, nearest, twin->image->reversed_depth),
                               twin_depth_code(format, farthest, twin->image->reversed_depth)};
        uint32_t at = count++;
        for (; at > 0 && objects[at - 1].nearest > object.nearest; at--)
            objects[at] = objects[at - 1];
        objects[at] = object;
    }
    return count;
}

void twin_make_batches(twin *twin, uint32_t draws_each)
{
    object objects[TWIN_DRAW_MAX];
    const uint32_t count = sort_draws(twin, objects);
    twin_batches *batches = &twin->batches;
    *batches = (twin_batches){.count = (count + draws_each - 1) / draws_each};
    for (uint32_t b = 0; b < batches->count; b++) {
        const bool last = b + 1 == batches->count;
        batches->near_code[b] = b == 0 ? 0 : objects[b * draws_each].nearest;
        batches->far_code[b] = last ? twin_far(twin->limits->depth_format) : objects[(b + 1) * draws_each].nearest;
        for (uint32_t i = 0; i < count; i++)
            batches->drawn[b][objects[i].draw] =
                objects[i].farthest >= batches->near_code[b] && (last || objects[i].nearest < batches->far_code[b]);
    }
}

typedef struct kept {
    uint32_t code;
    const twin_fragment *fragment;
} kept;

// One sample's fragments into a list, sorted by depth, blended; returns how many the list kept.
static uint32_t blend_sample(twin *twin, const step *step, uint64_t sample, kept *list)
{
    uint32_t count = 0, before;
    twin_plane *planes = twin->result->planes;
    before = planes[step->source].values[sample];
    for (uint32_t i = 0; i < twin->image->fragment_count; i++) {
        const twin_fragment *fragment = &twin->image->fragments[i];
        if (twin_sample(twin->image, fragment) != sample || !(step->classes >> twin->image->classes[fragment->draw] & 1))
            continue;
        const uint32_t code = twin_depth_code(twin->formats[step->source], fragment->depth, twin->image->reversed_depth);
        if (code == 0 || code >= before)
            continue;
        if (count == step->entries) {
            twin->result->list_lost++;
            continue;
        }
        uint32_t at = count++;
        for (; at > 0 && list[at - 1].code > code; at--)
            list[at] = list[at - 1];
        list[at] = (kept){code, fragment};
    }
    uint32_t *color = planes[step->plane].values + 4 * sample;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t source[4], blended[4];
        twin_color(list[i].fragment, SOURCE_FRAGMENT_PREMUL, source);
        twin_blend(twin, step->kernel, source, color, blended);
        memcpy(color, blended, sizeof blended);
    }
    for (int c = 0; c < 4; c++)
        color[c] = twin_round(twin->formats[step->plane], color[c]);
    return count;
}

void twin_list(twin *twin, const step *step)
{
    kept *list = calloc(twin->image->fragment_count + 1, sizeof *list);
    for (uint64_t sample = 0; sample < twin->sample_count; sample++)
        twin->result->list_kept += blend_sample(twin, step, sample, list);
    free(list);
    uint64_t replayed = 0;
    for (uint32_t i = 0; i < twin->image->fragment_count; i++)
        replayed += step->classes >> twin->image->classes[twin->image->fragments[i].draw] & 1;
    twin->result->fragments_replayed += replayed;
    twin_plane *before = &twin->result->planes[step->source], *into = &twin->result->planes[step->plane];
    const uint64_t color_bytes = (uint64_t)format_table[twin->formats[step->plane]].bits / 8;
    before->bytes_read += replayed * (uint64_t)format_table[twin->formats[step->source]].bits / 8;
    into->bytes_read += twin->sample_count * color_bytes;
    into->bytes_written += twin->sample_count * color_bytes;
}
