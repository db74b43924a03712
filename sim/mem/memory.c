// A machine and a frame in, then passes and their stamps; what each counts, and the lines that it touches, out.
#include "memory.h"

#include <stdlib.h>
#include <string.h>

// ---- Making --------------------------------------------------------------------------------------------

static status make_caches(memory *m)
{
    const machine *k = m->machine;
    const int64_t bytes[ACCESS_UNITS] = {k->texture_cache_bytes, k->depth_cache_bytes, k->color_cache_bytes};
    const int64_t ways[ACCESS_UNITS] = {k->texture_cache_ways, k->depth_cache_ways, k->color_cache_ways};
    m->caches = calloc((size_t)k->partitions, sizeof *m->caches);
    bool good = m->caches;
    for (int64_t p = 0; good && p < k->partitions; p++)
        for (int u = 0; good && u < ACCESS_UNITS; u++)
            good = cache_make(&m->caches[p][u], (uint64_t)bytes[u], (uint64_t)k->line_bytes, (uint64_t)ways[u]);
    if (good && k->l2_bytes) {
        m->l2 = calloc((size_t)k->partitions, sizeof *m->l2);
        good = m->l2;
        for (int64_t p = 0; good && p < k->partitions; p++)
            good = cache_make(&m->l2[p], (uint64_t)(k->l2_bytes / k->partitions), (uint64_t)k->line_bytes, (uint64_t)k->l2_ways);
    }
    return good ? STATUS_OK : report_error(m->report, STATUS_IO, "out of memory: caches");
}

static status make_slots(memory *m)
{
    const size_t lines = (size_t)m->frame->tile_count * m->block_lines + 1;
    m->slots[ACCESS_TEXTURE] = calloc(lines, sizeof *m->slots[ACCESS_TEXTURE]);
    m->slots[ACCESS_DEPTH] = m->slots[ACCESS_COLOR] = calloc(lines, sizeof *m->slots[ACCESS_DEPTH]);
    m->l2_slots = m->l2 ? calloc(lines, sizeof *m->l2_slots) : NULL;
    const bool good = m->slots[ACCESS_TEXTURE] && m->slots[ACCESS_DEPTH] && (m->l2_slots || !m->l2);
    return good ? STATUS_OK : report_error(m->report, STATUS_IO, "out of memory: places of %zu lines", lines);
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
    if (status == STATUS_OK)
        status = make_slots(m);
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
        for (int u = 0; m->caches && u < ACCESS_UNITS; u++)
            cache_free(&m->caches[p][u]);
        if (m->l2)
            cache_free(&m->l2[p]);
    }
    for (int u = 0; u < ACCESS_UNITS; u++)
        free(m->touches[u]);
    region_free(m);
    free(m->caches);
    free(m->l2);
    free(m->slots[ACCESS_TEXTURE]);
    free(m->slots[ACCESS_DEPTH]);  // which is colour's, too
    free(m->l2_slots);
    free(m->homes);
    free(m->blocks);
    free(m->stream_bytes);
    free(m);
}

uint32_t memory_slots(const memory *m, access_unit cache)
{
    const struct cache *c = &m->caches[0][cache];
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
        cache *caches[] = {&m->caches[p][m->planes[plane].unit], m->l2 ? &m->l2[p] : NULL};
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
    m->oldest_of_pass = m->latest + 1;
    m->flush_partition = m->flush_cache = m->flush_line = 0;
    for (int64_t p = 0; p < m->machine->partitions; p++)
        cache_forget(&m->caches[p][ACCESS_TEXTURE]);  // which does not see what the ROP wrote
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

// How many lanes a part of others has. All or none as a rule: those cost no count of their own.
static inline uint64_t count_within(uint64_t lanes, uint64_t others, uint64_t others_count)
{
    return lanes == others ? others_count : lanes ? count_lanes(lanes) : 0;
}

static void count_fragments(const memory *m, const stamp *stamp, statistics *s)
{
    const uint64_t covered = count_lanes(stamp->lanes), shaded = count_within(stamp->shaded, stamp->lanes, covered);
    const uint64_t alive = count_within(stamp->alive, stamp->shaded, shaded), passed = count_within(stamp->passed, stamp->alive, alive);
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
    count_fragments(m, stamp, s);
    touch_planes(m, stamp, s);
    m->out.stream_read = m->out.stream_written = 0;
    if (stamp->list_bytes)
        stream(m, stamp, s);
    return &m->out;
}

void memory_ahead(const memory *m, uint32_t tile)
{
    const size_t line = (size_t)tile * m->block_lines;
    __builtin_prefetch(&m->homes[tile]);
    const uint32_t *slots = m->slots[ACCESS_DEPTH] + line;  // which are colour's, too
    __builtin_prefetch(slots);
    __builtin_prefetch(slots + m->block_lines);  // as they need not lie in one line
    if (m->out.counts[ACCESS_TEXTURE])  // the stamp before read textures, and most stamps of a pass are alike
        __builtin_prefetch(&m->slots[ACCESS_TEXTURE][line]);
}
