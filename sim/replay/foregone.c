// A batch's range of depths and the ranges of its tile's planes in; whether its outcome is foregone, and then its counts, out.
//
// A plane's range is found when a test asks for it, and holds until the plane is written to. So it costs least where batches are passed
// over, and as much as a few instructions of a kernel where they are not.
#include "foregone.h"

#include <stdlib.h>
#include <string.h>

static void note_tested(const plan *plan, foresight *f)
{
    for (int k = 0; plan->foregone && k < plan->program->kernel_count; k++)
        for (int plane = 0; plane < plan->program->plane_count; plane++)
            f->tested[plane] |= plan->foregone[k].tests_of[plane] != 0;
}

static void note_stores(const plan *plan, foresight *f)
{
    uint32_t found = 0;
    for (int k = 0; k < plan->program->kernel_count; k++) {
        int count;
        const instruction *code = bound_instructions(plan->bound, k, &count);
        f->store_start[k] = found;
        for (int i = 0; i < count; i++)
            if (code[i].op == OP_st && f->tested[code[i].d])
                f->stores[found++] = (watched_store){plan->count_offset[k] + (uint32_t)i, code[i].d};
        f->store_start[k + 1] = found;
    }
}

bool foresight_make(const plan *plan, foresight *f)
{
    f->plan = plan;
    f->stores = malloc(((size_t)plan->count_total + 1) * sizeof *f->stores);  // every instruction may store
    f->seen = calloc((size_t)plan->count_total + 1, sizeof *f->seen);
    if (!f->stores || !f->seen)
        return false;
    note_tested(plan, f);
    note_stores(plan, f);
    return true;
}

void foresight_free(foresight *f)
{
    free(f->stores);
    free(f->seen);
}

// ---- What planes hold ----------------------------------------------------------------------------------

void foresight_start(foresight *f)
{
    memset(f->known, 0, sizeof f->known);
}

void foresight_cleared(foresight *f, int plane, const uint32_t value[4])
{
    for (int channel = 0; channel < 4; channel++) {
        f->ranges[4 * plane + channel] = (depth_range){value[channel], value[channel]};
        f->known[4 * plane + channel] = f->tested[plane];
    }
}

void foresight_copied(foresight *f, int plane, int source)
{
    for (int channel = 0; channel < 4; channel++) {
        f->ranges[4 * plane + channel] = f->ranges[4 * source + channel];
        f->known[4 * plane + channel] = f->tested[plane] && f->known[4 * source + channel];
    }
}

void foresight_swapped(foresight *f, int plane, int other)
{
    for (int channel = 0; channel < 4; channel++) {
        const depth_range range = f->ranges[4 * plane + channel];
        const bool known = f->known[4 * plane + channel];
        f->ranges[4 * plane + channel] = f->ranges[4 * other + channel];
        f->known[4 * plane + channel] = f->tested[plane] && f->known[4 * other + channel];
        f->ranges[4 * other + channel] = range;
        f->known[4 * other + channel] = f->tested[other] && known;
    }
}

void foresight_wrote(foresight *f, int plane)
{
    memset(&f->known[4 * plane], 0, 4 * sizeof *f->known);
    if (f->tree)
        f->settled &= ~f->tree->tests_of[plane];
}

void foresight_executed(foresight *f, int kernel, const uint64_t *counts)
{
    for (uint32_t s = f->store_start[kernel], end = f->store_start[kernel + 1]; s < end; s++) {
        if (counts[f->stores[s].at] == f->seen[s])
            continue;
        f->seen[s] = counts[f->stores[s].at];
        foresight_wrote(f, f->stores[s].plane);
    }
}

static depth_range range_of(const uint32_t *words, uint32_t count)
{
    depth_range range = {UINT32_MAX, 0};
    for (uint32_t i = 0; i < count; i++) {
        range.least = words[i] < range.least ? words[i] : range.least;
        range.most = words[i] > range.most ? words[i] : range.most;
    }
    return range;
}

static depth_range column_range(foresight *f, const tile_plane *planes, int column)
{
    if (f->known[column])
        return f->ranges[column];
    f->ranges[column] = range_of(planes[column / 4] + column % 4 * TILE_LANES, TILE_LANES);
    f->known[column] = true;
    return f->ranges[column];
}

// ---- Tests ---------------------------------------------------------------------------------------------

