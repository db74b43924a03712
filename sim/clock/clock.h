// What the files of the timing model share: clock.c makes it and runs passes, unit.c is one unit of a partition, front.c
// the geometry and the rasterizer, charge.c what work costs.
//
// Nothing ticks: each unit says when it can do its next step, and the earliest one does it, so that steps are done in
// order of time and each sees all that came before it. docs/machine.md has the rules step by step.
#ifndef ROPSIM_CLOCK_H
#define ROPSIM_CLOCK_H

#include "../levels.h"
#include "channel.h"
#include "divisor.h"

// Work is counted in parts of a cycle, so that rates need not divide each other.
#define CYCLE_PARTS (UINT64_C(1) << 20)
#define NEVER UINT64_MAX

static inline uint64_t later(uint64_t a, uint64_t b) { return a > b ? a : b; }
static inline uint64_t cycles_up(uint64_t parts) { return (parts + CYCLE_PARTS - 1) / CYCLE_PARTS; }

// The stages of a partition in the order in which a pass's stamps go through them.
typedef enum unit_kind { UNIT_SHADER_STAGE, UNIT_DEPTH_STAGE, UNIT_COLOR_STAGE, UNIT_KERNEL_STAGE, UNIT_KINDS } unit_kind;
enum { STAGES_MAX = 3 };
extern const char *const unit_names[UNIT_KINDS];  // for people (unit.c)

// A touch of a line, with the cache that it is of.
typedef struct queued_touch {
    uint32_t slot, move;      // move: its transfers among the job's, if it has any
    uint8_t cache;            // access_unit
    bool miss, replaces, moves;
} queued_touch;
typedef struct queued_move { transfer fill, spill; } queued_move;

// A stamp on its way through one stage.
typedef struct stage_work {
    uint64_t lanes;           // that the stage works on, for the interlock
    uint64_t cost;            // parts of a cycle that the operation takes
    uint64_t second_cost;     // of the shader stage: texture reads, at the same time
    uint32_t first_touch, touch_count;  // in the job's touches
} stage_work;

typedef struct job {
    uint32_t tile, quads;
    uint64_t ready;           // arrives at its next stage
    stage_work work[STAGES_MAX];
    uint64_t stream_address;
    uint32_t stream_read, stream_written;
    uint64_t stretch;         // in which it came
    queued_touch *touches;
    queued_move *moves;       // of the touches that move bytes: most do not, and copies cost
    uint32_t touch_count, move_count, touch_capacity;
} job;

// An operation that another one on the same sample must wait for.
typedef struct flight { uint32_t tile; uint64_t lanes; uint64_t done; } flight;

typedef struct span { const char *name; uint64_t start, end; } span;  // of a timeline

typedef struct unit {
    unit_kind kind;
    int partition;
    uint64_t when;            // of its next step; NEVER: waits for another unit
    uint64_t started;         // stamps begun in this pass
    uint64_t quads_started;   // quads of those
    uint64_t window;          // stamps, of the shader quads, begun here and not begun in the next stage, at most
    uint64_t port_free;       // cycle
    uint64_t operation_free, second_free;  // parts
    uint64_t *operations;     // of the last stage: when each of the last `window` began
    uint64_t operation;       // where the next one is noted
    uint32_t touch;           // next touch of the stamp at hand, and
    uint32_t step;            // how far it got in that touch
    bool open;                // a stamp is at hand
    uint64_t data_ready;
    uint64_t busy, second_busy;  // parts, in this pass
    uint64_t settled, second_settled;  // cycles of those that statistics have
    flight *flights;          // a ring of `window` and more
    uint64_t flight_count, flight_mask;
    uint64_t *buckets;        // interlock by buckets: when the last operation there is done
    span spans[2];            // of operations and lookups, not written yet
} unit;

typedef struct line_cache {
    uint64_t *ready, *last_use;  // of each slot
    uint64_t *used_in;           // stretch of the stamp that used it last
    uint64_t *misses;            // cache_misses_max places: when the fetch that has it is back
    uint64_t oldest_miss;        // the place taken longest ago
} line_cache;

typedef struct partition {
    channel *channel;
    uint64_t when;            // the earliest step of its units, and
    int next_stage;           // whose it is: the one nearest to the end of the pipeline
    line_cache caches[ACCESS_UNITS];
    unit units[STAGES_MAX];
    job *jobs;                // a ring
    uint64_t job_mask, pushed;
    uint64_t l2_free;         // parts
    uint64_t flush_time;
    channel_counts before, settled;  // at the pass's start; what statistics have
} partition;

typedef struct front {
    uint64_t when;
    uint64_t raster_free;     // parts
    uint64_t start;           // of the pass
    uint64_t geometry;        // parts that vertices and set-up take
    uint64_t set_up;          // parts: when the last primitive was
    uint64_t shared;          // parts of `geometry` that went to primitives so far
    uint64_t *begun;          // when each of the last triangles_ahead primitives came to the rasterizer
    bool begins;              // the stamp at hand begins one
    uint64_t primitive;       // of those that come: how many began
    uint64_t asked;           // and for how many the lines were asked for
    uint64_t reads, reads_issued, *read_ready, read_done;  // geometry lines; by primitive, when all up to it are there
    uint64_t base;            // address of the lines that primitives wait for
    uint64_t blocked_at;
    uint64_t busy, settled;   // parts that the rasterizer worked in this pass; cycles of it that statistics have
} front;

struct clock_state {
    uint64_t stretch;         // sampling: of stamps that followed each other; lines were replaced unseen between two
    const machine *machine;
    const frame *frame;
    const report *report;
    pass_info pass;
    int stage_count, partition_count;
    unit_kind stages[STAGES_MAX];
    partition *partitions;
    front front;
    divisor rates[8];         // charge.c
    uint64_t now;             // of the step being done
    uint64_t last_stamp;      // when it was done, before what the pass's geometry adds
    uint64_t pass_start, drained, last_fragment;
    uint64_t bounds[RESOURCE_COUNT];
    request_log *log;
    timeline *timeline;       // NULL, or where what units do goes
    statistics *statistics;
};

// What a stamp costs in each stage (charge.c).
void charge_init(clock_state *clock);
void charge_stamp(const clock_state *clock, const stamp *stamp, const stamp_lines *lines, job *job);

// The front end (front.c). front_next: when it can hand the stamp on; front_step does it.
void front_begin(clock_state *clock);
void front_next(clock_state *clock, const stamp *stamp);
bool front_step(clock_state *clock, const stamp *stamp, uint32_t partition);
void front_end(clock_state *clock);

// A unit (unit.c).
bool units_make(clock_state *clock, partition *partition, const uint32_t slots[ACCESS_UNITS]);
void units_free(partition *partition);
void units_begin(clock_state *clock, partition *partition);
void unit_next(clock_state *clock, partition *partition, int stage);   // sets unit.when
void partition_next(const clock_state *clock, partition *partition);   // sets partition.when, after its units
void unit_step(clock_state *clock, partition *partition, int stage);

// Requests (unit.c): true: taken; else *when is when to ask again.
bool clock_write(clock_state *clock, partition *partition, uint64_t address, uint32_t bytes, uint64_t *when);
// Takes the second level's port. The cycle in which its answer is there.
uint64_t clock_l2_move(clock_state *clock, partition *partition, uint32_t bytes);

// A timeline's slices (spans.c): notes one, if there is a timeline; completes those of a pass.
void spans_note(const clock_state *clock, unit *unit, bool lookups, const char *name, uint64_t start, uint64_t end);
void spans_end(const clock_state *clock, unit *unit);

#endif
