// The fixed-size records of the binary form, as bytes and as structs. docs/trace.md is their specification.
#ifndef ROPSIM_TRACE_RECORDS_H
#define ROPSIM_TRACE_RECORDS_H

#include "block.h"

enum {
    HEADER_BYTES = 128,
    HEADER_CONTENT = 16,  // bytes 16 to 119 say what the trace is; the hash of the whole starts with them
    HEADER_CHECKSUM = 120,
    DRAW_BYTES = 96,
    CHUNK_BYTES = 56,
    TRAILER_BYTES = 64,
    TRAILER_CHECKSUM = 56,
    TRACE_VERSION = 1,
};

extern const uint8_t header_magic[8], trailer_magic[8];

typedef struct chunk_record {
    uint64_t offset;        // of its zstd frame in the file
    uint32_t stored_bytes;  // of the frame
    uint32_t draw, count;
    bounds bounds;
    uint64_t checksum;  // XXH3-64 of the frame
    uint8_t digest[DIGEST_BYTES];
} chunk_record;

typedef struct trailer_record {
    uint64_t table_offset;  // of the first draw record; chunk records follow the draws, the trailer follows them
    uint32_t draw_count;
    uint64_t chunk_count, fragment_count;
    uint8_t hash[DIGEST_BYTES];
    uint64_t checksum;  // XXH3-64 of all draw and chunk records and the trailer before this field
} trailer_record;

void header_encode(const trace_info *info, uint8_t bytes[HEADER_BYTES]);
// Checks every field. False: `why` says which, with its offset.
bool header_decode(const uint8_t bytes[HEADER_BYTES], trace_info *info, char why[WHY_SIZE]);
void draw_encode(const trace_draw *draw, uint8_t bytes[DRAW_BYTES]);
bool draw_decode(const uint8_t bytes[DRAW_BYTES], trace_draw *draw, char why[WHY_SIZE]);
void chunk_encode(const chunk_record *chunk, uint8_t bytes[CHUNK_BYTES]);
void chunk_decode(const uint8_t bytes[CHUNK_BYTES], chunk_record *chunk);
void trailer_encode(const trailer_record *trailer, uint8_t bytes[TRAILER_BYTES]);
bool trailer_decode(const uint8_t bytes[TRAILER_BYTES], trailer_record *trailer, char why[WHY_SIZE]);

#endif
