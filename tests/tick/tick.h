// The machine of docs/machine.md once more, in the slow way, to measure how well sim/mem and sim/clock keep to that page.
//
// Two models that know nothing of each other and share no code with sim/mem and sim/clock, but for the size of a compressed
// block (compress_quarters) and the record of a lookup (line_touch). Time: every core cycle looks at every unit of every
// partition, the last of the pipeline first, and at the rasterizer, until nothing more can be done in that cycle; memory
// ticks each of its clocks (tests/unit/channel_ticks.h). Traffic: caches as arrays that are searched from end to end.
#ifndef ROPSIM_TEST_TICK_H
#define ROPSIM_TEST_TICK_H

#include "../../sim/levels.h"

// ---- Time ----------------------------------------------------------------------------------------------

typedef struct tick tick;

// Gives up, with a message on stderr, on a machine that waits for ever.
tick *tick_create(const machine *machine, const frame *frame, const uint32_t slots[ACCESS_UNITS]);
void tick_destroy(tick *tick);  // NULL is fine
void tick_begin_pass(tick *tick, const pass_info *pass);
void tick_stamp(tick *tick, const stamp *stamp, const stamp_lines *lines);  // keeps copies
void tick_end_stamps(tick *tick);
void tick_flush(tick *tick, uint32_t partition, access_unit cache, const transfer *transfer);
void tick_end_pass(tick *tick);
uint64_t tick_now(const tick *tick);            // cycle at which the last pass was drained
uint64_t tick_last_fragment(const tick *tick);  // cycle at which its last stamp was done
uint64_t tick_bytes(const tick *tick, bool written);  // that went through its channels

// ---- Traffic -------------------------------------------------------------------------------------------

typedef struct traffic traffic;
traffic *traffic_create(const machine *machine, const frame *frame);
void traffic_destroy(traffic *traffic);  // NULL is fine
void traffic_begin_pass(traffic *traffic, const pass_info *pass);
void traffic_stamp(traffic *traffic, const stamp *stamp);
void traffic_end_pass(traffic *traffic);
void traffic_end_run(traffic *traffic);         // what the second level still holds
// Counts since the start; only those of the level traffic that caches, geometry and lists cause are kept.
const statistics *traffic_counts(const traffic *traffic);
const plane_traffic *traffic_planes(const traffic *traffic);

#endif
