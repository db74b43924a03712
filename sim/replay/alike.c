// Stamps of a pack whose lanes all did the same, and what that was.
//
// Most small stamps are such, and most of them did the same as the one before. So what one lane did is described once, as a stamp of its
// own, and a description of all like it is a few masks.
#include "arrival.h"

static void find_written(const arrival *a, lane_deeds *deeds)
{
    uint32_t known = 0;
    deeds->written_count = 0;
    for (int i = 0; i < a->sum.access_count; i++) {
        const kernel_access *access = a->sum.accesses[i].access;
        if (!access->write || !(a->sum.accesses[i].lanes >> deeds->lane & 1) || (known >> access->plane & 1))
            continue;
        known |= 1u << access->plane;
        deeds->written[deeds->written_count++] = (kernel_plane){access->plane, access->color, false};
    }
}

static void find_deeds(arrival *a, const kernel_use *use, lane_deeds *deeds)
{
    const dispatch_part part = {.lanes = 1, .first = deeds->lane, .count = 1};
    stamp *stamp = &deeds->stamp;
    stamp->lanes = stamp->quads = 1;
    deeds->writes_depth = stamp_describe(a, use, &part, stamp);
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &a->accesses[i];
        deeds->accesses[i] = (plane_access){access->plane, access->unit, -access->read, -access->written};
    }
    stamp->shaded = -stamp->shaded;
    stamp->alive = -stamp->alive;
    stamp->passed = -stamp->passed;
    find_written(a, deeds);
    deeds->known = true;
}

const lane_deeds *lanes_alike(arrival *a, const kernel_use *use, uint32_t first, uint32_t count)
{
    lane_deeds *deeds = &a->deeds;
    const uint64_t changes = a->sum.changes;
    if (changes >> first & UINT64_MAX >> (TILE_LANES - count) >> 1)
        return NULL;
    // Parts are asked for in order of lanes.
    const bool same = deeds->known && !(changes >> deeds->lane & ~(UINT64_MAX << (first - deeds->lane)));
    deeds->lane = first;
    if (!same)
        find_deeds(a, use, deeds);
    return deeds;
}
