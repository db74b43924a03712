// Tile-based: the planes of a region that stay on the chip. A line is loaded when it is first wanted in the region, stays,
// and goes back, if it was changed, when its partition enters another region or the pass ends.
#include "memory.h"

#include <stdlib.h>

status region_make(memory *m)
{
    const size_t lines = (size_t)m->chip_lines * m->region_blocks;
    m->regions = calloc((size_t)m->machine->partitions, sizeof *m->regions);
    bool good = m->regions;
    for (int64_t p = 0; good && p < m->machine->partitions; p++) {
        m->regions[p].lines = calloc(lines + 1, sizeof *m->regions[p].lines);
        m->regions[p].used = calloc(lines + 1, sizeof *m->regions[p].used);
        good = m->regions[p].lines && m->regions[p].used;
    }
    return good ? STATUS_OK : report_error(m->report, STATUS_IO, "out of memory: %zu lines on the chip", lines);
}

void region_free(memory *m)
{
    for (int64_t p = 0; m->regions && p < m->machine->partitions; p++) {
        free(m->regions[p].lines);
        free(m->regions[p].used);
    }
    free(m->regions);
    m->regions = NULL;
}

static uint32_t slot_base(const memory *m, access_unit unit)
{
    return m->caches[unit][0].sets * m->caches[unit][0].ways;
}

// The next changed line that leaves the chip; false: there is none, and the region's memory is empty.
static bool next_leaving(memory *m, uint32_t partition, uint32_t *slot, statistics *s, transfer *spill)
{
    region_memory *r = &m->regions[partition];
    while (r->used_count) {
        *slot = r->used[--r->used_count];
        chip_line *line = &r->lines[*slot];
        const bool changed = line->dirty;
        if (changed) {
            write_line(m, line->place, line->valid, line->dirty, s, spill);
            s->depth_writebacks += m->planes[line->place.plane].unit == ACCESS_DEPTH;
            s->color_writebacks += m->planes[line->place.plane].unit == ACCESS_COLOR;
        }
        *line = (chip_line){0};
        if (changed)
            return true;
    }
    return false;
}

void region_enter(memory *m, uint32_t tile, statistics *s, int *count)
{
    const uint32_t partition = m->partition_of[tile], columns = m->frame->columns;
    const uint32_t across = (uint32_t)m->machine->region_pixels / m->frame->tile_width;
    const uint32_t down = (uint32_t)m->machine->region_pixels / m->frame->tile_height;
    const uint32_t region = tile / columns / down * columns + tile % columns / across + 1;
    line_touch touch = {0};
    if (m->regions[partition].region == region)
        return;
    m->regions[partition].region = region;
    for (uint32_t slot; next_leaving(m, partition, &slot, s, &touch.spill);) {
        touch.slot = slot_base(m, ACCESS_DEPTH) + slot;
        m->touches[ACCESS_DEPTH][(*count)++] = touch;
    }
}

bool region_flush(memory *m, uint32_t partition, statistics *s, transfer *spill)
{
    uint32_t slot;
    return m->regions && next_leaving(m, partition, &slot, s, spill);
}

void region_touch(memory *m, uint32_t partition, line_place at, uint64_t read, uint64_t written, statistics *s, line_touch *touch)
{
    region_memory *r = &m->regions[partition];
    const plane_layout *plane = &m->planes[at.plane];
    const uint32_t across = (uint32_t)m->machine->region_pixels / m->frame->tile_width;
    const uint32_t down = (uint32_t)m->machine->region_pixels / m->frame->tile_height;
    const uint32_t x = at.tile % m->frame->columns % across, y = at.tile / m->frame->columns % down;
    const uint32_t slot = (y * across + x) * m->chip_lines + plane->chip_slot + at.part;
    const uint64_t all = part_lanes(plane, at.part) & m->valid[at.tile];
    chip_line *line = &r->lines[slot];
    *touch = (line_touch){.slot = slot_base(m, plane->unit) + slot, .miss = !line->there};
    if (!line->there) {
        *line = (chip_line){.there = true, .place = at};
        r->used[r->used_count++] = slot;
    }
    if ((read & ~line->valid) || (line->valid != all && write_needs_fill(m, at, written | line->valid))) {
        touch->miss = true;
        fetch_line(m, at, s, &touch->fill);
        line->valid = all;
    } else {
        s->fills_none += touch->miss;
    }
    s->lines_dirtied += written && !line->dirty;
    line->valid |= written;
    line->dirty |= written;
    s->depth_lookups += plane->unit == ACCESS_DEPTH;
    s->depth_misses += plane->unit == ACCESS_DEPTH && touch->miss;
    s->color_lookups += plane->unit == ACCESS_COLOR;
    s->color_misses += plane->unit == ACCESS_COLOR && touch->miss;
}
