// A block to the byte planes that zstd packs well, and back.
#ifndef ROPSIM_TRACE_COLUMNS_H
#define ROPSIM_TRACE_COLUMNS_H

#include "block.h"

// Working memory of both directions, 2 MB. Free with free().
typedef struct columns columns;
columns *columns_create(void);

// Bytes of `count` fragments as planes: 33 a fragment, 29 with depth_bits 32.
size_t columns_bytes(uint32_t count, int depth_bits);
void columns_encode(columns *columns, const block *block, int depth_bits, uint8_t *planes);
// Fills a block of block->count fragments. Any bytes decode to some block: check it with block_check.
const uint8_t *columns_decode_places(const uint8_t *planes, block *block);  // x, y and sample alone; the planes behind them
void columns_decode(columns *columns, const uint8_t *planes, int depth_bits, block *block);

#endif
