// Stamps of a few fragments in, one dispatch for many of them.
//
// A dispatch costs much the same for three lanes as for sixty-four, and a mesh of small triangles has three fragments a stamp.
// So stamps that follow each other and share no sample run together, as lanes side by side over planes gathered from their
// blocks; their columns lie side by side already. None of them can see what another one wrote. What each wrote goes to its
// block when the stamp's own turn comes: until then nobody sees that it ran, and if its turn never comes, it did not.
#include "arrival.h"

bool pack_has(const arrival *a, int kernel, const stamp_chunk *chunk, const stamp_record *record)
{
    const stamp_pack *p = &a->pack;
    return p->next < p->end && p->chunk == chunk && record == &chunk->records[p->next] && p->kernel == kernel && p->pass == a->passes_begun;
}

// The samples of a stamp's fragments, some at once and up to a whole step too many: how often a loop over few would end differs from stamp
// to stamp.
static inline void find_lanes(uint32_t *base, uint64_t lanes, uint32_t **at)
{
    for (; lanes; at += PACK_STEP)
        for (int i = 0; i < PACK_STEP; i++, lanes &= lanes - 1)
            at[i] = base + __builtin_ctzll(lanes | UINT64_C(1) << 63);
}

// Finds each fragment's sample and, to make whole steps of them, some behind; returns how many fragments there are.
static uint32_t find_samples(arrival *a, const stamp_chunk *chunk, uint32_t first, uint32_t end)
{
    uint32_t **at = a->pack.at;
    for (uint32_t r = first; r < end; r++) {
        const stamp_record *record = &chunk->records[r];
        uint32_t *base = arrival_block(a, record->tile);
        if (a->visited)
            skip_catch_up_before(a, r);
        find_lanes(base, record->lanes, at);
        at += record->fragments;
    }
    for (int i = 0; i < PACK_STEP; i++)
        at[i] = a->empty_storage;
    return (uint32_t)(at - a->pack.at);
}

// What the kernel reads, but for colours.
static void gather(const arrival *a, const kernel_use *use, uint32_t count)
{
    const stamp_pack *p = &a->pack;
    for (const kernel_plane *plane = use->planes; plane < use->planes + use->plane_count; plane++) {
        const uint32_t from = a->plan.plane_offset[a->plane_at[plane->plane]];
        uint32_t *to = p->planes[plane->plane];
        if (!plane->read || plane->color)
            continue;
        for (uint32_t *const *at = p->at; at < p->at + count; at += PACK_STEP, to += PACK_STEP)
            for (int i = 0; i < PACK_STEP; i++)
                to[i] = at[i][from];
    }
}

// The lanes that read a colour in the dispatch before.
static uint64_t color_readers(const arrival *a, const kernel_use *use)
{
    uint64_t lanes = 0;
    for (int i = 0; i < use->access_count; i++)
        if (use->accesses[i].color && !use->accesses[i].write)
            lanes |= a->log[use->accesses[i].instruction].executed;
    return lanes;
}

static void gather_colors(const arrival *a, const kernel_use *use, uint64_t lanes)
{
    const stamp_pack *p = &a->pack;
    for (const kernel_plane *plane = use->planes; plane < use->planes + use->plane_count; plane++) {
        const uint32_t from = a->plan.plane_offset[a->plane_at[plane->plane]];
        uint32_t *to = p->planes[plane->plane];
        for (uint64_t left = plane->read && plane->color ? lanes : 0; left; left &= left - 1) {
            const uint32_t i = (uint32_t)__builtin_ctzll(left);
            for (uint32_t c = 0; c < 4; c++)
                to[c * TILE_LANES + i] = p->at[i][from + c * TILE_LANES];
        }
    }
}

// Few fragments get as far as a colour as a rule, which is four times as large as all else. So the kernel runs without colours first: a lane
// that reads none does what it does anyway. If any lane reads one, all runs again, with the colours of those. Where most did in the pack
// before, the kernel gets all colours at once.
static void run(arrival *a, int kernel, const batch *batch, uint32_t count)
{
    const kernel_use *use = &a->uses[kernel];
    stamp_pack *p = &a->pack;
    const bool at_once = p->reads_colors;
    gather(a, use, count);
    if (at_once)
        gather_colors(a, use, batch->lanes);
    dispatch_run(a, kernel, p->planes, batch);
    const uint64_t readers = color_readers(a, use);
    p->reads_colors = 2 * count_lanes(readers) > count;
    if (readers && !at_once) {
        gather(a, use, count);
        gather_colors(a, use, readers);
        dispatch_run(a, kernel, p->planes, batch);
    }
    dispatch_sum_up(a, kernel, p->planes, batch);
}

