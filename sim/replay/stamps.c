// A trace in, its stamps out, a chunk of about a million fragments at a time.
//
// A primitive's fragments are kept until it ends, and come out block by block in the order in which the trace meets the
// blocks: within one primitive no sample occurs twice, so that changes no sample's order. Where one does (in traces written
// by hand), the second counts as another primitive. If all chunks fit the budget they stay; else the trace is read anew for
// each pass. Both give the same stamps, since a chunk ends between primitives alone.
//
// Stamps of one draw that follow each other and share no sample are a pack, as long as all their fragments find room in a block's
// lanes: one dispatch can run them.
#include "stamps.h"

#include <stdlib.h>
#include <string.h>

enum { CHUNK_FRAGMENTS = 1 << 20 };

typedef struct packed_block { uint64_t pack, lanes; } packed_block;

typedef struct pending_fragment {
    double depth;
    float rgba[4];
    uint32_t stamp, lane;
} pending_fragment;

// The primitive being read.
typedef struct stamp_pending {
    uint32_t *stamp_of_tile;  // its stamp in `tiles`, plus 1; 0: none
    uint32_t *tiles;
    uint64_t *lanes;
    uint32_t tile_count, tile_capacity;
    pending_fragment *fragments;
    uint32_t count, capacity;
    uint32_t draw, primitive;
    uint32_t stamp;           // of the last fragment: the next one's block is the same most of the time
    uint64_t *offsets;        // of each stamp
    uint32_t *regions_seen;   // of each region: stamp of the primitive that was counted there last
    uint32_t primitive_number;
    packed_block *packed;     // of each block: what the pack at hand has of it
    uint64_t pack;            // its number
    uint32_t pack_fragments, pack_draw;
} stamp_pending;

static status refuse_memory(const report *report)
{
    return report_error(report, STATUS_IO, "out of memory: stamps of a trace");
}

uint32_t stamps_region(const stamps *s, uint32_t tile)
{
    const tiling *t = &s->tiling;
    const uint32_t columns = (t->image_width + s->request.region_pixels - 1) / s->request.region_pixels;
    const uint32_t x = (tile % t->columns << t->shift_x) / s->request.region_pixels;
    const uint32_t y = (tile / t->columns << t->shift_y) / s->request.region_pixels;
    return y * columns + x;
}

static uint32_t region_count(const stamps *s)
{
    return s->request.region_pixels ? stamps_region(s, s->tiling.tile_count - 1) + 1 : 0;
}

// Room for `length` elements of `size` bytes; false: none.
static bool reserve(void *array, uint64_t length, uint64_t size)
{
    void **const pointer = array;
    void *grown = realloc(*pointer, (size_t)((length ? length : 1) * size));
    if (grown)
        *pointer = grown;
    return grown;
}

static void chunk_free(stamp_chunk *chunk)
{
    free(chunk->records);
    for (int f = 0; f < FORMAT_COUNT; f++)
        free(chunk->codes[f]);
    for (int c = 0; c < 4; c++)
        free(chunk->rgba[c]);
    block_order_free(&chunk->blocks);
    *chunk = (stamp_chunk){0};
}

static void drop_chunks(stamps *s)
{
    for (uint32_t i = 0; i < s->chunk_count; i++)
        chunk_free(&s->chunks[i]);
    s->chunk_count = 0;
}

static bool chunk_reserve(const stamp_request *request, stamp_chunk *chunk, uint64_t fragments, uint32_t records)
{
    bool good = true;
    if (chunk->fragment_count + fragments > chunk->fragment_capacity) {
        // Behind the last one, a whole block may be read.
        uint64_t capacity = 2 * (chunk->fragment_count + fragments);
        for (int f = 0; f < FORMAT_COUNT; f++)
            if (request->depth_formats >> f & 1)
                good = good && reserve(&chunk->codes[f], capacity + TILE_LANES, sizeof(uint32_t));
        for (int c = 0; request->color && c < 4; c++)
            good = good && reserve(&chunk->rgba[c], capacity + TILE_LANES, sizeof(float));
        if (good)
            chunk->fragment_capacity = capacity;
    }
    if (good && chunk->count + records > chunk->capacity) {
        good = reserve(&chunk->records, 2 * (uint64_t)(chunk->count + records), sizeof *chunk->records);
        if (good)
            chunk->capacity = 2 * (chunk->count + records);
    }
    return good;
}

