// Stamps in; the lines that they touch in each cache, and what that moves, out.
//
// A stamp is looked up in the texture, the depth and the colour caches of its block's partition, in this order; every cache
// meets stamps in order of arrival. A lane that is read must be there: the whole line is fetched. Lanes that are only written
// need no fetch where memory holds the line uncompressed, or where the stamp covers all of it.
#include "memory.h"

#include <stdlib.h>
#include <string.h>

// ---- Making --------------------------------------------------------------------------------------------

static status make_caches(memory *m)
{
    const machine *k = m->machine;
    const int64_t bytes[ACCESS_UNITS] = {k->texture_cache_bytes, k->depth_cache_bytes, k->color_cache_bytes};
    const int64_t ways[ACCESS_UNITS] = {k->texture_cache_ways, k->depth_cache_ways, k->color_cache_ways};
    bool good = true;
    for (int u = 0; good && u < ACCESS_UNITS; u++) {
        m->caches[u] = calloc((size_t)k->partitions, sizeof *m->caches[u]);
        good = m->caches[u];
        for (int64_t p = 0; good && p < k->partitions; p++)
            good = cache_make(&m->caches[u][p], (uint64_t)bytes[u], (uint64_t)k->line_bytes, (uint64_t)ways[u]);
    }
    if (good && k->l2_bytes) {
        m->l2 = calloc((size_t)k->partitions, sizeof *m->l2);
        good = m->l2;
        for (int64_t p = 0; good && p < k->partitions; p++)
            good = cache_make(&m->l2[p], (uint64_t)(k->l2_bytes / k->partitions), (uint64_t)k->line_bytes, (uint64_t)k->l2_ways);
    }
    return good ? STATUS_OK : report_error(m->report, STATUS_IO, "out of memory: caches");
}

static status make_touches(memory *m)
{
    size_t lines = (size_t)m->chip_lines * m->region_blocks;
    for (int i = 0; i < m->frame->plane_count; i++)
        lines += m->planes[i].parts;
    for (int u = 0; u < ACCESS_UNITS; u++) {
        m->touches[u] = calloc(lines + 1, sizeof *m->touches[u]);
        if (!m->touches[u])
            return report_error(m->report, STATUS_IO, "out of memory: %zu lines", lines);
        m->out.touches[u] = m->touches[u];
    }
    return STATUS_OK;
}

status memory_create(const machine *machine, const frame *frame, const report *report, memory **result)
{
    *result = NULL;
    status status = machine_check(machine, report);
    if (status != STATUS_OK)
        return status;
    memory *m = calloc(1, sizeof *m);
    if (!m)
        return report_error(report, STATUS_IO, "out of memory");
    m->machine = machine;
    m->frame = frame;
    m->report = report;
    status = layout_make(m);
    if (status == STATUS_OK)
        status = make_caches(m);
    if (status == STATUS_OK && machine->tile_based)
        status = region_make(m);
    if (status == STATUS_OK)
        status = make_touches(m);
    if (status == STATUS_OK)
        *result = m;
    else
        memory_destroy(m);
    return status;
}

void memory_destroy(memory *m)
{
    if (!m)
        return;
    for (int i = 0; i < PLANE_MAX; i++)
        free(m->planes[i].states);
    for (int64_t p = 0; p < m->machine->partitions; p++) {
        for (int u = 0; u < ACCESS_UNITS; u++)
            if (m->caches[u])
                cache_free(&m->caches[u][p]);
        if (m->l2)
            cache_free(&m->l2[p]);
    }
    for (int u = 0; u < ACCESS_UNITS; u++) {
        free(m->caches[u]);
        free(m->touches[u]);
    }
    region_free(m);
    free(m->l2);
    free(m->partition_of);
    free(m->local_of);
    free(m->blocks);
    free(m->valid);
    free(m->stream_bytes);
    free(m);
}

uint32_t memory_slots(const memory *m, access_unit cache)
{
    const struct cache *c = &m->caches[cache][0];
    return c->sets * c->ways + (cache == ACCESS_TEXTURE ? 0 : m->chip_lines * m->region_blocks);
}

const plane_traffic *memory_planes(const memory *m)
{
    return m->traffic;
}

// ---- Passes --------------------------------------------------------------------------------------------

