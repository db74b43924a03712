// A trace in, its stamps out, a chunk of about a million fragments at a time.
//
// A primitive's fragments are kept until it ends, and come out block by block in the order in which the trace meets the
// blocks: within one primitive no sample occurs twice, so that changes no sample's order. Where one does (in traces written
// by hand), the second counts as another primitive. If all chunks fit the budget they stay; else the trace is read anew for
// each pass. Both give the same stamps, since a chunk ends between primitives alone.
//
// Stamps of one draw that follow each other and share no sample are a pack, as long as all their fragments find room in a block's
// lanes: one dispatch can run them.
#include "arrival.h"
#include "stamp_chunk.h"

#include <stdlib.h>

enum { CHUNK_FRAGMENTS = 1 << 20 };

typedef struct packed_block { uint64_t pack, lanes; } packed_block;

// Fragments of the primitive that follow each other in lanes of a stamp.
typedef struct pending_run {
    uint32_t first;           // counted from the primitive's first fragment
    uint32_t stamp;
    uint8_t lane, count;
} pending_run;

// The primitive being read.
typedef struct stamp_pending {
    uint32_t *stamp_of_tile;  // its stamp in `tiles`, plus 1; 0: none
    uint32_t *tiles;
    uint64_t *lanes;
    uint32_t tile_count, tile_capacity;
    pending_run *runs;
    uint32_t count, capacity;
    uint32_t draw, primitive;
    uint32_t stamp;           // of the last fragment: the next one's block is the same most of the time
    uint32_t *regions_seen;   // of each region: stamp of the primitive that was counted there last
    uint32_t primitive_number;
    open_batch *open;         // of each block; NULL: columns are not by lanes
    packed_block *packed;     // of each block: what the pack at hand has of it
    uint64_t pack;            // its number
    uint32_t pack_fragments, pack_draw;
    lane_runs lane_runs;      // of the trace's run at hand
    word_columns columns;     // that run's, and where they go
    uint32_t begin, end;      // the primitive's fragments in that run, and what is between them
    void *kept[COLUMNS_MAX];  // its fragments of runs before
    uint32_t kept_count, kept_capacity;
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

static void drop_chunks(stamps *s)
{
    for (uint32_t i = 0; i < s->chunk_count; i++)
        stamp_chunk_free(&s->chunks[i]);
    s->chunk_count = 0;
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
    chunk->first_draw = last && chunk->first_draw < p->draw ? chunk->first_draw : p->draw;
    chunk->last_draw = last && chunk->last_draw > p->draw ? chunk->last_draw : p->draw;
    for (uint32_t i = 0; i < p->tile_count; i++) {
        stamp_record *record = &chunk->records[chunk->count];
        const uint64_t offset = stamp_chunk_place(chunk, &s->request, p->open ? &p->open[p->tiles[i]] : NULL, p->draw, p->lanes[i]);
        *record = (stamp_record){.lanes = p->lanes[i], .offset = offset, .tile = p->tiles[i], .primitive = p->primitive, .draw = p->draw,
                                 .begun = i ? record[-1].begun + record[-1].begins_primitive : begun, .begins_primitive = i == 0, .nearest = UINT32_MAX,
                                 .fragments = (uint8_t)count_lanes(p->lanes[i]), .quads = (uint8_t)count_lanes(quads_of_lanes(p->lanes[i], t->samples, t->tile_width, t->quad_corners))};
        pack_record(p, !chunk->count, record);
        chunk->count++;
        chunk->fragment_count += record->fragments;
    }
}

static void put_fragments(const stamps *s, const stamp_pending *p, const word_columns *columns, uint32_t begin, stamp_chunk *chunk)
{
    stamp_record *records = chunk->records + chunk->count - p->tile_count;
    for (uint32_t i = 0; i < p->count; i++) {
        const pending_run *run = &p->runs[i];
        word_columns_copy(columns, begin + run->first, stamp_place_of(chunk, &records[run->stamp], run->lane), run->count);
    }
    const bool ranges = chunk->codes[s->request.range_format];
    for (stamp_record *record = records; ranges && record < records + p->tile_count; record++) {
        const depth_range range = stamp_depths(chunk, record, s->request.range_format);
        record->nearest = range.least;
        record->farthest = range.most;
    }
}

// Keeps what the run at hand has of the primitive, since the next run takes its place.
static bool keep(stamp_pending *p)
{
    const uint32_t count = p->end - p->begin;
    if (!count)
        return true;
    if (p->kept_count + count > p->kept_capacity) {
        const uint32_t capacity = 2 * (p->kept_count + count);
        for (uint32_t c = 0; c < p->columns.count; c++)
            if (!array_reserve(&p->kept[c], capacity, sizeof(uint32_t)))
                return false;
        p->kept_capacity = capacity;
    }
    for (uint32_t c = 0; c < p->columns.count; c++)
        memcpy((uint32_t *)p->kept[c] + p->kept_count, (const uint32_t *)p->columns.from[c] + p->begin, count * sizeof(uint32_t));
    p->kept_count += count;
    p->begin = p->end;
    return true;
}

static bool put_primitive(const stamps *s, stamp_pending *p, stamp_chunk *chunk)
{
    put_records(s, p, chunk);
    if (!p->kept_count) {
        put_fragments(s, p, &p->columns, p->begin, chunk);
        return true;
    }
    if (!keep(p))
        return false;
    word_columns columns = p->columns;
    for (uint32_t c = 0; c < columns.count; c++)
        columns.from[c] = p->kept[c];
    put_fragments(s, p, &columns, 0, chunk);
    p->kept_count = 0;
    return true;
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
    const uint64_t fragments = (uint64_t)p->kept_count + p->end - p->begin;
    if (!stamp_chunk_reserve(chunk, &s->request, fragments, p->tile_count, &p->columns) || !put_primitive(s, p, chunk))
        return false;
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
    if (!p->count)
        p->begin = i;
    p->draw = run->draw;
    p->primitive = run->primitive[i];
    if (!p->stamp_of_tile[tile]) {
        if (p->tile_count == p->tile_capacity) {
            const uint64_t capacity = p->tile_capacity ? 2 * (uint64_t)p->tile_capacity : 64;
            if (!array_reserve(&p->tiles, capacity, sizeof *p->tiles) || !array_reserve(&p->lanes, capacity, sizeof *p->lanes))
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

// Adds fragments of one primitive that follow each other in lanes of a block.
static bool add_lane_run(stamps *s, const tiling *tiling, const fragments *run, uint32_t i, uint32_t count, stamp_chunk *chunk, bool counting)
{
    stamp_pending *p = s->pending;
    const uint64_t place = tiling_place(tiling, run->x[i], run->y[i], run->sample[i]);
    const uint32_t tile = (uint32_t)(place / TILE_LANES), lane = (uint32_t)(place % TILE_LANES);
    const uint64_t bit = 1ull << lane, lanes = UINT64_MAX >> (TILE_LANES - count) << lane;
    if (s->request.tiles && !s->request.tiles[tile])
        return true;
    // Most fragments lie in the block of the one before.
    if ((!p->count || p->tiles[p->stamp] != tile || (p->lanes[p->stamp] & bit) || p->primitive != run->primitive[i] || p->draw != run->draw) &&
        !find_stamp(s, run, i, tile, bit, chunk, counting))
        return false;
    if (p->count == p->capacity) {
        const uint64_t capacity = p->capacity ? 2 * (uint64_t)p->capacity : 1024;
        if (!array_reserve(&p->runs, capacity, sizeof *p->runs))
            return false;
        p->capacity = (uint32_t)capacity;
    }
    const uint64_t again = p->lanes[p->stamp] & lanes;
    const uint32_t added = again ? (uint32_t)__builtin_ctzll(again) - lane : count;
    p->lanes[p->stamp] |= again ? lanes & ((again & -again) - 1) : lanes;
    p->runs[p->count++] = (pending_run){p->kept_count + i - p->begin, p->stamp, (uint8_t)lane, (uint8_t)added};
    p->end = i + added;
    return added == count || add_lane_run(s, tiling, run, i + added, count - added, chunk, counting);
}

static bool start_run(stamps *s, const fragments *run, const stamp_chunk *chunk)
{
    stamp_pending *p = s->pending;
    p->begin = p->end = 0;
    if (run->count && (!lane_runs_find(&p->lane_runs, &s->tiling, run, true) ||
                       !lane_runs_code(&p->lane_runs, run, s->request.depth_formats, trace_get_info(s->trace)->reversed_depth)))
        return false;
    p->columns.count = 0;
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (s->request.depth_formats >> f & 1)
            p->columns.from[p->columns.count++] = p->lane_runs.codes[f];
    for (int c = 0; s->request.color && c < 4; c++)
        p->columns.from[p->columns.count++] = run->rgba[c];
    if (chunk->by_lanes && s->request.primitive)
        p->columns.from[p->columns.count++] = run->primitive;
    stamp_chunk_columns(chunk, &s->request, &p->columns);
    return true;
}

// Adds the next run of the trace to a chunk; without fragments it ends the last primitive.
static bool add_run(stamps *s, const fragments *run, stamp_chunk *chunk, bool counting)
{
    const tiling tiling = s->tiling;  // a copy that nothing written here can change
    stamp_pending *p = s->pending;
    if (!start_run(s, run, chunk))
        return false;
    for (uint32_t i = 0, length; i < run->count; i += length) {
        length = lane_runs_length(&p->lane_runs, i);
        if (!add_lane_run(s, &tiling, run, i, length, chunk, counting))
            return false;
    }
    return run->count ? !p->count || keep(p) : end_primitive(s, chunk, counting);
}

// With how many fragments a chunk is full. In order of blocks one takes the whole trace, if the budget is likely to do: fragments lie
// there with gaps.
static uint64_t full_chunk(const stamps *s, uint64_t total)
{
    const bool takes_all = s->request.blocks && s->whole && total <= s->request.memory_bytes / (2 * stamp_place_bytes(&s->request) + 1);
    return takes_all && total >= CHUNK_FRAGMENTS ? total + 1 : CHUNK_FRAGMENTS;
}

// Reads on until the chunk is full or the trace ends. Columns that grow would be moved; room that is not written to costs nothing.
static status fill_chunk(stamps *s, stamp_chunk *chunk, bool counting)
{
    const uint64_t total = trace_get_info(s->trace)->fragment_count, full = full_chunk(s, total), most = full + CHUNK_FRAGMENTS / 8;
    chunk->by_lanes = s->request.blocks;
    if (!stamp_chunk_resize(chunk, &s->request, total < most ? total : most))
        return refuse_memory(s->report);
    if (chunk->by_lanes)
        memset(s->pending->open, 0, s->tiling.tile_count * sizeof *s->pending->open);
    while (!s->ended && chunk->fragment_count < full) {
        fragments run;
        const status status = trace_next(s->trace, &run);
        if (status != STATUS_OK)
            return status;
        s->ended = run.count == 0;
        if (!add_run(s, &run, chunk, counting))
            return refuse_memory(s->report);
        if (counting)
            report_progress(s->report, "reading stamps", chunk->fragment_count + (uint64_t)(s->chunk_count - 1) * CHUNK_FRAGMENTS, total);
    }
    if (!stamp_chunk_resize(chunk, &s->request, chunk->place_count))
        return refuse_memory(s->report);
    if (chunk->by_lanes && !block_order_make(chunk, s->tiling.tile_count, &chunk->blocks))
        return refuse_memory(s->report);
    return STATUS_OK;
}

static bool add_chunk(stamps *s)
{
    if (s->chunk_count == s->chunk_capacity) {
        const uint32_t capacity = s->chunk_capacity ? 2 * s->chunk_capacity : 16;
        if (!array_reserve(&s->chunks, capacity, sizeof *s->chunks))
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
    s->pending->count = s->pending->tile_count = s->pending->kept_count = 0;
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
        bytes += stamp_chunk_bytes(chunk, &s->request);
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
    s->pending->open = s->request.blocks ? calloc(tiling->tile_count, sizeof *s->pending->open) : NULL;
    if (!s->pending->stamp_of_tile || !s->pending->regions_seen || !s->pending->packed || (s->request.blocks && !s->pending->open))
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
        free(s->pending->runs);
        for (int c = 0; c < COLUMNS_MAX; c++)
            free(s->pending->kept[c]);
        lane_runs_free(&s->pending->lane_runs);
        free(s->pending->regions_seen);
        free(s->pending->packed);
        free(s->pending->open);
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