static uint64_t chunk_bytes(const stamp_request *request, const stamp_chunk *chunk)
{
    const uint64_t each = 4 * (uint64_t)__builtin_popcount(request->depth_formats) + (request->color ? 16 : 0);
    const block_order *blocks = &chunk->blocks;
    const uint64_t in_blocks = blocks->batch_count * (TILE_LANES * (each + 4 * request->primitive)) +
                               (blocks->stamps ? chunk->count * (sizeof *blocks->stamps + sizeof *blocks->batches) : 0);
    return chunk->fragment_capacity * each + chunk->capacity * sizeof *chunk->records + in_blocks;
}

// Puts the stamp into the pack at hand, or begins one with it.
static void pack_record(stamp_pending *p, bool first, stamp_record *record)
{
    packed_block *block = &p->packed[record->tile];
    const bool shares = block->pack == p->pack && (block->lanes & record->lanes);
    if (first || shares || record->draw != p->pack_draw || p->pack_fragments + record->fragments > TILE_LANES) {
        p->pack++;
        p->pack_fragments = 0;
        p->pack_draw = record->draw;
    }
    if (block->pack != p->pack)
        *block = (packed_block){p->pack, 0};
    block->lanes |= record->lanes;
    record->place = (uint8_t)p->pack_fragments;
    p->pack_fragments += record->fragments;
}

static void put_records(const stamps *s, stamp_pending *p, stamp_chunk *chunk)
{
    const tiling *t = &s->tiling;
    const stamp_record *last = chunk->count ? &chunk->records[chunk->count - 1] : NULL;
    const uint32_t begun = last ? last->begun + last->begins_primitive : 0;
    uint64_t offset = chunk->fragment_count;
    chunk->first_draw = last && chunk->first_draw < p->draw ? chunk->first_draw : p->draw;
    chunk->last_draw = last && chunk->last_draw > p->draw ? chunk->last_draw : p->draw;
    for (uint32_t i = 0; i < p->tile_count; i++) {
        stamp_record *record = &chunk->records[chunk->count];
        p->offsets[i] = offset;
        *record = (stamp_record){.lanes = p->lanes[i], .offset = offset, .tile = p->tiles[i], .primitive = p->primitive, .draw = p->draw,
                                 .begun = i ? record[-1].begun + record[-1].begins_primitive : begun, .begins_primitive = i == 0, .nearest = UINT32_MAX,
                                 .fragments = (uint8_t)count_lanes(p->lanes[i]), .quads = (uint8_t)count_lanes(quads_of_lanes(p->lanes[i], t->samples, t->tile_width, t->quad_corners))};
        pack_record(p, !chunk->count, record);
        chunk->count++;
        offset += record->fragments;
    }
    chunk->fragment_count = offset;
}

static void put_fragments(const stamps *s, const stamp_pending *p, stamp_chunk *chunk)
{
    stamp_record *records = chunk->records + chunk->count - p->tile_count;
    const bool reversed = trace_get_info(s->trace)->reversed_depth;
    for (uint32_t i = 0; i < p->count; i++) {
        const pending_fragment *fragment = &p->fragments[i];
        const uint64_t before = p->lanes[fragment->stamp] & ((1ull << fragment->lane) - 1);
        const uint64_t at = p->offsets[fragment->stamp] + count_lanes(before);
        for (uint32_t formats = s->request.depth_formats; formats; formats &= formats - 1) {
            const int f = __builtin_ctz(formats);
            const uint32_t code = chunk->codes[f][at] = format_depth_to_code((format)f, fragment->depth, reversed);
            if (f != (int)s->request.range_format)
                continue;
            stamp_record *record = &records[fragment->stamp];
            record->nearest = code < record->nearest ? code : record->nearest;
            record->farthest = code > record->farthest ? code : record->farthest;
        }
        for (int c = 0; s->request.color && c < 4; c++)
            chunk->rgba[c][at] = fragment->rgba[c];
    }
}

