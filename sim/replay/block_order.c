// A chunk of stamps in, the same stamps block by block out.
//
// Sampling passes over most stamps of a pass and runs them later, block by block. Their fragments lie in batches ready for dispatch as
// soon as they are read; here each block's are found.
#include "stamps.h"

#include <stdlib.h>

enum { RECORDS_AHEAD = 16 };  // that are asked for before they are needed

void block_order_free(block_order *order)
{
    free(order->stamps);
    free(order->places);
    free(order->batches);
    free(order->starts);
    free(order->first_batches);
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

// Stamps whose fragments were put into one batch's places (stamps.c) make a batch.
static void make_batches(const stamp_chunk *chunk, block_order *order)
{
    const stamp_record *before = NULL;
    for (uint32_t i = 0; i < chunk->count; i++) {
        prefetch_record(chunk, order, i + RECORDS_AHEAD);
        const stamp_record *record = &chunk->records[order->stamps[i].number];
        block_batch *batch = &order->batches[order->batch_count - !!before];
        if (!before || before->offset != record->offset) {
            batch = &order->batches[order->batch_count++];
            *batch = (block_batch){.offset = record->offset, .first = i, .draw = record->draw, .nearest = UINT32_MAX};
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

bool block_order_make(const stamp_chunk *chunk, uint32_t tile_count, block_order *order)
{
    order->stamps = malloc(((size_t)chunk->count + 1) * sizeof *order->stamps);
    order->places = malloc(((size_t)chunk->count + 1) * sizeof *order->places);
    order->batches = malloc(((size_t)chunk->place_count / TILE_LANES + 1) * sizeof *order->batches);
    order->starts = calloc((size_t)tile_count + 2, sizeof *order->starts);
    order->first_batches = malloc(((size_t)tile_count + 1) * sizeof *order->first_batches);
    if (!order->stamps || !order->places || !order->batches || !order->starts || !order->first_batches)
        return false;
    sort(chunk, tile_count, order);
    make_batches(chunk, order);
    for (uint32_t t = 0; t <= tile_count; t++)
        order->first_batches[t] = order->starts[t] < chunk->count ? order->stamps[order->starts[t]].batch : order->batch_count;
    return true;
}
