// One stamp in: its kernel is run on its lanes, and what it did to which plane comes out.
#include "arrival.h"
#include "expand.h"

#include <string.h>

// The fragments of a stamp as lanes, of the columns that the kernel looks at; what lies by lanes and a full block are used where they lie.
static void spread(arrival *a, const kernel_use *use, const stamp_chunk *chunk, const stamp_record *record, batch *batch)
{
    uint32_t *next = a->lanes_of_columns;
    const bool there = chunk->by_lanes || record->lanes == UINT64_MAX;
    for (uint32_t formats = use->depth_formats; formats; formats &= formats - 1, next += TILE_LANES) {
        const int f = __builtin_ctz(formats);
        const uint32_t *dense = chunk->codes[f] + record->offset;
        if (!there)
            expand_lanes(next, dense, record->lanes);
        batch->depth[f] = there ? dense : next;
    }
    for (int c = 0; use->color && c < 4; c++, next += TILE_LANES) {
        const float *dense = chunk->rgba[c] + record->offset;
        if (!there)
            expand_lanes(next, dense, record->lanes);
        batch->rgba[c] = there ? dense : (const float *)(const void *)next;
    }
    for (int lane = 0; use->primitive && lane < TILE_LANES; lane++)
        next[lane] = record->primitive;
    batch->primitive = next;
}

// Accesses of one plane by one unit become one, at the place of the first that any lane makes. Whether the plane of the depth test was
// written.
static bool describe_accesses(arrival *a, const kernel_use *use, const dispatch_part *part, bool test, stamp *stamp)
{
    const access_lanes early = {&use->accesses[use->access_count], 0};
    plane_access *groups[PLANE_MAX * ACCESS_UNITS];
    plane_access *next = a->accesses;
    bool writes_depth = false;
    for (int g = 0; g < use->group_count; g++)
        groups[g] = NULL;
    for (int i = 0; i < a->sum.access_count + test; i++) {
        const bool last = i == a->sum.access_count;  // an early test reads depth for what the shader discards later, too
        const access_lanes *done = last ? &early : &a->sum.accesses[i];
        const kernel_access *access = done->access;
        uint64_t lanes = last ? stamp->lanes : part_mask(part, done->lanes);
        if (access->unit == ACCESS_TEXTURE)
            lanes &= stamp->shaded;
        if (!lanes)
            continue;
        if (!groups[access->group]) {
            *next = (plane_access){a->plane_at[access->plane], access->unit, 0, 0};
            groups[access->group] = next++;
        }
        *(access->write ? &groups[access->group]->written : &groups[access->group]->read) |= lanes;
        writes_depth |= access->write && access->plane == use->depth_plane;
    }
    stamp->access_count = (int)(next - a->accesses);
    return writes_depth;
}

static uint32_t count_slots(const arrival *a, const dispatch_part *part, uint32_t all)
{
    int32_t slots = 0;
    for (int i = 0; i < a->sum.slot_count; i++) {
        const uint64_t lanes = part_mask(part, a->sum.slots[i].lanes);
        const uint32_t quads = lanes == part->lanes ? all : quads_of(a, lanes);
        slots += (int32_t)quads * a->sum.slots[i].slots;
    }
    return (uint32_t)slots;
}

bool stamp_describe(arrival *a, const kernel_use *use, const dispatch_part *part, stamp *stamp)
{
    const uint64_t lanes = stamp->lanes;
    stamp->shaded = part_mask(part, a->sum.tested);
    stamp->alive = use->alive_at < 0 ? lanes : part_mask(part, a->log[use->alive_at].outcome);
    stamp->passed = use->passed_at < 0 ? stamp->alive : part_mask(part, a->log[use->passed_at].outcome);
    if (a->options.early && use->early && !use->early_directly)
        stamp->shaded = stamp->passed;
    stamp->alive &= stamp->shaded;
    stamp->quads_shaded = stamp->shaded == lanes ? stamp->quads : quads_of(a, stamp->shaded);
    stamp->quads_passed = stamp->passed == stamp->shaded ? stamp->quads_shaded : quads_of(a, stamp->passed);
    stamp->texture_reads = stamp->quads_shaded * (uint32_t)use->texture_planes;
    stamp->kernel_slots = use->free_kernel ? count_slots(a, part, stamp->quads) : 0;
    return describe_accesses(a, use, part, tests_directly(a, use), stamp);
}

// A stamp whose lanes all did the same; whether they wrote the plane of the depth test.
static bool describe_alike(arrival *a, const lane_deeds *deeds, stamp *stamp)
{
    const struct stamp *one = &deeds->stamp;
    const uint64_t lanes = stamp->lanes;
    stamp->shaded = one->shaded & lanes;
    stamp->alive = one->alive & lanes;
    stamp->passed = one->passed & lanes;
    stamp->quads_shaded = one->quads_shaded * stamp->quads;
    stamp->quads_passed = one->quads_passed * stamp->quads;
    stamp->texture_reads = one->texture_reads * stamp->quads;
    stamp->kernel_slots = one->kernel_slots * stamp->quads;
    stamp->access_count = one->access_count;
    for (int i = 0; i < one->access_count; i++) {
        const plane_access *access = &deeds->accesses[i];
        a->accesses[i] = (plane_access){access->plane, access->unit, access->read & lanes, access->written & lanes};
    }
    return deeds->writes_depth;
}