static void count_regions(stamps *s, stamp_pending *p)
{
    p->primitive_number++;
    for (uint32_t i = 0; i < p->tile_count; i++) {
        uint32_t *seen = &p->regions_seen[stamps_region(s, p->tiles[i])];
        s->region_pairs[p->draw] += *seen != p->primitive_number;
        *seen = p->primitive_number;
    }
}

// Moves the primitive to the chunk; `counting` in the first reading.
static bool end_primitive(stamps *s, stamp_chunk *chunk, bool counting)
{
    stamp_pending *p = s->pending;
    if (!p->count)
        return true;
    if (!chunk_reserve(&s->request, chunk, p->count, p->tile_count))
        return false;
    put_records(s, p, chunk);
    put_fragments(s, p, chunk);
    if (counting) {
        s->primitives[p->draw]++;
        s->stamp_count += p->tile_count;
        s->counts[p->draw] += p->tile_count;
        for (uint32_t i = 0; i < p->tile_count; i++)
            s->touched[p->tiles[i]] = 1;
        if (s->request.region_pixels)
            count_regions(s, p);
    }
    for (uint32_t i = 0; i < p->tile_count; i++)
        p->stamp_of_tile[p->tiles[i]] = 0;
    p->count = p->tile_count = 0;
    return true;
}

// Makes the stamp that the fragment at a lane of a tile belongs to the one at hand.
static bool find_stamp(stamps *s, const fragments *run, uint32_t i, uint32_t tile, uint64_t bit, stamp_chunk *chunk, bool counting)
{
    stamp_pending *p = s->pending;
    const uint32_t found = p->stamp_of_tile[tile];
    const bool again = found && (p->lanes[found - 1] & bit);
    if (p->count && (again || p->primitive != run->primitive[i] || p->draw != run->draw) && !end_primitive(s, chunk, counting))
        return false;
    p->draw = run->draw;
    p->primitive = run->primitive[i];
    if (!p->stamp_of_tile[tile]) {
        if (p->tile_count == p->tile_capacity) {
            const uint64_t capacity = p->tile_capacity ? 2 * (uint64_t)p->tile_capacity : 64;
            if (!reserve(&p->tiles, capacity, sizeof *p->tiles) || !reserve(&p->lanes, capacity, sizeof *p->lanes) ||
                !reserve(&p->offsets, capacity, sizeof *p->offsets))
                return false;
            p->tile_capacity = (uint32_t)capacity;
        }
        p->tiles[p->tile_count] = tile;
        p->lanes[p->tile_count++] = 0;
        p->stamp_of_tile[tile] = p->tile_count;
    }
    p->stamp = p->stamp_of_tile[tile] - 1;
    return true;
}

static bool add_fragment(stamps *s, const tiling *tiling, const fragments *run, uint32_t i, stamp_chunk *chunk, bool counting)
{
    stamp_pending *p = s->pending;
    const uint64_t place = tiling_place(tiling, run->x[i], run->y[i], run->sample[i]);
    const uint32_t tile = (uint32_t)(place / TILE_LANES);
    const uint64_t bit = 1ull << place % TILE_LANES;
    if (s->request.tiles && !s->request.tiles[tile])
        return true;
    // Most fragments lie in the block of the one before.
    if ((!p->count || p->tiles[p->stamp] != tile || (p->lanes[p->stamp] & bit) || p->primitive != run->primitive[i] || p->draw != run->draw) &&
        !find_stamp(s, run, i, tile, bit, chunk, counting))
        return false;
    if (p->count == p->capacity) {
        const uint64_t capacity = p->capacity ? 2 * (uint64_t)p->capacity : 1024;
        if (!reserve(&p->fragments, capacity, sizeof *p->fragments))
            return false;
        p->capacity = (uint32_t)capacity;
    }
    p->lanes[p->stamp] |= bit;
    p->fragments[p->count++] = (pending_fragment){.depth = run->depth[i], .rgba = {run->rgba[0][i], run->rgba[1][i], run->rgba[2][i], run->rgba[3][i]},
                                                  .stamp = p->stamp, .lane = (uint32_t)(place % TILE_LANES)};
    return true;
}

