// What the files of the memory model share: layout.c places blocks, memory.c meets stamps, fetch.c moves lines, flush.c ends passes.
#ifndef ROPSIM_MEMORY_H
#define ROPSIM_MEMORY_H

#include "cache.h"

// How a plane lies in memory. Each partition has its own address space: its channel's.
typedef struct plane_layout {
    uint32_t parts;         // lines of a block, a power of two
    uint32_t part_lanes;    // lanes of each
    uint32_t part_bytes;    // uncompressed
    uint32_t part_stride;   // from one to the next: a power of two, so that no part crosses a row
    uint64_t base;
    access_unit unit;       // whose cache the ROP uses
    bool compressed;        // its blocks may be
    bool on_chip;           // tile-based: stays there during a pass
    uint32_t chip_slot;     // tile-based: its first line's number among those of one block
    uint8_t *states;        // of each part of each block: quarters that it takes in memory, STATE_CLEARED: none
} plane_layout;
enum { STATE_CLEARED = 0, STATE_WHOLE = 4 };

typedef struct line_place { uint8_t plane; uint32_t tile, part; } line_place;

// The lines of a region that are on the chip.
typedef struct chip_line { uint64_t valid, dirty; bool there; line_place place; } chip_line;
typedef struct region_memory {
    chip_line *lines;       // block of the region * lines a block + line
    uint32_t *used;         // those that are there
    uint32_t used_count;
    uint32_t region;        // plus 1; 0: none yet
} region_memory;

struct memory {
    const machine *machine;
    const frame *frame;
    const report *report;
    plane_layout planes[PLANE_MAX];
    uint8_t *partition_of;  // of each block
    uint32_t *local_of;     // its number in its partition
    uint32_t *blocks;       // of each partition
    uint64_t *valid;        // lanes of each block inside the image
    cache *caches[ACCESS_UNITS];  // one a partition
    cache *l2;              // NULL: none
    region_memory *regions; // one a partition, or NULL
    uint32_t chip_lines;    // lines of a block that stay on the chip
    uint32_t region_blocks; // blocks of a region
    uint64_t *stream_bytes; // of each partition: lists of fragments so far
    uint64_t stream_base;
    plane_traffic traffic[PLANE_MAX];
    stamp_lines out;
    line_touch *touches[ACCESS_UNITS];
    pass_info pass;         // at hand
    uint64_t stream_read, stream_written, geometry_read, geometry_written;
    // What a flush has still to visit:
    uint32_t flush_partition, flush_cache, flush_line;
    uint32_t l2_partition, l2_line;
    bool flush_clear;       // the pass was a clear that writes
    uint8_t clear_plane;
    uint32_t clear_tile, clear_part;
};

uint32_t round_to_bursts(const memory *m, uint32_t bytes);
static inline uint64_t line_id(line_place at) { return (uint64_t)at.plane << 48 | (uint64_t)at.tile << 8 | at.part; }
static inline line_place line_of(uint64_t id) { return (line_place){(uint8_t)(id >> 48), (uint32_t)(id >> 8), (uint32_t)(id & 255)}; }
static inline uint64_t part_lanes(const plane_layout *plane, uint32_t part)
{
    return (plane->part_lanes == 64 ? UINT64_MAX : (1ull << plane->part_lanes) - 1) << part * plane->part_lanes;
}
status layout_make(memory *m);  // layout.c
uint64_t line_address(const memory *m, line_place at);
uint32_t line_set(const memory *m, const cache *cache, line_place at);

// A line is wanted whole, or goes back; bytes and the second level are settled (fetch.c). False: nothing moves.
bool fetch_line(memory *m, line_place at, statistics *s, transfer *fill);
void write_line(memory *m, line_place at, uint64_t valid, uint64_t dirty, statistics *s, transfer *spill);
// Whether a write of these lanes needs the rest of the line first; without a transfer where the state alone tells it.
bool write_needs_fill(const memory *m, line_place at, uint64_t written);

// A changed line of the second level goes to memory.
transfer l2_write_back(memory *m, line_place at, statistics *s);

// Tile-based (region.c).
status region_make(memory *m);
void region_free(memory *m);
// Where a block's region is not the last one of its partition: writes back what was changed there.
void region_enter(memory *m, uint32_t tile, statistics *s, int *count);
bool region_flush(memory *m, uint32_t partition, statistics *s, transfer *spill);  // the next changed line at a pass's end
void region_touch(memory *m, uint32_t partition, line_place at, uint64_t read, uint64_t written, statistics *s, line_touch *touch);

#endif
