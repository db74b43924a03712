// What the files of the ticking machine share.
#ifndef ROPSIM_TEST_TICK_PARTS_H
#define ROPSIM_TEST_TICK_PARTS_H

#include "tick.h"

#include <assert.h>

enum { TICK_ONE = 1 << 20, TICK_UNITS_MAX = 3, TICK_MISSES = 4096 };
#define TICK_NEVER UINT64_MAX

// ---- Memory: one channel and one slice of the second level a partition (tick_memory.c) ----------------

typedef struct tick_memory tick_memory;
tick_memory *tick_memory_create(const machine *machine);
void tick_memory_destroy(tick_memory *memory);
// Where the cycle in which data are there will stand, TICK_NEVER until it is known. Valid until the pass ends.
const uint64_t *tick_memory_fetch(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer);
const uint64_t *tick_memory_read(tick_memory *memory, uint32_t partition, uint64_t cycle, uint64_t address,
                                 uint32_t bytes);
// A line written back, to memory or to the second level; what the second level writes to make room for a transfer; any
// other write. False: the channel does not take it in this cycle.
bool tick_memory_spill(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer);
bool tick_memory_make_room(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer);
bool tick_memory_write(tick_memory *memory, uint32_t partition, uint64_t cycle, uint64_t address, uint32_t bytes);
void tick_memory_advance(tick_memory *memory, uint64_t cycle);
uint64_t tick_memory_drain(tick_memory *memory, uint32_t partition, uint64_t cycle);  // when all data have ended
void tick_memory_forget(tick_memory *memory);                     // the places of answers, at the end of a pass

uint64_t tick_memory_bytes(const tick_memory *memory, bool written);  // that channels took

// ---- Work (tick_work.c) --------------------------------------------------------------------------------

typedef enum unit_kind { UNIT_SHADER, UNIT_DEPTH, UNIT_COLOR, UNIT_KERNEL } unit_kind;
// Time that a stamp's operation takes in a unit, in 2^-20 cycles.
uint64_t tick_work(const machine *machine, const frame *frame, unit_kind unit, const stamp *stamp,
                   uint32_t shader_operations);
uint64_t tick_texture_work(const machine *machine, const frame *frame, const stamp *stamp);
// The lanes that the operation is on.
uint64_t tick_lanes(unit_kind unit, const stamp *stamp);
// Of the quad whose first lane is the lowest of `quads`.
uint64_t tick_bucket(uint32_t tile, uint64_t quads, uint64_t buckets);

// ---- The machine (tick.c) ------------------------------------------------------------------------------

typedef struct touched {
    line_touch touch;
    access_unit cache;
} touched;

// A stamp in one unit of its partition.
typedef struct visit {
    unit_kind unit;
    uint64_t work, second_work;      // 2^-20 cycles; second: texture reads, at the same time
    uint64_t lanes;                  // that the operation is on, for the interlock
    touched *touches;
    int touch_count, looked_up, step;  // step: how far the lookup at hand has come
    uint64_t arrived, begun, may_operate, operates, ends, done;  // cycles; operates, ends: 2^-20; TICK_NEVER: not yet
    struct slot *data;               // of each touch: when its line is there
    bool streams, streamed;          // lists: at the beginning, before all lookups
    const uint64_t *stream_data;
} visit;

// When a line is there: `extra` cycles after what memory answers, and not before `not_before`.
typedef struct slot {
    const uint64_t *answer;  // NULL: nothing was asked
    uint64_t extra, not_before;
} slot;

typedef struct item {
    uint32_t partition, tile, quads;
    uint64_t primitive;
    bool hierarchical;
    uint64_t stream_address;
    uint32_t stream_read, stream_written;
    visit visits[TICK_UNITS_MAX];
} item;

typedef struct partition {
    uint32_t *order;                 // items that left the rasterizer for it
    uint32_t left;
    uint32_t begun[TICK_UNITS_MAX], operating[TICK_UNITS_MAX], first_busy[TICK_UNITS_MAX];
    uint64_t port_free[TICK_UNITS_MAX];
    uint64_t first_free[TICK_UNITS_MAX], second_free[TICK_UNITS_MAX];  // 2^-20 cycles: the unit, and its texture reads
    slot *pending[ACCESS_UNITS];
    uint32_t pending_count[ACCESS_UNITS];
    slot *slots[ACCESS_UNITS];
    uint64_t flush_cycle;
} partition;

typedef struct flushed {
    uint32_t partition;
    transfer transfer;
} flushed;

struct tick {
    const machine *machine;
    const frame *frame;
    uint32_t slot_counts[ACCESS_UNITS];
    tick_memory *memory;
    partition *partitions;
    pass_info pass;
    int units;
    unit_kind kinds[TICK_UNITS_MAX];
    item *items;
    uint32_t item_count, item_capacity, leaving;
    uint32_t flush_count, flush_capacity;
    flushed *flushes;
    uint64_t start, now, last_fragment, clear_end;
    // Rasterizer and set-up:
    uint64_t raster_free;            // 2^-20 cycles
    uint64_t lines, lines_asked, primitive, geometry, geometry_start;
    uint64_t *set_up, *begun;        // of each primitive: in 2^-20 cycles, and when its first stamp left
    uint64_t set_up_count;
    const uint64_t **line_answers;
};

static inline uint64_t up(uint64_t fraction)
{
    return (fraction + TICK_ONE - 1) / TICK_ONE;
}

static inline uint64_t longer(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

static inline void note_done(tick *t, uint64_t cycle)
{
    t->last_fragment = cycle > t->last_fragment ? cycle : t->last_fragment;
}

// a * b / c, rounded up.
uint64_t tick_divided_up(uint64_t a, uint64_t b, uint64_t c);

// tick_front.c. A step is something that can be done in this cycle; false: there is nothing.
void tick_start_geometry(tick *tick);
bool tick_step_rasterizer(tick *tick);
bool tick_lines_there(const tick *tick, uint64_t count);
bool tick_step_unit(tick *tick, uint32_t partition, int unit);  // tick_unit.c

#endif
