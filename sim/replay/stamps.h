// A trace as stamps: what each primitive covers of each block of 64 samples, in order of arrival.
#ifndef ROPSIM_STAMPS_H
#define ROPSIM_STAMPS_H

#include "../levels.h"
#include "replay.h"

typedef struct stamp_record {
    uint64_t lanes;
    uint64_t offset;        // its fragments lie there in the chunk's columns, in order of lanes; if by_lanes, that of lane l lies l behind it
    uint32_t tile, primitive;
    uint32_t draw;
    uint32_t begun;         // primitives that begin in the chunk before this stamp
    bool begins_primitive;
    uint8_t fragments, quads;
    uint8_t place;          // of its first fragment in its pack (pack.c); 0: begins a pack
    uint32_t nearest, farthest;  // code of its fragments' depths, in stamp_request.range_format
} stamp_record;

// Stamps of a chunk block by block, each block's in order of arrival, and those of a block and draw that share no sample as batches
// of 64 lanes, whose columns are ready for dispatch (block_order.c).
typedef struct block_stamp {
    uint64_t lanes;
    uint32_t number;        // in order of arrival
    uint32_t batch;
} block_stamp;
typedef struct block_batch {
    uint64_t lanes, offset; // its stamps'
    uint32_t first, end;    // its stamps
    uint32_t last;          // number of the last of them
    uint32_t draw;
    uint32_t nearest, farthest;  // as a stamp_record's
} block_batch;
typedef struct block_order {
    block_stamp *stamps;
    uint32_t *places;       // of each stamp, in order of arrival: where among those it is
    uint32_t *starts;       // of each block, and one past the last one's end
    uint32_t *first_batches;  // the same of batches
    block_batch *batches;
    uint32_t batch_count;
} block_order;

typedef struct stamp_chunk {
    stamp_record *records;
    uint32_t count, capacity;
    uint32_t first_draw, last_draw;  // numbers between which its stamps' draws lie
    uint64_t fragment_count;
    bool by_lanes;                  // each batch of blocks has 64 places in a column; else fragments lie close
    uint64_t place_count, place_capacity;  // in each column
    uint32_t *codes[FORMAT_COUNT];  // of the formats asked for
    float *rgba[4];                 // if asked for
    uint32_t *primitive;            // the same, if by_lanes
    block_order blocks;             // if asked for
} stamp_chunk;

typedef struct stamp_request {
    uint32_t depth_formats;  // bit f: codes of format f
    format range_format;     // in which stamps know their range of depth, if it is one of these
    bool color;
    bool primitive;          // in columns, with `blocks`; records have it
    uint64_t memory_bytes;
    const uint8_t *tiles;    // NULL, or one a block: only those that are not 0
    uint32_t region_pixels;  // not 0: also put into order of regions
    bool blocks;             // also put into order of blocks, with columns by lanes
} stamp_request;

// Where the fragment of one of the stamp's lanes lies in the chunk's columns.
static inline uint64_t stamp_place_of(const stamp_chunk *chunk, const stamp_record *record, uint32_t lane)
{
    return record->offset + (chunk->by_lanes ? lane : count_lanes(record->lanes & ((1ull << lane) - 1)));
}

// A stamp in order of regions.
typedef struct stamp_place { uint32_t chunk, record; } stamp_place;

struct stamps {
    trace *trace;
    tiling tiling;
    stamp_request request;
    const report *report;
    stamp_chunk *chunks;     // all of them if they fit the budget, else the one being read
    uint32_t chunk_count, chunk_capacity;
    bool whole;              // all are there
    uint8_t *touched;        // one a block: it has a fragment
    uint64_t *primitives;    // of each draw: runs of stamps
    uint64_t *counts;        // of each draw: stamps
    uint64_t *region_pairs;  // of each draw: primitives times the regions they touch, if regions were asked for
    stamp_place *by_region;  // then: all stamps by region, each region's in order of arrival
    uint64_t stamp_count;
    struct stamp_pending *pending;
    uint32_t at;             // next chunk, if all are there
    bool ended;
};

// Reads the trace once. Free with stamps_destroy.
status stamps_make(trace *trace, const stamp_request *request, const report *report, stamps **stamps);
status stamps_rewind(stamps *stamps);
// The next chunk, NULL at the end; valid until the next call.
status stamps_next(stamps *stamps, const stamp_chunk **chunk);
// Both of a chunk that is complete and by_lanes; false: out of memory. Free also after a failure (block_order.c).
bool block_order_make(const stamp_chunk *chunk, uint32_t tile_count, block_order *order);
void block_order_free(block_order *order);
// What bins_count and bins_build make, of stamps that have been read and must outlive it (bins_share.c): of the whole image, without `draw`
// and `depth`, and a sample's fragments may lie in later batches. Free both also after a failure.
bool bins_can_share(const stamps *stamps);
// `format`: in which batches are to know their depths.
status bins_share(const stamps *stamps, format format, const report *report, sample_counts *counts, bins *bins);
// The number of the region that a block lies in, by rows.
uint32_t stamps_region(const stamps *stamps, uint32_t tile);

#endif
