// A stamp in; the lines that it touches in each cache, and what that moves, out.
//
// A stamp is looked up in the texture, the depth and the colour caches of its block's partition, in this order; every cache
// meets stamps in order of arrival. A lane that is read must be there: the whole line is fetched. Lanes that are only written
// need no fetch where memory holds the line uncompressed, or where the stamp covers all of it.
//
// Nine of ten lookups find the whole line there, so that nothing that is read is missing. They go straight through touch_line;
// all others are settled aside (settle.c).
#include "memory.h"

#include <assert.h>
#include <string.h>

// One line; `lanes`: those of its part inside the image; `slot`: that of m->slots.
static inline void touch_line(memory *m, const plane_access *access, uint64_t id, uint64_t lanes, cache *cache, uint32_t *slot,
                              statistics *s, line_touch *touch)
{
    cache_line *line = &cache->lines[*slot];
    touch->slot = *slot;
    // Nothing moves yet. Clearing the rest of transfers would cost more than the lookup.
    touch->miss = touch->replaces = false;
    touch->fill.bytes = touch->fill.evicted_bytes = touch->spill.bytes = touch->spill.evicted_bytes = 0;
    if ((line->id ^ id) | (line->valid ^ lanes)) {
        touch->slot = settle_line(m, access, id, lanes, cache, slot, s, touch);
        line = &cache->lines[touch->slot];
    }
    cache_use(cache, line);
    if (access->written) {
        const uint64_t written = access->written & lanes;
        s->lines_dirtied += (written != 0) & (line->dirty == 0);
        line->valid |= written;
        line->dirty |= written;
    }
}

// A plane of several lines a block, or one that stays on the chip; `slots`: of the block's lines. One past the last touch. Few accesses are
// such, and inlined it would take the registers of the others.
static __attribute__((noinline)) line_touch *touch_parts(memory *m, const plane_access *access, uint32_t tile, uint32_t *slots, statistics *s,
                                                         line_touch *touch)
{
    const plane_layout *plane = &m->planes[access->plane];
    const home *home = &m->homes[tile];
    if (plane->on_chip && access->unit != ACCESS_TEXTURE)
        return touch + region_touch(m, tile, access, s, touch);
    cache *cache = &m->caches[home->partition][access->unit];
    const uint64_t id = line_id((line_place){access->plane, tile, 0});
    for (uint64_t left = access->read | access->written, lanes; left; left &= ~lanes) {
        const uint32_t part = first_part(plane, left);
        lanes = part_lanes(plane, part);
        touch_line(m, access, id | part, lanes & home->lanes, cache, slots + part, s, touch++);
    }
    return touch;
}

void touch_planes(memory *m, const stamp *stamp, statistics *s)
{
    const uint32_t tile = stamp->tile;
    const home *home = &m->homes[tile];
    int *counts = m->out.counts;
    memset(counts, 0, sizeof m->out.counts);
    m->out.partition = home->partition;
    if (m->regions && !stamp->hierarchical)  // a discarded stamp gets no further than the rasterizer
        region_enter(m, tile, s, &counts[ACCESS_DEPTH]);
    const int left_region = counts[ACCESS_DEPTH];  // which are no lookups
    line_touch *next[ACCESS_UNITS] = {m->touches[ACCESS_TEXTURE], m->touches[ACCESS_DEPTH] + left_region, m->touches[ACCESS_COLOR]};
    cache *caches = m->caches[home->partition];
    const size_t first_line = (size_t)tile * m->block_lines;
    const uint64_t lanes = home->lanes;
    const plane_access *end = stamp->accesses + stamp->access_count;
    for (const plane_access *access = stamp->accesses; access < end; access++) {
        const plane_layout *plane = &m->planes[access->plane];
        const access_unit unit = access->unit;
        uint32_t *slots = m->slots[unit] + first_line + plane->first_line;
        assert(!((access->read | access->written) & ~lanes));  // else a whole line would not be all that is read
        if (!plane->one_line)
            next[unit] = touch_parts(m, access, tile, slots, s, next[unit]);
        else if (access->read | access->written)
            touch_line(m, access, line_id((line_place){access->plane, tile, 0}), lanes, &caches[unit], slots, s, next[unit]++);
    }
    for (int u = 0; u < ACCESS_UNITS; u++)
        counts[u] = (int)(next[u] - m->touches[u]);
    s->texture_lookups += (uint64_t)counts[ACCESS_TEXTURE];
    s->depth_lookups += (uint64_t)(counts[ACCESS_DEPTH] - left_region);
    s->color_lookups += (uint64_t)counts[ACCESS_COLOR];
}
