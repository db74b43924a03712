// Stamps that nobody looks at. They are passed over, and run block by block when somebody looks at the block: before one of its
// stamps is looked at, when its content is asked for, and at the latest before the pass or the chunk ends.
//
// A kernel touches its own sample only, so a block's stamps need no order but their own, and those that share no sample can run
// together. Nobody can tell that they ran late; nor that what writes nothing did not run at all, which the function level's log tells.
#include "arrival.h"
#include "write_log.h"

#include <stdlib.h>
#include <string.h>

enum { BLOCKS_AHEAD = 2 };  // whose planes are asked for before they are needed

status skip_make(arrival *a)
{
    a->cursors = calloc(a->tiling.tile_count, sizeof *a->cursors);
    a->clip_limits = calloc(a->tiling.tile_count, sizeof *a->clip_limits);
    a->skip_counts = calloc((size_t)a->plan.count_total + 1, sizeof *a->skip_counts);
    a->skip_counts_seen = calloc((size_t)a->plan.count_total + 1, sizeof *a->skip_counts_seen);
    if (bins_can_share(a->stamps) && write_log_is_of(a->function->writes, a->stamps->chunks[0].blocks.batch_count))
        a->writes = a->function->writes;
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

static block_cursor *cursor_of(arrival *a, uint32_t tile)
{
    block_cursor *cursor = &a->cursors[tile];
    if (cursor->visit != a->visit)
        *cursor = (block_cursor){a->visit, a->visited->blocks.starts[tile], 0};
    return cursor;
}

// Whether none of the block's stamps writes in the draw at hand.
static bool idle(const arrival *a, uint32_t tile)
{
    return a->writes && !write_log_row(a->writes, tile, a->draws);
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
    const stamp_chunk *chunk = a->visited;
    for (uint32_t formats = use->depth_formats; formats; formats &= formats - 1)
        batch->depth[__builtin_ctz(formats)] = chunk->codes[__builtin_ctz(formats)] + stamps->offset;
    for (int c = 0; use->color && c < 4; c++)
        batch->rgba[c] = chunk->rgba[c] + stamps->offset;
    if (use->primitive)
        batch->primitive = chunk->primitive + stamps->offset;
}

// The place of the first of the block's stamps, from `first` on, that does not come before the stamp at hand; all from `end` on do not.
static uint32_t end_of_past(const arrival *a, uint32_t first, uint32_t end)
{
    const block_stamp *stamps = a->visited->blocks.stamps;
    if (first < end && stamps[end - 1].number < a->position)
        return end;
    while (first < end) {
        const uint32_t middle = first + (end - first) / 2;
        if (stamps[middle].number < a->position)
            first = middle + 1;
        else
            end = middle;
    }
    return first;
}

// Lanes of the batch's stamps that are among these.
static uint64_t lanes_among(const arrival *a, const block_batch *batch, uint32_t first, uint32_t end)
{
    const block_stamp *stamps = a->visited->blocks.stamps;
    uint64_t lanes = 0;
    if (first <= batch->first && batch->end <= end)
        return batch->lanes;
    const uint32_t last = batch->end < end ? batch->end : end;
    for (uint32_t at = batch->first < first ? first : batch->first; at < last; at++)
        lanes |= stamps[at].lanes;
    return lanes;
}

// What running stamps of a block that nobody looked at did.
typedef struct past_writes { uint32_t planes; uint64_t lanes, time; } past_writes;

static void run_batch(arrival *a, uint32_t tile, const tile_plane *planes, const block_batch *batch, uint64_t lanes, past_writes *writes)
{
    const int kernel = a->visit_step->kernel;
    struct batch run = {.lanes = lanes};
    skip_columns(a, batch, &run);
    a->execute(a->bound, kernel, planes, &run, a->skip_counts + a->plan.count_offset[kernel]);
    const uint32_t written = written_since(a, kernel);
    if (!written)
        return;
    if (a->uses[kernel].depth_write)
        a->ranges[tile].pass = 0;
    writes->planes |= written;
    writes->lanes |= lanes;
    writes->time = a->visit_time + (batch->last < a->position ? batch->last : a->position - 1);
}

// Those batches that may write, by the function level's log or else by ranges of depths.
static void run_batches(arrival *a, uint32_t tile, block_cursor *cursor, uint32_t end, past_writes *writes)
{
    const block_order *blocks = &a->visited->blocks;
    const kernel_use *use = &a->uses[a->visit_step->kernel];
    const uint64_t *row = a->writes ? write_log_row(a->writes, tile, a->draws) : NULL;
    const uint32_t origin = blocks->first_batches[tile], last = blocks->stamps[end - 1].batch - origin, first = cursor->next;
    uint32_t b = row ? write_log_next(row, cursor->batch, last + 1) : cursor->batch;
    cursor->next = end;
    cursor->batch = last;
    if (b > last)
        return;
    tile_plane planes[PLANE_MAX];
    arrival_planes(a, tile, planes);
    for (; b <= last; b = row ? write_log_next(row, b + 1, last + 1) : b + 1) {
        const block_batch *batch = &blocks->batches[origin + b];
        const uint64_t lanes = lanes_among(a, batch, first, end);
        if (lanes && draws_class(a, a->visit_step, batch->draw) && (row || !fails(a, use, block_limits(a, tile), batch, tile)))
            run_batch(a, tile, planes, batch, lanes, writes);
    }
}

void skip_until(arrival *a, uint32_t tile, uint32_t first, uint32_t next)
{
    if (idle(a, tile))
        return;
    block_cursor *cursor = cursor_of(a, tile);
    past_writes writes = {0};
    if (first > cursor->next)
        run_batches(a, tile, cursor, first, &writes);
    cursor->next = next > cursor->next ? next : cursor->next;
    if (writes.planes)
        a->sink->skip(a->sink->user, tile, writes.planes, writes.lanes, writes.time);
}

// What came before the stamp at hand, which none from place `end` on did.
static void catch_up(arrival *a, uint32_t tile, uint32_t end)
{
    if (idle(a, tile))
        return;
    const uint32_t first = end_of_past(a, cursor_of(a, tile)->next, end);
    skip_until(a, tile, first, first);
}

void skip_catch_up(arrival *a, uint32_t tile)
{
    if (a->visited)
        catch_up(a, tile, a->visited->blocks.starts[tile + 1]);
}

void skip_catch_up_before(arrival *a, uint32_t number)
{
    catch_up(a, a->visited->records[number].tile, a->visited->blocks.places[number]);
}

status skip_pass_by(arrival *a, uint32_t number)
{
    if (!a->visited)
        return STATUS_OK;
    const uint32_t place = a->visited->blocks.places[number];
    const status status = a->warming ? warm_run(a, number) : STATUS_OK;
    a->position = number;
    skip_until(a, a->visited->records[number].tile, place, place + 1);
    return status;
}

void skip_ahead(arrival *a, uint32_t number)
{
    if (a->visited && !idle(a, a->visited->records[number].tile))
        __builtin_prefetch(&a->visited->blocks.stamps[a->visited->blocks.places[number]]);
}

// Asks for what running a block's stamps will read first.
static void prefetch(arrival *a, uint32_t tile)
{
    const block_order *blocks = &a->visited->blocks;
    const uint32_t *block = arrival_block(a, tile);
    if (idle(a, tile) || cursor_of(a, tile)->next == blocks->starts[tile + 1])
        return;
    __builtin_prefetch(&blocks->stamps[cursor_of(a, tile)->next]);
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
        const uint32_t end = a->visited->blocks.starts[tile + 1];
        skip_until(a, tile, end, end);
    }
    a->visited = NULL;
    return status;
}
