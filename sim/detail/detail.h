// What the files of a run at a deeper level share: detail.c runs it, sampled.c measures parts of it, and estimate.c tells from those what all
// of it would be.
#ifndef ROPSIM_DETAIL_H
#define ROPSIM_DETAIL_H

#include "../levels.h"

typedef struct sampled_window {
    statistics statistics;
    double waiting;              // by how many stamps the queues grew
    double primitives, paced;    // that began; those of them that nothing but set-up kept waiting
} sampled_window;

// Of the level sampled: what was measured of the pass at hand.
typedef struct sampler {
    stamp_phase phase;
    bool any;                    // a phase was told
    statistics at;               // when the phase began
    uint64_t front;              // and where the rasterizer was
    uint64_t begun, paced;       // primitives that had begun
    statistics exact, head;      // of the pass: what is not sampled; its first stamps
    uint64_t waiting;            // stamps that were in queues
    sampled_window *windows;
    uint32_t window_count, window_capacity;
    uint64_t head_stamps, head_waiting;  // of the head; those of them in queues at its end
    uint64_t head_primitives;    // that began in it
    bool filled;                 // queues became deeper behind it (PHASE_FILL)
    double variances[STATISTIC_COUNT + 1];  // of the sum over all passes so far; the last: of memory bytes read and written
    double allowed[STATISTIC_COUNT + 1];    // of those sums: for what leads leave wrong, of what comes from windows and varies between them
    uint64_t freedom;            // degrees of
} sampler;

typedef struct detail {
    const machine *machine;
    const report *report;
    arrival *arrival;
    memory *memory;
    clock_state *clock;          // NULL at the level traffic
    detail_result *result;
    uint64_t pass_capacity, iteration_capacity;
    pass_record record;          // of the pass at hand
    statistics before_pass, before_draw;
    uint32_t draw;               // whose stamps come now; UINT32_MAX: none's
    timeline *timeline;          // NULL: none
    statistics raw;              // what models count
    sampler *sampler;            // NULL: every stamp is looked at
} detail;

// detail.c
status detail_keep_record(detail *detail);
status detail_flush(detail *detail, bool last);
int detail_busiest(const uint64_t bounds[RESOURCE_COUNT], uint64_t cycles);

// sampled.c: what a sink does.
status sampled_begin_pass(void *user, const pass_info *pass);
status sampled_stamp(void *user, const stamp *stamp);
status sampled_warm(void *user, const stamp *stamp, const uint64_t *times);
void sampled_skip(void *user, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time);
uint64_t sampled_waiting(void *user);
status sampled_phase(void *user, stamp_phase phase, uint64_t begun);
status sampled_end_pass(void *user);
status sampled_drain(detail *detail, const pass_info *pass);  // of the second level, as a pass of its own

// estimate.c: adds to the record at hand the sum over all stamps behind the head, `waiting` of which wait at the end, and its variance to those of
// the passes before; the intervals, when all passes have ended.
void estimate_pass(detail *detail, uint64_t stamps, uint64_t waiting);
void estimate_half_widths(detail *detail);

#endif
