// Stamps that nobody looks at. They are passed over, and run block by block when somebody looks at the block: before one of its
// stamps is looked at, when its content is asked for, and at the latest before the pass or the chunk ends.
//
// A kernel touches its own sample only, so a block's stamps need no order but their own, and those that share no sample can run
// together. Nobody can tell that they ran late.
#include "arrival.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCKS_AHEAD = 2 };  // whose planes are asked for before they are needed

status skip_make(arrival *a)
{
    a->cursors = calloc(a->tiling.tile_count, sizeof *a->cursors);
    a->clip_limits = calloc(a->tiling.tile_count, sizeof *a->clip_limits);
    a->skip_counts = calloc((size_t)a->plan.count_total + 1, sizeof *a->skip_counts);
    a->skip_counts_seen = calloc((size_t)a->plan.count_total + 1, sizeof *a->skip_counts_seen);
    return a->cursors && a->clip_limits && a->skip_counts && a->skip_counts_seen ? STATUS_OK : report_error(a->report, STATUS_IO, "out of memory: stamps that are passed over");
}

void skip_free(arrival *a)
{
    free(a->cursors);
    free(a->clip_limits);
    free(a->skip_counts);
    free(a->skip_counts_seen);
}

void skip_forget(arrival *a)
{
    if (a->clip_limits)
        memset(a->clip_limits, 0, a->tiling.tile_count * sizeof *a->clip_limits);
}

void skip_begin(arrival *a, const step *step, const stamp_chunk *chunk)
{
    a->visited = a->options.sampling && step->kind == STEP_DRAW ? chunk : NULL;
    a->visit_step = step;
    a->visit++;
    a->visit_time = a->time;
    a->time += chunk->count;
    a->position = a->warm_first = 0;
    a->warming = a->visited && a->plan_of_phases.phase == PHASE_WARM;
}

block_cursor *skip_cursor(arrival *a, uint32_t tile)
{
    block_cursor *cursor = &a->cursors[tile];
    if (cursor->visit != a->visit)
        *cursor = (block_cursor){a->visit, a->visited->blocks.starts[tile]};
    return cursor;
}

// Planes that the kernel wrote since this was asked last, a bit each storage: its writes count how often they are executed.
static uint32_t written_since(arrival *a, int kernel)
{
    const kernel_use *use = &a->uses[kernel];
    const uint64_t *counts = a->skip_counts + a->plan.count_offset[kernel];
    uint64_t *seen = a->skip_counts_seen + a->plan.count_offset[kernel];
    uint32_t written = 0;
    for (int i = 0; i < use->access_count; i++) {
        const uint16_t at = use->accesses[i].instruction;
        if (use->accesses[i].write && counts[at] != seen[at])
            written |= 1u << a->plane_at[use->accesses[i].plane];
        seen[at] = counts[at];
    }
    return written;
}

static bool known_depths(const arrival *a, int plane)
{
    return bound_plane_format(a->bound, plane) == a->machine->depth_format;
}

// Those of the clips that compare codes as stored with planes that the pass does not write.
static clip_limits find_limits(const arrival *a, uint32_t tile)
{
    const kernel_decl *kernel = &a->program->kernels[a->visit_step->kernel];
    clip_limits limits = {.pass = a->passes_begun};
    if (!kernel->is_pass || kernel->pass.shader >= 0 || a->limits.clip_interpolated)
        return limits;
    for (int i = 0; i < kernel->pass.clip_count; i++) {
        const clip_decl *clip = &kernel->pass.clips[i];
        depth_range least = {UINT32_MAX, UINT32_MAX};
        bool known = true;
        for (int p = 0; p < clip->plane_count; p++) {
            const depth_range range = depth_range_of(arrival_plane(a, a->plane_at[clip->plane[p]], tile), TILE_LANES);
            known = known && known_depths(a, clip->plane[p]) && clip->plane[p] != kernel->pass.depth_plane;
            least.least = range.least < least.least ? range.least : least.least;
            least.most = range.most < least.most ? range.most : least.most;
        }
        if (!known)
            continue;
        limits.functions[limits.count] = bound_compare[clip->function];
        limits.ranges[limits.count++] = least;
    }
    return limits;
}

static const clip_limits *block_limits(arrival *a, uint32_t tile)
{
    clip_limits *limits = &a->clip_limits[tile];
    if (limits->pass != a->passes_begun)
        *limits = find_limits(a, tile);
    return limits;
}

// Whether no fragment of a batch can change anything, whether the machine has hierarchical depth or not.
static bool fails(arrival *a, const kernel_use *use, const clip_limits *limits, const block_batch *batch, uint32_t tile)
{
    const depth_range depths = {batch->nearest, batch->farthest};
    for (int i = 0; i < limits->count; i++)
        if (depth_range_fails(limits->functions[i], depths, limits->ranges[i]))
            return true;
    return use->hierarchical && known_depths(a, use->depth_plane) && depth_range_fails(use->depth_function, depths, block_depths(a, use, tile));
}

