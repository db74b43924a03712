// Passes and stamps in, hits, misses and bytes out. See tick.h; docs/machine.md, "Traffic".
//
// Every cache is an array that is searched from end to end; the line that was used longest ago is the one with the least
// stamp of time. A line is a plane, a block and a part of it; nothing has an address but in the second level.
#include "tick.h"

#include "../../sim/mem/compress.h"

#include <stdlib.h>
#include <string.h>

typedef struct line_name {
    int plane;
    uint32_t tile, part;
} line_name;

typedef struct line {
    bool valid;
    line_name name;
    uint64_t held, changed, used;  // lanes of the part, from bit 0; time of the last use
    uint32_t bytes;                // second level: of what was written last
} line;

// A set after another, `ways` lines each; a region's store has no limit.
typedef struct cache {
    line *lines;
    uint32_t sets, ways, count;  // count: of a region's store
} cache;

typedef struct block_state {
    bool cleared;
    uint8_t quarters;
} block_state;

struct traffic {
    const machine *machine;
    const frame *frame;
    statistics counts;
    plane_traffic planes[PLANE_MAX];
    uint32_t parts[PLANE_MAX];
    bool on_chip[PLANE_MAX];
    block_state *states[PLANE_MAX];
    uint64_t *inside;                                          // lanes of each block that the image has
    uint32_t *number_in_partition, *partition_of, *region_of;  // of each block
    cache (*caches)[ACCESS_UNITS], *slices, *stores;           // of each partition
    uint32_t *region_at_hand;
    uint64_t time;
    pass_info pass;
};

// ---- Where blocks lie ----------------------------------------------------------------------------------

static void deal_out(traffic *t)
{
    const machine *m = t->machine;
    const frame *f = t->frame;
    uint32_t *given = calloc((size_t)m->partitions, sizeof *given);
    for (uint32_t tile = 0; tile < f->tile_count; tile++) {
        uint32_t x = tile % f->columns, y = tile / f->columns;
        if (m->tile_based) {
            x = x * f->tile_width / (uint32_t)m->region_pixels;
            y = y * f->tile_height / (uint32_t)m->region_pixels;
        }
        const uint32_t p = (x + (uint32_t)m->partition_row_step * y) % (uint32_t)m->partitions;
        t->partition_of[tile] = p;
        t->region_of[tile] = (y << 16) + x;
        t->number_in_partition[tile] = given[p]++;
        for (uint32_t lane = 0; lane < 64; lane++) {
            const uint32_t column = tile % f->columns * f->tile_width + lane / f->samples % f->tile_width;
            const uint32_t row = tile / f->columns * f->tile_height + lane / f->samples / f->tile_width;
            t->inside[tile] |= (uint64_t)(column < f->width && row < f->height) << lane;
        }
    }
    free(given);
}

static void place_planes(traffic *t)
{
    int64_t bits = 0;
    bool fits = t->machine->tile_based;
    for (int i = 0; i < t->frame->plane_count; i++) {
        t->parts[i] = block_lines(t->machine, t->frame->plane_bits[i]);
        bits += t->frame->plane_bits[i];
        fits = fits && bits <= t->machine->on_chip_bits;
        t->on_chip[i] = fits;
        t->states[i] = calloc((size_t)t->frame->tile_count * t->parts[i] + 1, sizeof(block_state));
        for (uint32_t k = 0; k < t->frame->tile_count * t->parts[i]; k++)
            t->states[i][k] = (block_state){false, 4};
    }
}

static cache make_cache(int64_t bytes, int64_t ways, int64_t line_bytes)
{
    cache cache = {.ways = (uint32_t)ways, .sets = (uint32_t)(bytes / line_bytes / ways)};
    cache.lines = calloc((size_t)cache.ways * cache.sets + 1, sizeof *cache.lines);
    return cache;
}

traffic *traffic_create(const machine *m, const frame *frame)
{
    traffic *t = calloc(1, sizeof *t);
    const size_t tiles = (size_t)frame->tile_count + 1, partitions = (size_t)m->partitions;
    t->machine = m;
    t->frame = frame;
    t->number_in_partition = calloc(tiles, sizeof *t->number_in_partition);
    t->partition_of = calloc(tiles, sizeof *t->partition_of);
    t->region_of = calloc(tiles, sizeof *t->region_of);
    t->caches = calloc(partitions, sizeof *t->caches);
    t->slices = calloc(partitions, sizeof *t->slices);
    t->stores = calloc(partitions, sizeof *t->stores);
    t->region_at_hand = calloc(partitions, sizeof *t->region_at_hand);
    t->inside = calloc(tiles, sizeof *t->inside);
    deal_out(t);
    place_planes(t);
    for (size_t p = 0; p < partitions; p++) {
        t->caches[p][ACCESS_TEXTURE] = make_cache(m->texture_cache_bytes, m->texture_cache_ways, m->line_bytes);
        t->caches[p][ACCESS_DEPTH] = make_cache(m->depth_cache_bytes, m->depth_cache_ways, m->line_bytes);
        t->caches[p][ACCESS_COLOR] = make_cache(m->color_cache_bytes, m->color_cache_ways, m->line_bytes);
        t->slices[p] = make_cache(m->l2_bytes / m->partitions, m->l2_ways, m->line_bytes);
    }
    return t;
}

