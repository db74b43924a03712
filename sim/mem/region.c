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
    return m->caches[0][unit].sets * m->caches[0][unit].ways;
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
    const home *home = &m->homes[tile];
    region_memory *r = &m->regions[home->partition];
    line_touch touch = {0};
    if (r->region == home->region)
        return;
    r->region = home->region;
    for (uint32_t slot; next_leaving(m, home->partition, &slot, s, &touch.spill);) {
        touch.slot = slot_base(m, ACCESS_DEPTH) + slot;
        m->touches[ACCESS_DEPTH][(*count)++] = touch;
    }
}

bool region_flush(memory *m, uint32_t partition, statistics *s, transfer *spill)
{
    uint32_t slot;
    return m->regions && next_leaving(m, partition, &slot, s, spill);
}

static void touch_part(memory *m, line_place at, uint64_t read, uint64_t written, statistics *s, line_touch *touch)
{
    const home *home = &m->homes[at.tile];
    const plane_layout *plane = &m->planes[at.plane];
    region_memory *r = &m->regions[home->partition];
    const uint32_t slot = home->region_block * m->chip_lines + plane->chip_slot + at.part;
    chip_line *line = &r->lines[slot];
    *touch = (line_touch){.slot = slot_base(m, plane->unit) + slot, .miss = !line->there};
    if (!line->there) {
        *line = (chip_line){.there = true, .place = at};
        r->used[r->used_count++] = slot;
    }
    line->valid = complete_line(m, at, lanes_of(m, at), line->valid, read, written, s, touch) | written;
    s->lines_dirtied += written && !line->dirty;
    line->dirty |= written;
    s->depth_misses += plane->unit == ACCESS_DEPTH && touch->miss;
    s->color_misses += plane->unit == ACCESS_COLOR && touch->miss;
}

int region_touch(memory *m, uint32_t tile, const plane_access *access, statistics *s, line_touch *touches)
{
    const plane_layout *plane = &m->planes[access->plane];
    int count = 0;
    for (uint64_t left = access->read | access->written, lanes; left; left &= ~lanes) {
        const uint32_t part = first_part(plane, left);
        lanes = part_lanes(plane, part);
        touch_part(m, (line_place){access->plane, tile, part}, access->read & lanes, access->written & lanes, s, &touches[count++]);
    }
    return count;
}
