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
// The quads that the operation is on, as a mask of each quad's first lane.
uint64_t tick_quads(const frame *frame, unit_kind unit, const stamp *stamp);
// Of the quad whose first lane is the lowest of `quads`.
uint64_t tick_bucket(uint32_t tile, uint64_t quads, uint64_t buckets);

#endif
