// The end of a pass: changed lines go back one after another, and what went in is held against what came out.
#include "memory.h"

#include <inttypes.h>

// A clear that writes: every line of the plane, partition after partition as blocks come.
static bool next_cleared(memory *m, uint32_t *partition, access_unit *cache, transfer *spill, statistics *s)
{
    const plane_layout *plane = &m->planes[m->clear_plane];
    line_place at;
    uint64_t lanes = 0;
    while (!lanes) {  // parts outside the image take no bytes
        if (m->clear_tile == m->frame->tile_count)
            return m->flush_clear = false;
        at = (line_place){m->clear_plane, m->clear_tile, m->clear_part};
        lanes = part_lanes(plane, at.part) & m->homes[at.tile].lanes;
        if (++m->clear_part == plane->parts) {
            m->clear_part = 0;
            m->clear_tile++;
        }
    }
    *partition = m->homes[at.tile].partition;
    *cache = plane->unit;
    write_line(m, at, lanes, lanes, s, spill);
    return true;
}

static bool next_line(memory *m, uint32_t *partition, access_unit *unit, transfer *spill, statistics *s)
{
    for (; m->flush_partition < m->machine->partitions; m->flush_partition++, m->flush_cache = 0) {
        for (; m->flush_cache < ACCESS_UNITS; m->flush_cache++, m->flush_line = 0) {
            cache *cache = &m->caches[m->flush_partition][m->flush_cache];
            *partition = m->flush_partition;
            *unit = (access_unit)m->flush_cache;
            while (m->flush_line < cache->sets * cache->ways) {
                cache_line *line = &cache->lines[m->flush_line++];
                if (line->id == CACHE_NONE || !line->dirty)
                    continue;
                write_line(m, line_of(line->id), line->valid, line->dirty, s, spill);
                line->dirty = 0;
                s->depth_writebacks += *unit == ACCESS_DEPTH;
                s->color_writebacks += *unit == ACCESS_COLOR;
                return true;
            }
            if (m->flush_cache == ACCESS_DEPTH && region_flush(m, m->flush_partition, s, spill))
                return true;
        }
    }
    return false;
}

static bool next_of_l2(memory *m, uint32_t *partition, access_unit *unit, transfer *moved, statistics *s)
{
    for (; m->l2 && m->l2_partition < m->machine->partitions; m->l2_partition++, m->l2_line = 0) {
        cache *l2 = &m->l2[m->l2_partition];
        while (m->l2_line < l2->sets * l2->ways) {
            cache_line *line = &l2->lines[m->l2_line++];
            if (line->id == CACHE_NONE || !line->dirty)
                continue;
            const line_place at = line_of(line->id);
            line->dirty = 0;
            *partition = m->l2_partition;
            *unit = m->planes[at.plane].unit;
            *moved = l2_write_back(m, at, s);
            return true;
        }
    }
    return false;
}

bool memory_flush(memory *m, bool last, uint32_t *partition, access_unit *cache, transfer *spill, statistics *s)
{
    if (m->flush_clear && next_cleared(m, partition, cache, spill, s))
        return true;
    if (next_line(m, partition, cache, spill, s))
        return true;
    return last && next_of_l2(m, partition, cache, spill, s);
}

static status differ(const report *report, const char *what, uint64_t in, uint64_t out)
{
    return report_error(report, STATUS_REFUSED, "internal error: conservation: %s: %" PRIu64 " in, %" PRIu64 " out", what, in, out);
}

status memory_check(const memory *m, const statistics *s, const report *report)
{
    const uint64_t verdicts = s->fragments_hierarchical + s->fragments_early + s->fragments_discarded + s->fragments_failed + s->fragments_passed;
    const uint64_t writebacks = s->depth_writebacks + s->color_writebacks;
    uint64_t read = 0, written = 0;
    for (int i = 0; i < m->frame->plane_count; i++) {
        read += m->traffic[i].read;
        written += m->traffic[i].written;
    }
    if (verdicts != s->fragments)
        return differ(report, "fragments and their verdicts", s->fragments, verdicts);
    if (writebacks != s->lines_dirtied)
        return differ(report, "lines changed and written back", s->lines_dirtied, writebacks);
    if (m->geometry_read + m->geometry_written != s->geometry_bytes)
        return differ(report, "bytes of geometry", s->geometry_bytes, m->geometry_read + m->geometry_written);
    if (m->stream_read + m->stream_written != s->list_bytes)
        return differ(report, "bytes of lists", s->list_bytes, m->stream_read + m->stream_written);
    if (read + m->stream_read + m->geometry_read != s->memory_bytes_read)
        return differ(report, "bytes read from memory, by plane", s->memory_bytes_read, read + m->stream_read + m->geometry_read);
    if (written + m->stream_written + m->geometry_written != s->memory_bytes_written)
        return differ(report, "bytes written to memory, by plane", s->memory_bytes_written, written + m->stream_written + m->geometry_written);
    if (!m->l2 && s->rop_bytes_read + m->stream_read + m->geometry_read != s->memory_bytes_read)
        return differ(report, "bytes into caches and out of memory", s->rop_bytes_read, s->memory_bytes_read);
    if (!m->l2 && s->rop_bytes_written + m->stream_written + m->geometry_written != s->memory_bytes_written)
        return differ(report, "bytes out of caches and into memory", s->rop_bytes_written, s->memory_bytes_written);
    return STATUS_OK;
}

void memory_occupancy(const memory *m, access_unit unit, uint32_t *least, uint32_t *most, uint32_t *sets)
{
    *least = UINT32_MAX;
    *most = 0;
    *sets = m->caches[0][unit].sets;
    for (int64_t p = 0; p < m->machine->partitions; p++) {
        const cache *cache = &m->caches[p][unit];
        for (uint32_t set = 0; set < cache->sets; set++) {
            uint32_t count = 0;
            for (uint32_t way = 0; way < cache->ways; way++)
                count += cache->lines[(size_t)set * cache->ways + way].id != CACHE_NONE;
            *least = count < *least ? count : *least;
            *most = count > *most ? count : *most;
        }
    }
}