void traffic_destroy(traffic *t)
{
    if (!t)
        return;
    for (int64_t p = 0; p < t->machine->partitions; p++) {
        for (int u = 0; u < ACCESS_UNITS; u++)
            free(t->caches[p][u].lines);
        free(t->slices[p].lines);
        free(t->stores[p].lines);
    }
    for (int i = 0; i < PLANE_MAX; i++)
        free(t->states[i]);
    free(t->inside);
    free(t->number_in_partition);
    free(t->partition_of);
    free(t->region_of);
    free(t->caches);
    free(t->slices);
    free(t->stores);
    free(t->region_at_hand);
    free(t);
}

const statistics *traffic_counts(const traffic *t)
{
    return &t->counts;
}

const plane_traffic *traffic_planes(const traffic *t)
{
    return t->planes;
}

// ---- Bytes ---------------------------------------------------------------------------------------------

static uint32_t lanes_of(const traffic *t, line_name name)
{
    return 64 / t->parts[name.plane];
}

// Lanes inside the image.
static uint64_t all_lanes(const traffic *t, line_name name)
{
    const uint32_t lanes = lanes_of(t, name);
    const uint64_t all = lanes == 64 ? UINT64_MAX : (UINT64_C(1) << lanes) - 1;
    return t->inside[name.tile] >> name.part * lanes & all;
}

static uint32_t in_bursts(const traffic *t, uint32_t bytes)
{
    const uint32_t burst = (uint32_t)t->machine->memory_burst_bytes;
    return (bytes + burst - 1) / burst * burst;
}

static uint32_t line_size(const traffic *t, line_name name)
{
    return lanes_of(t, name) * (uint32_t)t->frame->plane_bits[name.plane] / 8;
}

static block_state *state_of(const traffic *t, line_name name)
{
    return &t->states[name.plane][name.tile * t->parts[name.plane] + name.part];
}

static uint32_t memory_size(const traffic *t, line_name name)
{
    return in_bursts(t, (line_size(t, name) * state_of(t, name)->quarters + 3) / 4);
}

static uint32_t changed_bursts(const traffic *t, const line *line)
{
    const uint32_t burst = (uint32_t)t->machine->memory_burst_bytes, bytes = line_size(t, line->name);
    const uint32_t lane_bits = (uint32_t)t->frame->plane_bits[line->name.plane];
    uint32_t sum = 0;
    for (uint32_t from = 0; from < bytes; from += burst) {
        bool changed = false;
        for (uint32_t lane = 0; lane < lanes_of(t, line->name); lane++)
            changed |= (line->changed >> lane & 1) && lane * lane_bits < 8 * (from + burst) &&
                       (lane + 1) * lane_bits > 8 * from;
        sum += changed ? burst : 0;
    }
    return sum;
}

static bool is_color(const traffic *t, int plane)
{
    return format_table[t->frame->plane_formats[plane]].class == FORMAT_CLASS_COLOR;
}

static uint8_t compressed_quarters(const traffic *t, line_name name)
{
    if (!(is_color(t, name.plane) ? t->machine->color_compression : t->machine->depth_compression))
        return 4;
    const uint32_t lanes = lanes_of(t, name);
    return (uint8_t)compress_quarters(t->frame->plane_formats[name.plane], t->frame->plane_bits[name.plane],
                                      t->frame->contents(t->frame->user, name.plane, name.tile),
                                      (int)(name.part * lanes), (int)lanes);
}

// ---- Second level and memory ---------------------------------------------------------------------------

static void memory_written(traffic *t, int plane, uint32_t bytes)
{
    t->counts.memory_bytes_written += bytes;
    t->planes[plane].written += bytes;
}

static void memory_read(traffic *t, int plane, uint32_t bytes)
{
    t->counts.memory_bytes_read += bytes;
    t->planes[plane].read += bytes;
}

static uint32_t set_of(const traffic *t, const cache *cache, line_name name)
{
    const uint32_t number = t->number_in_partition[name.tile] * t->parts[name.plane] + name.part;
    return (number + 7 * (uint32_t)name.plane) % cache->sets;
}