static depth_range value_range(foresight *f, const tile_plane *planes, const ranged *value)
{
    if (value->kind != RANGED_COLUMNS)
        return (depth_range){value->constant, value->constant};
    depth_range range = column_range(f, planes, value->columns[0]);
    for (int i = 1; i < value->count; i++) {
        const depth_range next = column_range(f, planes, value->columns[i]);
        range.least = next.least < range.least ? next.least : range.least;
        range.most = next.most < range.most ? next.most : range.most;
    }
    return range;
}

static settled_test bounds(const foregone_test *test, depth_range other, bool depth_is_right)
{
    const bool orders = test->op == OP_lt || test->op == OP_ge, yes = test->op == OP_lt || test->op == OP_ne;
    settled_test settled = {.below = other.least, .from = (uint64_t)other.most + 1};
    settled.next_below = test->next[yes != (orders && depth_is_right)];
    settled.next_from = test->next[yes != (orders && !depth_is_right)];
    if (orders && !depth_is_right)
        settled.from--;
    if (orders && depth_is_right)
        settled.below++;
    return settled;
}

// Seldom called, and not to be mixed into the loop over batches.
__attribute__((noinline)) static settled_test settle_test(foresight *f, const tile_plane *planes, const foregone_test *test)
{
    const bool depth_left = test->a.kind == RANGED_DEPTH, depth_right = test->b.kind == RANGED_DEPTH;
    if (depth_left && depth_right)
        return (settled_test){.below = 0, .from = UINT64_MAX};
    const depth_range a = value_range(f, planes, &test->a), b = value_range(f, planes, &test->b);
    settled_test settled = bounds(test, depth_right ? a : b, depth_right);
    if (depth_left || depth_right)
        return settled;
    // Nothing depends on the depths of the batch: what comes next is the same for all.
    int16_t next = ~END_EXECUTE;
    if (a.most < settled.below)
        next = settled.next_below;
    else if (a.least >= settled.from)
        next = settled.next_from;
    else if (a.least == a.most && b.least == b.most)
        next = test->next[test->op == OP_eq];
    return (settled_test){.below = UINT64_MAX, .next_below = next};
}

// Found when a batch is first met: then its depths are read anyway. Any, where no kernel looks at them.
static depth_range batch_depths(const bins *bins, const bin_batch *batch, format format)
{
    const uint32_t *codes = bins->codes[format];
    if (!codes)
        return (depth_range){0, UINT32_MAX};
    if (!bins->shared)
        return range_of(codes + batch->offset, count_lanes(batch->lanes));
    return depth_range_of_lanes(codes + batch->offset, batch->lanes);
}

// The number of the end that the tests come to.
static int walk(foresight *f, const tile_plane *planes, depth_range depths)
{
    int at = f->tree->root;
    while (at >= 0) {
        settled_test *settled = &f->tests[at];
        if (!(f->settled >> at & 1)) {
            *settled = settle_test(f, planes, &f->tree->tests[at]);
            f->settled |= 1ull << at;
        }
        if (depths.most < settled->below)
            at = settled->next_below;
        else if (depths.least >= settled->from)
            at = settled->next_from;
        else
            return END_EXECUTE;
    }
    return ~at;
}

void foresight_begin(foresight *f, int kernel)
{
    f->tree = f->plan->foregone ? &f->plan->foregone[kernel] : NULL;
    if (f->tree && f->tree->root == ~END_EXECUTE)
        f->tree = NULL;
    f->settled = 0;
}

bool foresight_passes_over(foresight *f, const tile_plane *planes, const bins *bins, bin_batch *batch, uint64_t lanes)
{
    if (!f->tree)
        return false;
    if (batch->depths.least > batch->depths.most)
        batch->depths = batch_depths(bins, batch, f->plan->depth_format);
    const int end = walk(f, planes, batch->depths);
    if (end == END_EXECUTE)
        return false;
    f->lanes[end] += lanes == UINT64_MAX ? TILE_LANES : count_lanes(lanes);
    f->batches++;
    f->uncounted = true;
    return true;
}

void foresight_count(foresight *f, uint64_t *counts)
{
    if (!f->uncounted)
        return;
    f->uncounted = false;
    for (int e = 0; e < f->tree->end_count; e++) {
        for (int word = 0; f->lanes[e] && word < WORD_MAX / 64; word++)
            for (uint64_t left = f->tree->ends[e].executed[word]; left; left &= left - 1)
                counts[64 * word + __builtin_ctzll(left)] += f->lanes[e];
        f->lanes[e] = 0;
    }
}
