// The memory of a chunk of stamps.
#include "stamp_chunk.h"

#include <stdlib.h>

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
}

bool stamp_chunk_resize(stamp_chunk *chunk, const stamp_request *request, uint64_t capacity)
{
    bool good = true;  // behind the last fragment, a whole block may be read
    for (int f = 0; f < FORMAT_COUNT; f++)
        if (request->depth_formats >> f & 1)
            good = good && array_reserve(&chunk->codes[f], capacity + TILE_LANES, sizeof(uint32_t));
    for (int c = 0; request->color && c < 4; c++)
        good = good && array_reserve(&chunk->rgba[c], capacity + TILE_LANES, sizeof(float));
    if (good)
        chunk->fragment_capacity = capacity;
    return good;
}

bool stamp_chunk_reserve(stamp_chunk *chunk, const stamp_request *request, uint64_t fragments, uint32_t records, word_columns *columns)
{
    bool good = true;
    if (chunk->fragment_count + fragments > chunk->fragment_capacity) {
        good = stamp_chunk_resize(chunk, request, 2 * (chunk->fragment_count + fragments));
        stamp_chunk_columns(chunk, request, columns);
    }
    if (good && chunk->count + records > chunk->capacity) {
        good = array_reserve(&chunk->records, 2 * (uint64_t)(chunk->count + records), sizeof *chunk->records);
        if (good)
            chunk->capacity = 2 * (chunk->count + records);
    }
    return good;
}

uint64_t stamp_fragment_bytes(const stamp_request *request)
{
    return 4 * (uint64_t)__builtin_popcount(request->depth_formats) + (request->color ? 16 : 0);
}

uint64_t stamp_chunk_bytes(const stamp_chunk *chunk, const stamp_request *request)
{
    const uint64_t each = stamp_fragment_bytes(request);
    const block_order *blocks = &chunk->blocks;
    const uint64_t in_blocks = blocks->batch_count * (TILE_LANES * (each + 4 * request->primitive)) +
                               (blocks->stamps ? chunk->count * (sizeof *blocks->stamps + sizeof *blocks->places + sizeof *blocks->batches) : 0);
    return chunk->fragment_capacity * each + chunk->capacity * sizeof *chunk->records + in_blocks;
}