static bool same_line(line_name a, line_name b)
{
    return a.plane == b.plane && a.tile == b.tile && a.part == b.part;
}

// The line, or the one to replace: an empty one, else the one used longest ago.
static line *find(const traffic *t, cache *cache, line_name name)
{
    line *set = &cache->lines[set_of(t, cache, name) * cache->ways], *oldest = set;
    for (uint32_t way = 0; way < cache->ways; way++)
        if (set[way].valid && same_line(set[way].name, name))
            return &set[way];
    for (uint32_t way = 1; way < cache->ways; way++)
        if (!set[way].valid ? oldest->valid : oldest->valid && set[way].used < oldest->used)
            oldest = &set[way];
    return oldest;
}

static void l2_write_back(traffic *t, line *line)
{
    if (line->valid && line->changed) {
        t->counts.l2_writebacks++;
        memory_written(t, line->name.plane, line->bytes);
    }
    line->changed = 0;
}

// Bytes of a line between a first-level cache and what lies behind.
static void behind(traffic *t, line_name name, uint32_t bytes, bool write)
{
    if (!bytes)
        return;
    if (!t->machine->l2_bytes) {
        if (write)
            memory_written(t, name.plane, bytes);
        else
            memory_read(t, name.plane, bytes);
        return;
    }
    line *line = find(t, &t->slices[t->partition_of[name.tile]], name);
    t->counts.l2_lookups++;
    if (!line->valid || !same_line(line->name, name)) {
        t->counts.l2_misses++;
        l2_write_back(t, line);
        *line = (struct line){.valid = true, .name = name};
        if (!write)
            memory_read(t, name.plane, bytes);
    }
    line->used = ++t->time;
    if (write) {
        line->changed = 1;
        line->bytes = memory_size(t, name);  // whole, whatever was written of it
    }
}

// ---- First level ---------------------------------------------------------------------------------------

static void write(traffic *t, const line *line)
{
    block_state *state = state_of(t, line->name);
    const bool was_whole = !state->cleared && state->quarters == 4;
    const bool all_there = line->held == all_lanes(t, line->name);
    *state = (block_state){false, all_there ? compressed_quarters(t, line->name) : 4};
    const uint32_t bytes = was_whole && state->quarters == 4 ? changed_bursts(t, line) : memory_size(t, line->name);
    t->counts.lines_compressed += state->quarters < 4;
    t->counts.rop_bytes_written += bytes;
    behind(t, line->name, bytes, true);
}

static void write_back(traffic *t, line *line, access_unit unit)
{
    if (!line->valid || !line->changed)
        return;
    *(unit == ACCESS_DEPTH ? &t->counts.depth_writebacks : &t->counts.color_writebacks) += 1;
    write(t, line);
    line->changed = 0;
}

static void fetch(traffic *t, line *line)
{
    const block_state *state = state_of(t, line->name);
    if (state->cleared) {
        t->counts.fills_cleared++;
    } else {
        const uint32_t bytes = memory_size(t, line->name);
        t->counts.rop_bytes_read += bytes;
        behind(t, line->name, bytes, false);
    }
    line->held = all_lanes(t, line->name);
}

static void count_lookup(traffic *t, access_unit unit, bool miss)
{
    statistics *s = &t->counts;
    switch (unit) {
    case ACCESS_TEXTURE:
        s->texture_lookups++;
        s->texture_misses += miss;
        break;
    case ACCESS_DEPTH:
        s->depth_lookups++;
        s->depth_misses += miss;
        break;
    default: s->color_lookups++; s->color_misses += miss;
    }
}

static line *store_line(cache *store, line_name name, bool *fresh)
{
    for (uint32_t i = 0; i < store->count; i++)
        if (same_line(store->lines[i].name, name))
            return &store->lines[i];
    *fresh = true;
    store->lines = realloc(store->lines, (store->count + 1) * sizeof *store->lines);
    store->lines[store->count] = (line){.valid = true, .name = name};
    return &store->lines[store->count++];
}

static void touch(traffic *t, line *line, line_name name, access_unit unit, uint64_t read, uint64_t written, bool fresh)
{
    const uint64_t all = all_lanes(t, name);
    bool miss = fresh;
    if (!line->valid || !same_line(line->name, name)) {
        write_back(t, line, unit);
        *line = (struct line){.valid = true, .name = name};
        miss = true;
    }
    line->used = ++t->time;
    const block_state *state = state_of(t, name);
    if ((read & ~line->held) || ((written & ~line->held) && (state->cleared || state->quarters < 4) && written != all)) {
        fetch(t, line);
        miss = true;
    } else {
        t->counts.fills_none += miss;
    }
    count_lookup(t, unit, miss);
    line->held |= written;
    t->counts.lines_dirtied += written && !line->changed;
    line->changed |= written;
}