static void describe(arrival *a, const kernel_use *use, const dispatch_part *part, stamp *stamp)
{
    if (part->alike ? describe_alike(a, part->alike, stamp) : stamp_describe(a, use, part, stamp))
        a->ranges[stamp->tile].pass = 0;  // it may be another now
}

depth_range block_depths(arrival *a, const kernel_use *use, uint32_t tile)
{
    block_range *block = &a->ranges[tile];
    if (block->pass != a->passes_begun)
        *block = (block_range){a->passes_begun, depth_range_of(arrival_plane(a, a->plane_at[use->depth_plane], tile), TILE_LANES)};
    return block->range;
}

bool stamp_discarded(arrival *a, const kernel_use *use, const stamp_chunk *chunk, const stamp_record *record)
{
    if (!a->options.hierarchical || !use->hierarchical)
        return false;
    const format format = use->depth_plane >= 0 ? bound_plane_format(a->bound, use->depth_plane) : a->machine->depth_format;
    const depth_range known = {record->nearest, record->farthest};
    const depth_range range = format == a->machine->depth_format ? known : stamp_depths(chunk, record, format);
    return depth_range_fails(use->depth_function, range, block_depths(a, use, record->tile));
}

static void start(arrival *a, const stamp_record *record, uint32_t tile, uint64_t lanes, stamp *stamp)
{
    stamp->tile = tile;
    stamp->lanes = stamp->shaded = lanes;
    stamp->draw = record ? record->draw : UINT32_MAX;
    stamp->accesses = a->accesses;
    stamp->quads = record ? record->quads : quads_of(a, lanes);
    // One by one: clearing it whole would cost more than the rest.
    stamp->begins_primitive = record && record->begins_primitive;
    stamp->hierarchical = false;
    stamp->alive = stamp->passed = 0;
    stamp->kernel_slots = stamp->quads_shaded = stamp->quads_passed = stamp->texture_reads = stamp->list_bytes = 0;
    stamp->access_count = 0;
}

void stamp_execute(arrival *a, int kernel, const stamp_chunk *chunk, const stamp_record *record, stamp *stamp)
{
    const kernel_use *use = &a->uses[kernel];
    const bool packed = pack_has(a, kernel, chunk, record);
    if (stamp_discarded(a, use, chunk, record)) {
        start(a, record, record->tile, record->lanes, stamp);
        stamp->hierarchical = true;
        stamp->shaded = 0;
        if (packed)
            pack_pass_over(a, record);
    } else if (packed || pack_begin(a, kernel, chunk, record)) {
        const dispatch_part part = pack_take(a, use, record);
        start(a, record, record->tile, record->lanes, stamp);
        describe(a, use, &part, stamp);
    } else {
        block_execute(a, kernel, chunk, record, record->tile, record->lanes, stamp);
    }
}

void lanes_execute(arrival *a, int kernel, const stamp_record *record, uint32_t tile, const batch *batch, stamp *stamp)
{
    const kernel_use *use = &a->uses[kernel];
    const dispatch_part part = {.lanes = batch->lanes};
    tile_plane planes[PLANE_MAX];
    start(a, record, tile, batch->lanes, stamp);
    arrival_planes(a, tile, planes);
    dispatch_run(a, kernel, planes, batch);
    dispatch_sum_up(a, kernel, planes, batch);
    describe(a, use, &part, stamp);
}

void block_execute(arrival *a, int kernel, const stamp_chunk *chunk, const stamp_record *record, uint32_t tile, uint64_t lanes, stamp *stamp)
{
    batch batch = {.lanes = lanes, .log = a->log};
    if (record)
        spread(a, &a->uses[kernel], chunk, record, &batch);
    lanes_execute(a, kernel, record, tile, &batch, stamp);
}

void stamp_cut(arrival *a, uint64_t lanes, stamp *stamp)
{
    stamp->lanes &= lanes;
    stamp->shaded &= lanes;
    stamp->alive &= lanes;
    stamp->passed &= lanes;
    const uint32_t all = stamp->quads;
    stamp->quads = quads_of(a, stamp->lanes);
    stamp->quads_shaded = quads_of(a, stamp->shaded);
    stamp->quads_passed = quads_of(a, stamp->passed);
    // All lanes of an empty block do the same.
    stamp->kernel_slots = all ? stamp->kernel_slots / all * stamp->quads : 0;
    stamp->texture_reads = all ? stamp->texture_reads / all * stamp->quads_shaded : 0;
    for (int i = 0; i < stamp->access_count; i++) {
        a->accesses[i].read &= lanes;
        a->accesses[i].written &= lanes;
    }
}