// Whatever caches hold of a plane is no longer so. Nothing is lost: each pass ends with all changed lines written back;
// what the second level still had to write is overwritten.
static void forget_plane(memory *m, uint8_t plane)
{
    for (int64_t p = 0; p < m->machine->partitions; p++) {
        cache *caches[] = {&m->caches[m->planes[plane].unit][p], m->l2 ? &m->l2[p] : NULL};
        for (int i = 0; i < 2 && caches[i]; i++)
            for (size_t l = 0; l < (size_t)caches[i]->sets * caches[i]->ways; l++)
                if (caches[i]->lines[l].id != CACHE_NONE && line_of(caches[i]->lines[l].id).plane == plane)
                    caches[i]->lines[l] = (cache_line){.id = CACHE_NONE};
    }
}

static void clear_plane(memory *m, uint8_t plane, statistics *s)
{
    const size_t states = (size_t)m->frame->tile_count * m->planes[plane].parts;
    forget_plane(m, plane);
    s->blocks_cleared += states;
    if (m->machine->fast_clear)
        memset(m->planes[plane].states, STATE_CLEARED, states);
    m->flush_clear = !m->machine->fast_clear;
    m->clear_plane = plane;
    m->clear_tile = m->clear_part = 0;
}

void memory_begin_pass(memory *m, const pass_info *pass, statistics *s)
{
    const uint64_t line = (uint64_t)m->machine->line_bytes;
    const uint64_t reads = geometry_reads(m->machine, pass) * line, writes = geometry_writes(m->machine, pass) * line;
    m->pass = *pass;
    m->flush_partition = m->flush_cache = m->flush_line = 0;
    for (int64_t p = 0; p < m->machine->partitions; p++)
        cache_forget(&m->caches[ACCESS_TEXTURE][p]);  // which does not see what the ROP wrote
    s->triangles += pass->triangles;
    s->vertices += pass->vertices;
    s->geometry_bytes += reads + writes;
    s->memory_bytes_read += reads;
    s->memory_bytes_written += writes;
    m->geometry_read += reads;
    m->geometry_written += writes;
    if (pass->kind == PASS_CLEAR)
        clear_plane(m, pass->plane, s);
}

// ---- Stamps --------------------------------------------------------------------------------------------

static void count_lookup(access_unit unit, bool miss, statistics *s)
{
    switch (unit) {
    case ACCESS_TEXTURE: s->texture_lookups++; s->texture_misses += miss; break;
    case ACCESS_DEPTH: s->depth_lookups++; s->depth_misses += miss; break;
    default: s->color_lookups++; s->color_misses += miss; break;
    }
}

static void count_writeback(access_unit unit, statistics *s)
{
    if (unit == ACCESS_DEPTH)
        s->depth_writebacks++;
    else
        s->color_writebacks++;
}

// The line, with room made for it if it is not there.
static cache_line *find_or_replace(memory *m, cache *cache, access_unit unit, line_place at, statistics *s, line_touch *touch)
{
    const uint32_t set = line_set(m, cache, at);
    cache_line *line = cache_find(cache, set, line_id(at));
    if (!line) {
        line = cache_victim(cache, set);
        if (line->id != CACHE_NONE && line->dirty) {
            write_line(m, line_of(line->id), line->valid, line->dirty, s, &touch->spill);
            count_writeback(unit, s);
        }
        touch->replaces = line->id != CACHE_NONE;
        touch->miss = true;
        *line = (cache_line){.id = line_id(at)};
    }
    cache_use(cache, line);
    touch->slot = cache_slot(cache, line);
    return line;
}

// Nothing moves yet. The rest of a transfer of no bytes is not looked at, and clearing it would cost more than the lookup.
static void touch_start(line_touch *touch)
{
    touch->miss = touch->replaces = false;
    touch->fill.bytes = touch->fill.evicted_bytes = touch->spill.bytes = touch->spill.evicted_bytes = 0;
}

