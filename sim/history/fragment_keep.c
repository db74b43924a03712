// A `list` step on one sample: which fragments its list keeps, and how they are blended in order of depth.
//
// Blending is in float; the plane takes the result, rounded once, when all are blended.
#include "history.h"

#include <stdlib.h>
#include <string.h>

static bool test(history *h, uint32_t code, format format, const char *relation, named_value bound, bool holds)
{
    event *event = event_add(h, EVENT_CLIP);
    event->relation = relation;
    event->holds = holds;
    event->left = value_named("z", format, code);
    event->right = bound;
    return holds;
}

void fragment_keep(history *h, const step *step, uint64_t index, kept_list *list)
{
    const format format = bound_plane_format(h->bound, step->source);
    const uint32_t code = format_depth_to_code(format, h->fragments[index].input.depth, h->info->reversed_depth);
    h->event_count = 0;
    if (!test(h, code, format, ">", value_named("near", format, 0), code > 0))
        return;
    const named_value before = value_of_plane(h, step->source, h->planes[step->source]);
    if (!test(h, code, format, "<", before, code < before.words[0]))
        return;
    event *event = event_add(h, EVENT_LIST);
    event->holds = list->count < step->entries;
    if (event->holds)
        list->kept[list->count++] = (kept_fragment){code, index};
}

static int nearest_first(const void *a, const void *b)
{
    const kept_fragment *x = a, *y = b;
    if (x->code != y->code)
        return x->code < y->code ? -1 : 1;
    return x->index < y->index ? -1 : 1;
}

void kept_sort(kept_list *list)
{
    qsort(list->kept, list->count, sizeof *list->kept, nearest_first);
}

void kept_blend(history *h, const step *step, uint64_t index, float color[4])
{
    const blend_decl *blend = &h->program->blends[step->kernel];
    const float *rgba = h->fragments[index].input.rgba;
    const float source[4] = {rgba[0] * rgba[3], rgba[1] * rgba[3], rgba[2] * rgba[3], rgba[3]};
    float blended[4];
    blend_color(blend, source, color, blended);
    h->event_count = 0;
    if (blend->composites)
        event_add(h, EVENT_COMPOSITE);
    event *event = event_add(h, EVENT_WRITE);
    event->left = event->right = value_named(h->program->planes[step->plane].name, FORMAT_rgba32f, 0);
    memcpy(event->left.words, color, sizeof event->left.words);
    memcpy(event->right.words, blended, sizeof event->right.words);
    memcpy(color, blended, sizeof blended);
}
