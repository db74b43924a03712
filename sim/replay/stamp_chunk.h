// Room for stamps and their fragments.
#ifndef ROPSIM_STAMP_CHUNK_H
#define ROPSIM_STAMP_CHUNK_H

#include "lane_runs.h"
#include "stamps.h"

// The batch that a block's next stamp may go to. end: of its places; 0: there is none.
typedef struct open_batch { uint64_t lanes, end; uint32_t draw; } open_batch;

// Room for `length` elements of `size` bytes in what `array`, the address of a pointer, points to; false: none.
bool array_reserve(void *array, uint64_t length, uint64_t size);
// Has a run's columns go to the chunk's, as many.
void stamp_chunk_columns(const stamp_chunk *chunk, const stamp_request *request, word_columns *columns);
// Room for so many places in all. False: out of memory.
bool stamp_chunk_resize(stamp_chunk *chunk, const stamp_request *request, uint64_t capacity);
// Room for more, however they are spread over batches; columns follow the chunk's when these move. False: out of memory.
bool stamp_chunk_reserve(stamp_chunk *chunk, const stamp_request *request, uint64_t fragments, uint32_t records, word_columns *columns);
// Takes places, for which there is room, for a stamp's fragments; returns where they begin (stamp_record.offset). `batch` (columns by lanes): that
// of the stamp's block; it becomes another if its draw is, or has one of the stamp's samples.
uint64_t stamp_chunk_place(stamp_chunk *chunk, const stamp_request *request, open_batch *batch, uint32_t draw, uint64_t lanes);
uint64_t stamp_place_bytes(const stamp_request *request);  // in all columns
uint64_t stamp_chunk_bytes(const stamp_chunk *chunk, const stamp_request *request);
void stamp_chunk_free(stamp_chunk *chunk);

#endif
