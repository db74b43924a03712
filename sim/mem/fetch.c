// A line that is wanted or goes back in; how many bytes move, and what the second level has to do with it, out.
//
// The state of a line's part in memory says how many quarters it takes, or that it was cleared and takes none. On the way
// back it is compressed by what it holds now; a line of which only some lanes were written and the rest never fetched goes
// back as those bursts, uncompressed.
#include "compress.h"
#include "memory.h"

static uint8_t by_content(const memory *m, line_place at)
{
    const plane_layout *plane = &m->planes[at.plane];
    if (!plane->compressed)
        return STATE_WHOLE;
    return (uint8_t)compress_quarters(m->frame->plane_formats[at.plane], m->frame->plane_bits[at.plane],
                                      m->frame->contents(m->frame->user, at.plane, at.tile),
                                      (int)(at.part << plane->part_shift), 1 << plane->part_shift);
}

static uint8_t known_state(const memory *m, line_place at)
{
    uint8_t *state = state_of(m, at);
    if (*state == STATE_UNKNOWN)
        *state = by_content(m, at);
    return *state;
}

// ---- The second level ----------------------------------------------------------------------------------

transfer l2_write_back(memory *m, line_place at, statistics *s)
{
    const transfer moved = {.on_chip = true, .evicted_bytes = m->planes[at.plane].state_bytes[known_state(m, at)], .evicted_address = line_address(m, at)};
    s->l2_writebacks++;
    s->memory_bytes_written += moved.evicted_bytes;
    m->traffic[at.plane].written += moved.evicted_bytes;
    return moved;
}

// Makes room for the line; what was changed goes to memory.
static cache_line *l2_replace(memory *m, cache *l2, line_place at, statistics *s, transfer *moved)
{
    cache_line *line = cache_victim(l2, line_set(m, l2, at));
    if (line->id != CACHE_NONE && line->dirty) {
        const transfer evicted = l2_write_back(m, line_of(line->id), s);
        moved->evicted_bytes = evicted.evicted_bytes;
        moved->evicted_address = evicted.evicted_address;
    }
    m->l2_slots[line_number(m, at)] = cache_put(l2, line, line_id(at));
    s->l2_misses++;
    return line;
}

static cache_line *l2_line(memory *m, line_place at, statistics *s, transfer *moved, bool *hit)
{
    cache *l2 = &m->l2[m->homes[at.tile].partition];
    cache_line *line = cache_find(l2, m->l2_slots[line_number(m, at)], line_id(at));
    s->l2_lookups++;
    *hit = line;
    if (!line)
        line = l2_replace(m, l2, at, s, moved);
    cache_use(l2, line);
    return line;
}

// ---- To and from the caches ----------------------------------------------------------------------------

static void fetch_line(memory *m, line_place at, uint8_t state, statistics *s, transfer *fill)
{
    bool hit = false;
    if (state == STATE_CLEARED) {
        s->fills_cleared++;
        return;
    }
    *fill = (transfer){.address = line_address(m, at), .bytes = m->planes[at.plane].state_bytes[state], .compressed = state < STATE_WHOLE};
    s->rop_bytes_read += fill->bytes;
    if (m->l2)
        l2_line(m, at, s, fill, &hit);
    fill->on_chip = hit;
    if (!hit) {
        s->memory_bytes_read += fill->bytes;
        m->traffic[at.plane].read += fill->bytes;
    }
}

uint64_t complete_line(memory *m, line_place at, uint64_t all, uint64_t valid, uint64_t read, uint64_t written, statistics *s, line_touch *touch)
{
    const uint8_t state = known_state(m, at);
    // What memory holds compressed or cleared cannot be written in part.
    const bool lacks = (read & ~valid) || (state != STATE_WHOLE && (all & ~(valid | written)));
    if (!lacks) {
        s->fills_none += touch->miss;
        return valid;
    }
    touch->miss = true;
    fetch_line(m, at, state, s, &touch->fill);
    return all;
}

// Bytes of the bursts that hold these lanes, and where the first of them starts.
static uint32_t burst_bytes(const memory *m, line_place at, uint64_t lanes, uint64_t *offset)
{
    const plane_layout *plane = &m->planes[at.plane];
    const uint32_t burst = (uint32_t)m->machine->memory_burst_bytes, first_lane = at.part << plane->part_shift, part_lane_count = 1u << plane->part_shift;
    uint32_t bytes = 0, last = UINT32_MAX;
    for (uint64_t left = lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctzll(left) - first_lane;
        const uint32_t start = (lane * plane->part_bytes >> plane->part_shift) / burst;
        const uint32_t end = ((lane + 1) * plane->part_bytes + part_lane_count - 1) >> plane->part_shift;
        for (uint32_t b = start; b * burst < end; b++) {
            if (last == UINT32_MAX)
                *offset = (uint64_t)b * burst;
            if (last == UINT32_MAX || b > last) {
                bytes += burst;
                last = b;
            }
        }
    }
    return bytes;
}

void write_line(memory *m, line_place at, uint64_t valid, uint64_t dirty, statistics *s, transfer *spill)
{
    uint8_t *state = state_of(m, at);
    const uint64_t lanes = lanes_of(m, at);
    const bool whole = (valid & lanes) == lanes;
    const uint8_t quarters = whole ? by_content(m, at) : STATE_WHOLE;
    *spill = (transfer){.address = line_address(m, at), .compressed = quarters < STATE_WHOLE};
    if (quarters == STATE_WHOLE && *state == STATE_WHOLE) {
        uint64_t offset = 0;
        spill->bytes = burst_bytes(m, at, dirty, &offset);
        spill->address += offset;
    } else {
        spill->bytes = m->planes[at.plane].state_bytes[quarters];
    }
    *state = quarters;
    s->lines_compressed += quarters < STATE_WHOLE;
    s->rop_bytes_written += spill->bytes;
    if (m->l2) {
        bool hit;
        cache_line *line = l2_line(m, at, s, spill, &hit);
        line->dirty = UINT64_MAX;
        spill->on_chip = true;
        return;
    }
    s->memory_bytes_written += spill->bytes;
    m->traffic[at.plane].written += spill->bytes;
}