// In order of blocks one chunk takes the whole trace, if the budget does.
static bool full(const stamps *s, const stamp_chunk *chunk)
{
    const bool fits = s->request.blocks && s->whole && 2 * chunk_bytes(&s->request, chunk) <= s->request.memory_bytes;
    return chunk->fragment_count >= CHUNK_FRAGMENTS && !fits;
}

// Reads on until the chunk is full or the trace ends.
static status fill_chunk(stamps *s, stamp_chunk *chunk, bool counting)
{
    const uint64_t total = trace_get_info(s->trace)->fragment_count;
    const tiling tiling = s->tiling;  // a copy that nothing written here can change
    while (!s->ended && !full(s, chunk)) {
        fragments run;
        const status status = trace_next(s->trace, &run);
        if (status != STATUS_OK)
            return status;
        s->ended = run.count == 0;
        for (uint32_t i = 0; i < run.count; i++)
            if (!add_fragment(s, &tiling, &run, i, chunk, counting))
                return refuse_memory(s->report);
        if (s->ended && !end_primitive(s, chunk, counting))
            return refuse_memory(s->report);
        if (counting)
            report_progress(s->report, "reading stamps", chunk->fragment_count + (uint64_t)(s->chunk_count - 1) * CHUNK_FRAGMENTS, total);
    }
    if (s->request.blocks && !block_order_make(chunk, &s->request, s->tiling.tile_count, &chunk->blocks))
        return refuse_memory(s->report);
    return STATUS_OK;
}

static bool add_chunk(stamps *s)
{
    if (s->chunk_count == s->chunk_capacity) {
        const uint32_t capacity = s->chunk_capacity ? 2 * s->chunk_capacity : 16;
        if (!reserve(&s->chunks, capacity, sizeof *s->chunks))
            return false;
        s->chunk_capacity = capacity;
    }
    s->chunks[s->chunk_count++] = (stamp_chunk){0};
    return true;
}

static status start_reading(stamps *s)
{
    const trace_info *info = trace_get_info(s->trace);
    trace_select(s->trace, 0, 0, info->width, info->height);
    trace_places_only(s->trace, false);
    s->ended = false;
    s->pending->count = s->pending->tile_count = 0;
    memset(s->pending->stamp_of_tile, 0, s->tiling.tile_count * sizeof *s->pending->stamp_of_tile);
    return trace_rewind(s->trace);
}

static status read_all(stamps *s)
{
    status status = start_reading(s);
    uint64_t bytes = 0;
    s->whole = true;
    while (status == STATUS_OK && !s->ended) {
        if (!s->whole)
            drop_chunks(s);
        if (!add_chunk(s))
            return refuse_memory(s->report);
        stamp_chunk *chunk = &s->chunks[s->chunk_count - 1];
        status = fill_chunk(s, chunk, true);
        bytes += chunk_bytes(&s->request, chunk);
        s->whole = s->whole && bytes <= s->request.memory_bytes;
    }
    if (!s->whole)
        drop_chunks(s);
    return status;
}