// Writes the fragments of these lanes to where they belong.
static void scatter(const arrival *a, uint8_t plane, bool color, uint64_t lanes)
{
    const stamp_pack *p = &a->pack;
    const uint32_t to = a->plan.plane_offset[a->plane_at[plane]];
    const uint32_t *from = p->planes[plane];
    for (; lanes; lanes &= lanes - 1) {
        const int i = __builtin_ctzll(lanes);
        for (uint32_t c = 0; c < (color ? 4 : 1); c++)
            p->at[i][to + c * TILE_LANES] = from[c * TILE_LANES + (uint32_t)i];
    }
}

// One past the last record that is of the same pack.
static uint32_t pack_end(const stamp_chunk *chunk, uint32_t first)
{
    uint32_t end = first + 1;
    while (end < chunk->count && chunk->records[end].place)
        end++;
    return end;
}

static void fill_primitives(stamp_pack *p, const stamp_record *first, const stamp_record *end)
{
    uint32_t *to = p->primitives;
    for (const stamp_record *record = first; record < end; record++)
        for (uint32_t i = 0; i < record->fragments; i++)
            *to++ = record->primitive;
}

// Where the stamps' fragments lie, which lie by lanes, and as find_samples some behind.
static void find_places(stamp_pack *p, const stamp_record *first, const stamp_record *end)
{
    uint64_t *from = p->from;
    for (const stamp_record *record = first; record < end; from += record->fragments, record++)
        for (uint64_t lanes = record->lanes, *next = from; lanes; next += PACK_STEP)
            for (int i = 0; i < PACK_STEP; i++, lanes &= lanes - 1)
                next[i] = record->offset + (uint32_t)__builtin_ctzll(lanes | UINT64_C(1) << 63);
    for (int i = 0; i < PACK_STEP; i++)
        from[i] = first->offset;
}

// A column's words side by side.
static const uint32_t *close_up(const stamp_pack *p, const void *column, uint32_t count, uint32_t *to)
{
    const uint32_t *words = column;
    for (uint32_t at = 0; at < count; at += PACK_STEP)
        for (uint32_t i = at; i < at + PACK_STEP; i++)
            to[i] = words[p->from[i]];
    return to;
}

// Points the batch at what the kernel looks at.
static void point_at_columns(stamp_pack *p, const kernel_use *use, const stamp_chunk *chunk, const stamp_record *first, const stamp_record *end,
                             uint32_t count, batch *batch)
{
    uint32_t (*next)[TILE_LANES] = p->columns;
    if (chunk->by_lanes)
        find_places(p, first, end);
    for (uint32_t formats = use->depth_formats; formats; formats &= formats - 1, next++) {
        const int f = __builtin_ctz(formats);
        batch->depth[f] = chunk->by_lanes ? close_up(p, chunk->codes[f], count, *next) : chunk->codes[f] + first->offset;
    }
    for (int c = 0; use->color && c < 4; c++, next++)
        batch->rgba[c] = chunk->by_lanes ? (const float *)(const void *)close_up(p, chunk->rgba[c], count, *next) : chunk->rgba[c] + first->offset;
}

bool pack_begin(arrival *a, int kernel, const stamp_chunk *chunk, const stamp_record *record)
{
    const kernel_use *use = &a->uses[kernel];
    stamp_pack *p = &a->pack;
    const uint32_t first = (uint32_t)(record - chunk->records), end = pack_end(chunk, first);
    p->end = 0;
    if (end - first < 2 || a->options.apart || a->options.region_pixels)  // by region, others come in between
        return false;
    const uint32_t count = find_samples(a, chunk, first, end);
    batch batch = {.lanes = UINT64_MAX >> (TILE_LANES - count), .log = a->log, .primitive = p->primitives};
    point_at_columns(p, use, chunk, record, chunk->records + end, count, &batch);
    if (use->primitive)
        fill_primitives(p, record, chunk->records + end);
    run(a, kernel, &batch, count);
    p->chunk = chunk;
    p->next = first;
    p->end = end;
    p->kernel = kernel;
    p->pass = a->passes_begun;
    p->lane = 0;
    return true;
}

void pack_pass_over(arrival *a, const stamp_record *record)
{
    a->pack.next++;
    a->pack.lane += record->fragments;
}

// What these lanes wrote.
static void scatter_all(const arrival *a, uint64_t own)
{
    for (int i = 0; i < a->sum.access_count; i++) {
        const access_lanes *done = &a->sum.accesses[i];
        if (done->access->write && (done->lanes & own))
            scatter(a, done->access->plane, done->access->color, done->lanes & own);
    }
}

dispatch_part pack_take(arrival *a, const kernel_use *use, const stamp_record *record)
{
    const uint32_t first = a->pack.lane, count = record->fragments;
    const dispatch_part part = {record->lanes, first, count, lanes_alike(a, use, first, count)};
    const uint64_t own = (UINT64_MAX >> (TILE_LANES - count)) << first;
    if (!part.alike && (a->sum.written & own))
        scatter_all(a, own);
    for (int i = 0; part.alike && i < part.alike->written_count; i++)
        scatter(a, part.alike->written[i].plane, part.alike->written[i].color, own);
    pack_pass_over(a, record);
    return part;
}
