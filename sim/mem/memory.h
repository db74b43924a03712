// What the files of the memory model share: layout.c places blocks, memory.c meets passes and stamps, touch.c looks up lines,
// settle.c those that are not all there, fetch.c moves them, flush.c ends passes, unseen.c is for sampling.
#ifndef ROPSIM_MEMORY_H
#define ROPSIM_MEMORY_H

#include "cache.h"

// How a plane lies in memory. Each partition has its own address space: its channel's.
typedef struct plane_layout {
    uint32_t parts;         // lines of a block, a power of two
    uint32_t part_shift;    // each has 1 << part_shift lanes
    uint64_t first_lanes;   // those of the first
    uint32_t part_bytes;    // uncompressed
    uint32_t state_bytes[5];  // whole bursts that a part takes in memory, by its state
    uint32_t part_stride;   // from one to the next: a power of two, so that no part crosses a row
    uint64_t base;
    uint32_t first_line;    // the first part's number among the lines of all planes of a block
    access_unit unit;       // whose cache the ROP uses
    bool compressed;        // its blocks may be
    bool on_chip;           // tile-based: stays there during a pass
    bool one_line;          // of a block, which the ROP has in a cache
    uint32_t chip_slot;     // tile-based: its first line's number among those of one block
    uint8_t *states;        // of each part of each block: quarters that it takes in memory, STATE_CLEARED: none
} plane_layout;
enum { STATE_CLEARED = 0, STATE_WHOLE = 4, STATE_UNKNOWN };  // unknown: sampling passed it over; its content tells

// Where a block belongs.
typedef struct home {
    uint64_t lanes;         // those inside the image
    uint32_t number;        // in its partition
    uint32_t region;        // tile-based: plus 1
    uint32_t region_block;  // tile-based: its number in the region
    uint8_t partition;
} home;

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
    home *homes;            // of each block
    uint32_t *blocks;       // of each partition
    cache (*caches)[ACCESS_UNITS];  // of each partition
    cache *l2;              // of each partition; NULL: none
    // The slot in which each line of each block was put last. Depth and colour share one: a plane is in the cache of one of them.
    uint32_t block_lines;   // of all planes
    uint32_t *slots[ACCESS_UNITS], *l2_slots;
    region_memory *regions; // one a partition, or NULL
    uint32_t chip_lines;    // lines of a block that stay on the chip
    uint32_t region_blocks; // blocks of a region
    uint64_t *stream_bytes; // of each partition: lists of fragments so far
    uint64_t stream_base;
    plane_traffic traffic[PLANE_MAX];
    stamp_lines out;
    line_touch *touches[ACCESS_UNITS];
    pass_info pass;         // at hand
    statistics ignored;     // what stamps would count that nobody counts
    uint64_t oldest_of_pass;  // sampling: age of its first use of a cache
    uint64_t latest;        // sampling: age of the latest use
    uint64_t stream_read, stream_written, geometry_read, geometry_written;
    // What a flush has still to visit:
    uint32_t flush_partition, flush_cache, flush_line;
    uint32_t l2_partition, l2_line;
    bool flush_clear;       // the pass was a clear that writes
    uint8_t clear_plane;
    uint32_t clear_tile, clear_part;
};

// Bursts divide lines, so they are a power of two.
static inline uint32_t round_to_bursts(const memory *m, uint32_t bytes)
{
    const uint32_t burst = (uint32_t)m->machine->memory_burst_bytes;
    return (bytes + burst - 1) & ~(burst - 1);
}
static inline uint64_t line_id(line_place at) { return (uint64_t)at.plane << 48 | (uint64_t)at.tile << 8 | at.part; }
static inline line_place line_of(uint64_t id) { return (line_place){(uint8_t)(id >> 48), (uint32_t)(id >> 8), (uint32_t)(id & 255)}; }
static inline uint64_t part_lanes(const plane_layout *plane, uint32_t part)
{
    return plane->first_lanes << (part << plane->part_shift);
}
// A line's lanes inside the image.
static inline uint64_t lanes_of(const memory *m, line_place at)
{
    return part_lanes(&m->planes[at.plane], at.part) & m->homes[at.tile].lanes;
}
// The part of the lowest of these lanes.
static inline uint32_t first_part(const plane_layout *plane, uint64_t lanes)
{
    return (uint32_t)__builtin_ctzll(lanes) >> plane->part_shift;
}
// Its place in arrays over the lines of all blocks.
static inline size_t line_number(const memory *m, line_place at)
{
    return (size_t)at.tile * m->block_lines + m->planes[at.plane].first_line + at.part;
}
// How many quarters it takes in memory, or another STATE_.
static inline uint8_t *state_of(const memory *m, line_place at)
{
    const plane_layout *plane = &m->planes[at.plane];
    return &plane->states[(size_t)at.tile * plane->parts + at.part];
}
status layout_make(memory *m);  // layout.c
uint64_t line_address(const memory *m, line_place at);
uint32_t line_set(const memory *m, const cache *cache, line_place at);

// A line of which these lanes are there is fetched if others are read, or if it cannot be written without the rest; bytes and
// the second level are settled (fetch.c). `all`: its lanes inside the image. Which lanes are there then.
uint64_t complete_line(memory *m, line_place at, uint64_t all, uint64_t valid, uint64_t read, uint64_t written, statistics *s, line_touch *touch);
// A changed line goes back.
void write_line(memory *m, line_place at, uint64_t valid, uint64_t dirty, statistics *s, transfer *spill);

// A changed line of the second level goes to memory.
transfer l2_write_back(memory *m, line_place at, statistics *s);

// A stamp's lines are looked up: m->out has the touches (touch.c).
void touch_planes(memory *m, const stamp *stamp, statistics *s);
// One of them that is not there, or not all of it (settle.c). `lanes`: those inside the image; `slot`: where m->slots has its slot, which
// is returned.
uint32_t settle_line(memory *m, const plane_access *access, uint64_t id, uint64_t lanes, cache *cache, uint32_t *slot, statistics *s, line_touch *touch);

// Tile-based (region.c).
status region_make(memory *m);
void region_free(memory *m);
// Where a block's region is not the last one of its partition: writes back what was changed there.
void region_enter(memory *m, uint32_t tile, statistics *s, int *count);
bool region_flush(memory *m, uint32_t partition, statistics *s, transfer *spill);  // the next changed line at a pass's end
// The parts of a plane that stays on the chip. How many were touched.
int region_touch(memory *m, uint32_t tile, const plane_access *access, statistics *s, line_touch *touches);

#endif
