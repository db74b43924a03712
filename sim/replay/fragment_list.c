// An A-buffer: each sample's fragments into a list, the list sorted and blended.
//
// The list is never built: the bins hold each sample's fragments in order already. What is kept and lost is counted as if it were,
// and so is its memory. Blending is in float, as a shader does it in registers; the result is rounded to the plane's format once.
#include "fragment_list.h"

#include <stdlib.h>
#include <string.h>

typedef struct entry { uint32_t code; uint64_t at; } entry;

// The fragments of one lane that the list keeps, in order of arrival.
static uint32_t keep(const step *step, const bins *bins, const bin *bin, const uint32_t *codes, int lane, uint32_t before,
                     entry *entries, uint64_t *lost)
{
    uint32_t count = 0;
    for (uint32_t r = bin->opaque_count; r < bin->opaque_count + bin->transparent_count; r++) {
        const bin_batch *batch = &bins->batches[bin->first_batch + r];
        const uint64_t bit = 1ull << lane;
        if (!(batch->lanes & bit))
            break;
        const bool sorted = batch->sorted & bit;
        if (!(step->classes & (sorted ? DRAW_SORTED : DRAW_UNSORTED)))
            continue;
        const uint64_t at = batch->offset + count_lanes(batch->lanes & (bit - 1));
        if (codes[at] == 0 || codes[at] >= before)  // on the near plane, or behind what is opaque
            continue;
        if (count < step->entries)
            entries[count++] = (entry){codes[at], at};
        else
            ++*lost;
    }
    return count;
}

static int nearest_first(const void *a, const void *b)
{
    const entry *x = a, *y = b;
    if (x->code != y->code)
        return x->code < y->code ? -1 : 1;
    return x->at < y->at ? -1 : 1;  // a later fragment of a sample lies in a later batch
}

static void blend_entries(const blend_decl *state, const bins *bins, const entry *entries, uint32_t count, float color[4])
{
    for (uint32_t i = 0; i < count; i++) {
        const uint64_t at = entries[i].at;
        const float alpha = bins->rgba[3][at];
        const float source[4] = {bins->rgba[0][at] * alpha, bins->rgba[1][at] * alpha, bins->rgba[2][at] * alpha, alpha};
        float blended[4];
        blend_color(state, source, color, blended);
        memcpy(color, blended, sizeof blended);
    }
}

bool fragment_list_run(const plan *plan, const step *step, const bins *bins, const bin *bin, const tile_plane *planes,
                       uint64_t *kept, uint64_t *lost)
{
    entry *entries = malloc(((size_t)bin->transparent_count + 1) * sizeof *entries);
    if (!entries)
        return false;
    const uint32_t *codes = bins->codes[bound_plane_format(plan->bound, step->source)];
    const format format = bound_plane_format(plan->bound, step->plane);
    float *const plane = (float *)(void *)planes[step->plane];
    for (int lane = 0; lane < TILE_LANES; lane++) {
        const uint32_t count = keep(step, bins, bin, codes, lane, planes[step->source][lane], entries, lost);
        if (!count)
            continue;
        *kept += count;
        qsort(entries, count, sizeof *entries, nearest_first);
        float color[4];
        for (int c = 0; c < 4; c++)
            color[c] = plane[c * TILE_LANES + lane];
        blend_entries(&plan->program->blends[step->kernel], bins, entries, count, color);
        for (int c = 0; c < 4; c++)
            plane[c * TILE_LANES + lane] = format_round_component(format, color[c]);
    }
    free(entries);
    return true;
}