// The line that came last leaves first.
static void leave_region(traffic *t, uint32_t partition)
{
    cache *store = &t->stores[partition];
    for (; store->count; store->count--) {
        line *line = &store->lines[store->count - 1];
        write_back(t, line, is_color(t, line->name.plane) ? ACCESS_COLOR : ACCESS_DEPTH);
    }
}

// ---- Passes --------------------------------------------------------------------------------------------

static void forget(cache *cache, int plane)
{
    for (uint32_t i = 0; i < cache->sets * cache->ways; i++)
        if (plane < 0 || cache->lines[i].name.plane == plane)
            cache->lines[i].valid = false;
}

// A clear that marks writes nothing; another one writes every line, as it is after the clear.
static void clear(traffic *t, int plane)
{
    for (int64_t p = 0; p < t->machine->partitions; p++) {
        for (int u = 0; u < ACCESS_UNITS; u++)
            forget(&t->caches[p][u], plane);
        forget(&t->slices[p], plane);
    }
    for (uint32_t tile = 0; tile < t->frame->tile_count; tile++)
        for (uint32_t part = 0; part < t->parts[plane]; part++) {
            const line_name name = {plane, tile, part};
            const uint64_t all = all_lanes(t, name);
            const line line = {.valid = true, .name = name, .held = all, .changed = all};
            t->counts.blocks_cleared++;
            if (t->machine->fast_clear)
                *state_of(t, name) = (block_state){true, 4};
            else if (all)
                write(t, &line);
        }
}

void traffic_begin_pass(traffic *t, const pass_info *pass)
{
    t->pass = *pass;
    for (int64_t p = 0; p < t->machine->partitions; p++) {
        forget(&t->caches[p][ACCESS_TEXTURE], -1);
        t->region_at_hand[p] = UINT32_MAX;
    }
    const uint64_t read = geometry_reads(t->machine, pass) * (uint64_t)t->machine->line_bytes;
    const uint64_t written = geometry_writes(t->machine, pass) * (uint64_t)t->machine->line_bytes;
    t->counts.geometry_bytes += read + written;
    t->counts.memory_bytes_read += read;
    t->counts.memory_bytes_written += written;
}

void traffic_stamp(traffic *t, const stamp *stamp)
{
    const uint32_t p = t->partition_of[stamp->tile];
    if (stamp->hierarchical)
        return;
    if (t->machine->tile_based && t->region_at_hand[p] != t->region_of[stamp->tile]) {
        leave_region(t, p);
        t->region_at_hand[p] = t->region_of[stamp->tile];
    }
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *a = &stamp->accesses[i];
        for (uint32_t part = 0; part < t->parts[a->plane]; part++) {
            const line_name name = {a->plane, stamp->tile, part};
            const uint32_t first = part * lanes_of(t, name);
            const uint64_t read = a->read >> first & all_lanes(t, name);
            const uint64_t written = a->written >> first & all_lanes(t, name);
            if (!(read | written))
                continue;
            bool fresh = false;
            line *line = t->on_chip[a->plane] && a->unit != ACCESS_TEXTURE
                             ? store_line(&t->stores[p], name, &fresh)
                             : find(t, &t->caches[p][a->unit], name);
            touch(t, line, name, a->unit, read, written, fresh);
        }
    }
    const uint32_t list_bytes = in_bursts(t, stamp->list_bytes);
    t->counts.list_bytes += list_bytes;
    // A list is appended to in a drawing pass and read in a full-screen one.
    *(t->pass.kind == PASS_DRAW ? &t->counts.memory_bytes_written : &t->counts.memory_bytes_read) += list_bytes;
}

void traffic_end_pass(traffic *t)
{
    if (t->pass.kind == PASS_CLEAR)
        clear(t, t->pass.plane);
    for (uint32_t p = 0; p < (uint32_t)t->machine->partitions; p++)
        for (int u = ACCESS_DEPTH; u < ACCESS_UNITS; u++) {
            for (uint32_t i = 0; i < t->caches[p][u].sets * t->caches[p][u].ways; i++)
                write_back(t, &t->caches[p][u].lines[i], (access_unit)u);
            if (u == ACCESS_DEPTH)
                leave_region(t, p);
        }
}

void traffic_end_run(traffic *t)
{
    for (int64_t p = 0; p < t->machine->partitions; p++)
        for (uint32_t i = 0; i < t->slices[p].sets * t->slices[p].ways; i++)
            l2_write_back(t, &t->slices[p].lines[i]);
}
