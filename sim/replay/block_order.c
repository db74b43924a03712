// A chunk of stamps in, the same stamps block by block out.
//
// Sampling passes over most stamps of a pass and runs them later, block by block. In order of arrival a block's fragments lie all
// over the chunk; here they lie in batches ready for dispatch, so that nothing is looked for and nothing is moved.
#include "lane_runs.h"
#include "stamps.h"

#include <stdlib.h>

enum { RECORDS_AHEAD = 16 };  // that are asked for before they are needed

void block_order_free(block_order *order)
{
    free(order->stamps);
    free(order->places);
    free(order->batches);
    free(order->starts);
    free(order->primitive);
    for (int f = 0; f < FORMAT_COUNT; f++)
        free(order->codes[f]);
    for (int c = 0; c < 4; c++)
        free(order->rgba[c]);
    *order = (block_order){0};
}

// All stamps by block, each block's in order of arrival. When all have their places, `starts` holds each block's first.
static void sort(const stamp_chunk *chunk, uint32_t tile_count, block_order *order)
{
    uint32_t *next = order->starts + 1;
    for (uint32_t r = 0; r < chunk->count; r++)
        next[chunk->records[r].tile + 1]++;
    for (uint32_t t = 0; t < tile_count; t++)
        next[t + 1] += next[t];
    for (uint32_t r = 0; r < chunk->count; r++) {
        const uint32_t place = order->places[r] = next[chunk->records[r].tile]++;
        order->stamps[place] = (block_stamp){chunk->records[r].lanes, r, 0};
    }
}

// A block's stamps lie all over the chunk: asks for the record of one that comes later.
static void prefetch_record(const stamp_chunk *chunk, const block_order *order, uint32_t i)
{
    if (i < chunk->count)
        __builtin_prefetch(&chunk->records[order->stamps[i].number]);
}

// The same of its fragments; its record is there.
static void prefetch_fragments(const stamp_chunk *chunk, const block_order *order, uint32_t i, const word_columns *columns)
{
    if (i < chunk->count)
        for (uint32_t c = 0; c < columns->count; c++)
            __builtin_prefetch((const uint32_t *)columns->from[c] + chunk->records[order->stamps[i].number].offset);
}

// Stamps of one block and draw that share no sample make a batch.
static void make_batches(const stamp_chunk *chunk, block_order *order)
{
    const stamp_record *before = NULL;
    for (uint32_t i = 0; i < chunk->count; i++) {
        prefetch_record(chunk, order, i + RECORDS_AHEAD);
        const stamp_record *record = &chunk->records[order->stamps[i].number];
        block_batch *batch = &order->batches[order->batch_count - !!before];
        if (!before || before->tile != record->tile || before->draw != record->draw || (batch->lanes & record->lanes)) {
            batch = &order->batches[order->batch_count++];
            *batch = (block_batch){.first = i, .draw = record->draw, .nearest = UINT32_MAX};
        }
        batch->lanes |= record->lanes;
        batch->nearest = record->nearest < batch->nearest ? record->nearest : batch->nearest;
        batch->farthest = record->farthest > batch->farthest ? record->farthest : batch->farthest;
        batch->end = i + 1;
        batch->last = order->stamps[i].number;
        order->stamps[i].batch = order->batch_count - 1;
        before = record;
    }
}

// Lanes without a fragment are read, if not used.
static bool make_columns(const stamp_request *request, block_order *order)
{
    const size_t lanes = ((size_t)order->batch_count + 1) * TILE_LANES;
    bool good = true;
    for (int f = 0; good && f < FORMAT_COUNT; f++)
        if (request->depth_formats >> f & 1)
            good = (order->codes[f] = calloc(lanes, sizeof *order->codes[f]));
    for (int c = 0; good && request->color && c < 4; c++)
        good = (order->rgba[c] = calloc(lanes, sizeof *order->rgba[c]));
    if (good && request->primitive)
        good = (order->primitive = calloc(lanes, sizeof *order->primitive));
    return good;
}

static void fill_columns(const stamp_chunk *chunk, block_order *order)
{
    word_columns columns = {0};
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (order->codes[f])
            word_columns_add(&columns, chunk->codes[f], order->codes[f]);
    for (int c = 0; order->rgba[0] && c < 4; c++)
        word_columns_add(&columns, chunk->rgba[c], order->rgba[c]);
    for (uint32_t i = 0; i < chunk->count; i++) {
        prefetch_record(chunk, order, i + RECORDS_AHEAD);
        prefetch_fragments(chunk, order, i + RECORDS_AHEAD / 2, &columns);
        const stamp_record *record = &chunk->records[order->stamps[i].number];
        const uint64_t to = (uint64_t)order->stamps[i].batch * TILE_LANES;
        uint64_t from = record->offset;
        for (uint64_t left = record->lanes; left;) {
            const uint32_t lane = (uint32_t)__builtin_ctzll(left);
            const uint64_t gaps = ~(left >> lane);
            const uint32_t count = gaps ? (uint32_t)__builtin_ctzll(gaps) : TILE_LANES;
            word_columns_copy(&columns, from, to + lane, count);
            for (uint32_t k = 0; order->primitive && k < count; k++)
                order->primitive[to + lane + k] = record->primitive;
            from += count;
            left &= ~(UINT64_MAX >> (TILE_LANES - count) << lane);
        }
    }
}

bool block_order_make(const stamp_chunk *chunk, const stamp_request *request, uint32_t tile_count, block_order *order)
{
    order->stamps = malloc(((size_t)chunk->count + 1) * sizeof *order->stamps);
    order->places = malloc(((size_t)chunk->count + 1) * sizeof *order->places);
    order->batches = malloc(((size_t)chunk->count + 1) * sizeof *order->batches);
    order->starts = calloc((size_t)tile_count + 2, sizeof *order->starts);
    if (!order->stamps || !order->places || !order->batches || !order->starts)
        return false;
    sort(chunk, tile_count, order);
    make_batches(chunk, order);
    if (!make_columns(request, order))
        return false;
    fill_columns(chunk, order);
    return true;
}