static void touch_line(memory *m, access_unit unit, line_place at, uint64_t read, uint64_t written, statistics *s, line_touch *touch)
{
    cache *cache = &m->caches[unit][m->partition_of[at.tile]];
    touch_start(touch);
    cache_line *line = find_or_replace(m, cache, unit, at, s, touch);
    const uint64_t all = part_lanes(&m->planes[at.plane], at.part) & m->valid[at.tile];
    const bool lacks = (read & ~line->valid) || (line->valid != all && write_needs_fill(m, at, written | line->valid));
    if (lacks) {
        touch->miss = true;
        fetch_line(m, at, s, &touch->fill);
        line->valid = all;
    } else if (touch->miss) {
        s->fills_none++;
    }
    s->lines_dirtied += written && !line->dirty;
    line->valid |= written;
    line->dirty |= written;
    count_lookup(unit, touch->miss, s);
}

static void touch_plane(memory *m, const stamp *stamp, const plane_access *access, statistics *s)
{
    const plane_layout *plane = &m->planes[access->plane];
    const uint32_t partition = m->out.partition;
    for (uint32_t part = 0; part < plane->parts; part++) {
        const uint64_t lanes = part_lanes(plane, part), read = access->read & lanes, written = access->written & lanes;
        const line_place at = {access->plane, stamp->tile, part};
        if (!read && !written)
            continue;
        line_touch *touch = &m->touches[access->unit][m->out.counts[access->unit]++];
        if (plane->on_chip && access->unit != ACCESS_TEXTURE)
            region_touch(m, partition, at, read, written, s, touch);
        else
            touch_line(m, access->unit, at, read, written, s, touch);
    }
}

static void count_fragments(const memory *m, const stamp *stamp, statistics *s)
{
    const uint64_t covered = count_lanes(stamp->lanes), shaded = count_lanes(stamp->shaded);
    const uint64_t alive = count_lanes(stamp->alive), passed = count_lanes(stamp->passed);
    s->stamps++;
    s->fragments += covered;
    s->quads += stamp->quads;
    s->stamps_hierarchical += stamp->hierarchical;
    if (stamp->hierarchical)
        s->fragments_hierarchical += covered;
    else
        s->fragments_early += covered - shaded;
    s->fragments_discarded += shaded - alive;
    s->fragments_failed += alive - passed;
    s->fragments_passed += passed;
    s->quads_shaded += m->pass.shader_operations ? stamp->quads_shaded : 0;
    s->shader_operations += 4ull * m->pass.shader_operations * stamp->quads_shaded;
    s->texture_samples += 4ull * m->frame->samples * stamp->texture_reads;
    s->kernel_slots += stamp->kernel_slots;
}

// Lists of fragments are written and read in a stream of their own.
static void stream(memory *m, const stamp *stamp, statistics *s)
{
    const uint32_t bytes = round_to_bursts(m, stamp->list_bytes), partition = m->out.partition;
    const bool write = m->pass.kind == PASS_DRAW;
    m->out.stream_read = write ? 0 : bytes;
    m->out.stream_written = write ? bytes : 0;
    if (!bytes)
        return;
    m->out.stream_address = m->stream_base + m->stream_bytes[partition];
    m->stream_bytes[partition] += bytes;
    s->list_bytes += bytes;
    s->memory_bytes_read += m->out.stream_read;
    s->memory_bytes_written += m->out.stream_written;
    m->stream_read += m->out.stream_read;
    m->stream_written += m->out.stream_written;
}

const stamp_lines *memory_stamp(memory *m, const stamp *stamp, statistics *s)
{
    m->out.partition = m->partition_of[stamp->tile];
    memset(m->out.counts, 0, sizeof m->out.counts);
    count_fragments(m, stamp, s);
    if (m->regions && !stamp->hierarchical)  // a discarded stamp gets no further than the rasterizer
        region_enter(m, stamp->tile, s, &m->out.counts[ACCESS_DEPTH]);
    for (int i = 0; i < stamp->access_count; i++)
        touch_plane(m, stamp, &stamp->accesses[i], s);
    stream(m, stamp, s);
    return &m->out;
}

// Sampling: caches see what was executed, several stamps of a block as one, and nobody counts it.
void memory_skip(memory *m, const stamp *stamp)
{
    statistics ignored = {0};
    m->out.partition = m->partition_of[stamp->tile];
    memset(m->out.counts, 0, sizeof m->out.counts);
    if (m->regions)
        region_enter(m, stamp->tile, &ignored, &m->out.counts[ACCESS_DEPTH]);
    for (int i = 0; i < stamp->access_count; i++)
        touch_plane(m, stamp, &stamp->accesses[i], &ignored);
}
