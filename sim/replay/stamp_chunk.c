// The memory of a chunk of stamps.
#include "stamp_chunk.h"

#include <stdlib.h>
#include <string.h>

bool array_reserve(void *array, uint64_t length, uint64_t size)
{
    void **const pointer = array;
    void *grown = realloc(*pointer, (size_t)((length ? length : 1) * size));
    if (grown)
        *pointer = grown;
    return grown;
}

void stamp_chunk_free(stamp_chunk *chunk)
{
    free(chunk->records);
    for (int f = 0; f < FORMAT_COUNT; f++)
        free(chunk->codes[f]);
    for (int c = 0; c < 4; c++)
        free(chunk->rgba[c]);
    free(chunk->primitive);
    block_order_free(&chunk->blocks);
    *chunk = (stamp_chunk){0};
}

void stamp_chunk_columns(const stamp_chunk *chunk, const stamp_request *request, word_columns *columns)
{
    uint32_t count = 0;
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (request->depth_formats >> f & 1)
            columns->to[count++] = chunk->codes[f];
    for (int c = 0; request->color && c < 4; c++)
        columns->to[count++] = chunk->rgba[c];
    if (chunk->by_lanes && request->primitive)
        columns->to[count++] = chunk->primitive;
    columns->count = count;
}

bool stamp_chunk_resize(stamp_chunk *chunk, const stamp_request *request, uint64_t capacity)
{
    bool good = true;  // behind the last fragment, a whole block may be read
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (request->depth_formats >> f & 1)
            good = good && array_reserve(&chunk->codes[f], capacity + TILE_LANES, sizeof(uint32_t));
    for (int c = 0; request->color && c < 4; c++)
        good = good && array_reserve(&chunk->rgba[c], capacity + TILE_LANES, sizeof(float));
    if (chunk->by_lanes && request->primitive)
        good = good && array_reserve(&chunk->primitive, capacity + TILE_LANES, sizeof *chunk->primitive);
    if (good)
        chunk->place_capacity = capacity;
    return good;
}

bool stamp_chunk_reserve(stamp_chunk *chunk, const stamp_request *request, uint64_t fragments, uint32_t records, word_columns *columns)
{
    const uint64_t places = chunk->by_lanes ? (uint64_t)records * TILE_LANES : fragments;
    bool good = true;
    if (chunk->place_count + places > chunk->place_capacity) {
        good = stamp_chunk_resize(chunk, request, 2 * (chunk->place_count + places));
        stamp_chunk_columns(chunk, request, columns);
    }
    if (good && chunk->count + records > chunk->capacity) {
        good = array_reserve(&chunk->records, 2 * (uint64_t)(chunk->count + records), sizeof *chunk->records);
        if (good)
            chunk->capacity = 2 * (chunk->count + records);
    }
    return good;
}

// Lanes without a fragment are read, if not used.
static void clear_batch(const stamp_chunk *chunk, const stamp_request *request)
{
    word_columns columns;
    stamp_chunk_columns(chunk, request, &columns);
    for (uint32_t c = 0; c < columns.count; c++)
        memset((uint32_t *)columns.to[c] + chunk->place_count, 0, TILE_LANES * sizeof(uint32_t));
}

uint64_t stamp_chunk_place(stamp_chunk *chunk, const stamp_request *request, open_batch *batch, uint32_t draw, uint64_t lanes)
{
    if (!batch) {
        chunk->place_count += count_lanes(lanes);
        return chunk->place_count - count_lanes(lanes);
    }
    if (!batch->end || batch->draw != draw || (batch->lanes & lanes)) {
        if (lanes != UINT64_MAX)
            clear_batch(chunk, request);
        chunk->place_count += TILE_LANES;
        *batch = (open_batch){.end = chunk->place_count, .draw = draw};
    }
    batch->lanes |= lanes;
    return batch->end - TILE_LANES;
}

uint64_t stamp_place_bytes(const stamp_request *request)
{
    return 4 * (uint64_t)__builtin_popcount(request->depth_formats) + (request->color ? 16 : 0) + (request->blocks && request->primitive ? 4 : 0);
}

uint64_t stamp_chunk_bytes(const stamp_chunk *chunk, const stamp_request *request)
{
    const block_order *blocks = &chunk->blocks;
    const uint64_t in_blocks = blocks->stamps ? chunk->count * (sizeof *blocks->stamps + sizeof *blocks->places) + blocks->batch_count * sizeof *blocks->batches : 0;
    return chunk->place_capacity * stamp_place_bytes(request) + chunk->capacity * sizeof *chunk->records + in_blocks;
}
