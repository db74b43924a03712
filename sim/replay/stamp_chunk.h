// Room for stamps and their fragments.
#ifndef ROPSIM_STAMP_CHUNK_H
#define ROPSIM_STAMP_CHUNK_H

#include "lane_runs.h"
#include "stamps.h"

// Room for `length` elements of `size` bytes in what `array`, the address of a pointer, points to; false: none.
bool array_reserve(void *array, uint64_t length, uint64_t size);
// Has a run's columns go to the chunk's.
void stamp_chunk_columns(const stamp_chunk *chunk, const stamp_request *request, word_columns *columns);
// Room for so many fragments in all. False: out of memory.
bool stamp_chunk_resize(stamp_chunk *chunk, const stamp_request *request, uint64_t capacity);
// Room for more; columns follow the chunk's when these move. False: out of memory.
bool stamp_chunk_reserve(stamp_chunk *chunk, const stamp_request *request, uint64_t fragments, uint32_t records, word_columns *columns);
uint64_t stamp_fragment_bytes(const stamp_request *request);  // in columns
uint64_t stamp_chunk_bytes(const stamp_chunk *chunk, const stamp_request *request);
void stamp_chunk_free(stamp_chunk *chunk);

#endif