void skip_columns(const arrival *a, const block_batch *stamps, batch *batch)
{
    const kernel_use *use = &a->uses[a->visit_step->kernel];
    const block_order *blocks = &a->visited->blocks;
    const size_t first = (size_t)(stamps - blocks->batches) * TILE_LANES;
    for (uint32_t formats = use->depth_formats; formats; formats &= formats - 1)
        batch->depth[__builtin_ctz(formats)] = blocks->codes[__builtin_ctz(formats)] + first;
    for (int c = 0; use->color && c < 4; c++)
        batch->rgba[c] = blocks->rgba[c] + first;
    if (use->primitive)
        batch->primitive = blocks->primitive + first;
}

// Lanes of a batch's stamps from *at on that came before the stamp at hand; *at becomes the first that did not.
static uint64_t lanes_before(const arrival *a, const block_batch *batch, uint32_t *at)
{
    const block_stamp *stamps = a->visited->blocks.stamps;
    uint64_t lanes = 0;
    if (*at == batch->first && batch->last < a->position) {
        *at = batch->end;
        return batch->lanes;
    }
    for (; *at < batch->end && stamps[*at].number < a->position; ++*at)
        lanes |= stamps[*at].lanes;
    return lanes;
}

void skip_catch_up(arrival *a, uint32_t tile)
{
    if (!a->visited)
        return;
    const block_order *blocks = &a->visited->blocks;
    block_cursor *cursor = skip_cursor(a, tile);
    const uint32_t end = blocks->starts[tile + 1];
    const int kernel = a->visit_step->kernel;
    const kernel_use *use = &a->uses[kernel];
    uint32_t at = cursor->next, written = 0;
    uint64_t written_lanes = 0, time = 0;
    if (at == end || blocks->stamps[at].number >= a->position)
        return;
    tile_plane planes[PLANE_MAX];
    arrival_planes(a, tile, planes);
    const clip_limits *limits = block_limits(a, tile);
    batch lanes_run = {0};
    for (const block_batch *batch = &blocks->batches[blocks->stamps[at].batch]; at < end; batch++) {
        lanes_run.lanes = lanes_before(a, batch, &at);
        if (lanes_run.lanes && draws_class(a, a->visit_step, batch->draw) && !fails(a, use, limits, batch, tile)) {
            skip_columns(a, batch, &lanes_run);
            a->execute(a->bound, kernel, planes, &lanes_run, a->skip_counts + a->plan.count_offset[kernel]);
            const uint32_t more = written_since(a, kernel);
            if (more && use->depth_write)
                a->ranges[tile].pass = 0;
            written |= more;
            written_lanes |= more ? lanes_run.lanes : 0;
            time = more ? a->visit_time + (batch->last < a->position ? batch->last : a->position - 1) : time;
        }
        if (at < batch->end)
            break;
    }
    cursor->next = at;
    if (written)
        a->sink->skip(a->sink->user, tile, written, written_lanes, time);
}

status skip_pass_by(arrival *a, uint32_t tile, uint32_t number)
{
    if (!a->visited)
        return STATUS_OK;
    const status status = a->warming ? warm_run(a, number) : STATUS_OK;
    a->position = number;
    skip_catch_up(a, tile);
    skip_cursor(a, tile)->next++;
    return status;
}

void skip_ahead(arrival *a, uint32_t tile)
{
    if (a->visited)
        __builtin_prefetch(&a->visited->blocks.stamps[skip_cursor(a, tile)->next]);
}

// Asks for what running a block's stamps will read first.
static void prefetch(arrival *a, uint32_t tile)
{
    const block_order *blocks = &a->visited->blocks;
    const uint32_t *block = arrival_block(a, tile);
    if (skip_cursor(a, tile)->next == blocks->starts[tile + 1])
        return;
    skip_ahead(a, tile);
    for (int i = 0; i < a->reads.plain_count; i++)
        for (int lane = 0; lane < TILE_LANES; lane += PREFETCH_WORDS)
            __builtin_prefetch(block + a->reads.offsets[i] + lane);
}

status skip_end(arrival *a)
{
    if (!a->visited)
        return STATUS_OK;
    const status status = a->warming ? warm_run(a, a->visited->count) : STATUS_OK;
    a->position = a->visited->count;
    for (uint32_t tile = 0; tile < a->tiling.tile_count; tile++) {
        if (tile + BLOCKS_AHEAD < a->tiling.tile_count)
            prefetch(a, tile + BLOCKS_AHEAD);
        skip_catch_up(a, tile);
    }
    a->visited = NULL;
    return status;
}