static status sort_by_region(stamps *s)
{
    if (!s->whole)
        return report_error(s->report, STATUS_REFUSED,
                            "a tile-based machine sorts all stamps of a trace by region, which takes more than the budget of %llu MiB (--memory)",
                            (unsigned long long)(s->request.memory_bytes >> 20));
    const uint32_t regions = region_count(s);
    uint64_t *starts = calloc((size_t)regions + 1, sizeof *starts);
    s->by_region = malloc((s->stamp_count + 1) * sizeof *s->by_region);
    if (!starts || !s->by_region) {
        free(starts);
        return refuse_memory(s->report);
    }
    for (uint32_t c = 0; c < s->chunk_count; c++)
        for (uint32_t i = 0; i < s->chunks[c].count; i++)
            starts[stamps_region(s, s->chunks[c].records[i].tile) + 1]++;
    for (uint32_t r = 0; r < regions; r++)
        starts[r + 1] += starts[r];
    for (uint32_t c = 0; c < s->chunk_count; c++)
        for (uint32_t i = 0; i < s->chunks[c].count; i++)
            s->by_region[starts[stamps_region(s, s->chunks[c].records[i].tile)]++] = (stamp_place){c, i};
    free(starts);
    return STATUS_OK;
}

static status make(stamps *s)
{
    const uint32_t draws = trace_get_info(s->trace)->draw_count;
    const tiling *tiling = &s->tiling;
    s->pending = calloc(1, sizeof *s->pending);
    s->touched = calloc(tiling->tile_count, 1);
    s->primitives = calloc(3 * (size_t)draws + 1, sizeof *s->primitives);
    s->region_pairs = s->primitives ? s->primitives + draws : NULL;
    s->counts = s->primitives ? s->primitives + 2 * (size_t)draws : NULL;
    if (!s->pending || !s->touched || !s->primitives)
        return refuse_memory(s->report);
    s->pending->stamp_of_tile = calloc(tiling->tile_count, sizeof *s->pending->stamp_of_tile);
    s->pending->regions_seen = calloc((size_t)region_count(s) + 1, sizeof *s->pending->regions_seen);
    s->pending->packed = calloc(tiling->tile_count, sizeof *s->pending->packed);
    if (!s->pending->stamp_of_tile || !s->pending->regions_seen || !s->pending->packed)
        return refuse_memory(s->report);
    const status status = read_all(s);
    return status == STATUS_OK && s->request.region_pixels ? sort_by_region(s) : status;
}

status stamps_make(trace *trace, const stamp_request *request, const report *report, stamps **result)
{
    stamps *s = calloc(1, sizeof *s);
    *result = NULL;
    if (!s)
        return refuse_memory(report);
    *s = (stamps){.trace = trace, .request = *request, .report = report};
    tiling_init(&s->tiling, trace_get_info(trace));
    const status status = make(s);
    if (status == STATUS_OK)
        *result = s;
    else
        stamps_destroy(s);
    return status;
}

void stamps_destroy(stamps *s)
{
    if (!s)
        return;
    drop_chunks(s);
    free(s->chunks);
    free(s->touched);
    free(s->primitives);
    free(s->by_region);
    if (s->pending) {
        free(s->pending->stamp_of_tile);
        free(s->pending->tiles);
        free(s->pending->lanes);
        free(s->pending->offsets);
        free(s->pending->fragments);
        free(s->pending->regions_seen);
        free(s->pending->packed);
    }
    free(s->pending);
    free(s);
}

status stamps_rewind(stamps *s)
{
    s->at = 0;
    return s->whole ? STATUS_OK : start_reading(s);
}

status stamps_next(stamps *s, const stamp_chunk **chunk)
{
    *chunk = NULL;
    if (s->whole) {
        if (s->at < s->chunk_count)
            *chunk = &s->chunks[s->at++];
        return STATUS_OK;
    }
    if (s->ended)
        return STATUS_OK;
    drop_chunks(s);
    if (!add_chunk(s))
        return refuse_memory(s->report);
    const status status = fill_chunk(s, &s->chunks[0], false);
    if (status == STATUS_OK && s->chunks[0].count)
        *chunk = &s->chunks[0];
    return status;
}
