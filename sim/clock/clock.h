// What the files of the timing model share: clock.c runs passes, partition.c makes what a partition consists of, unit.c steps its
// units, moves.c is what lookups wait for that move bytes, front.c the geometry and the rasterizer, charge.c what work costs.
//
// Nothing ticks: each unit says when it can do its next step, and does it when its turn comes. docs/machine.md has the rules step by
// step. Turns need an order only where steps meet in something that they share:
//
// Partitions share nothing. What comes to one from outside is a stamp for its first unit, which arrives later than the rasterizer is
// (front.now), and a line of geometry through its channel, at front.now. What is asked from outside is whether the first unit's
// queue has room at front.now, and counts, which are sums. So a partition may stay behind as long as nobody asks: stamps that
// have begun only grow in number, so a queue with room by what is known has it in truth. When somebody asks, the partition first
// does all steps up to that time (partition_advance), and is then as if it had never waited. A partition none of whose stamps has a
// step left that moves bytes asks nothing of its channel until it gets more stamps, and need not do its steps before a line of geometry.
//
// Units of a partition share the channel and the second level: steps that move bytes are done in order of time, of those of one cycle
// the one nearest to the end of the pipeline first. All other steps look at what belongs to the unit (its port, its operations,
// the lines of its caches, as no cache is of two units) and at times that do not change once they are known: when the stamp comes
// from the unit before, and when the next unit began those ahead of it. So they give the same in any order, and a unit runs
// through all stamps that it can: data and branches are then where the last stamp left them. A step that needs a time that is not
// known yet waits until it is.
//
// Where a file is written, steps of all partitions are done in order of time one by one (clock_state.in_order), as the order of lines
// in it is that of calls.
#ifndef ROPSIM_CLOCK_H
#define ROPSIM_CLOCK_H

#include "../levels.h"
#include "channel.h"
#include "divisor.h"

// Work is counted in parts of a cycle, so that rates need not divide each other.
#define CYCLE_PARTS (UINT64_C(1) << 20)
#define NEVER UINT64_MAX

static inline uint64_t later(uint64_t a, uint64_t b) { return a > b ? a : b; }
static inline uint64_t earlier(uint64_t a, uint64_t b) { return a < b ? a : b; }
static inline uint64_t cycles_up(uint64_t parts) { return (parts + CYCLE_PARTS - 1) / CYCLE_PARTS; }

// The stages of a partition in the order in which a pass's stamps go through them.
typedef enum unit_kind { UNIT_SHADER_STAGE, UNIT_DEPTH_STAGE, UNIT_COLOR_STAGE, UNIT_KERNEL_STAGE, UNIT_KINDS } unit_kind;
enum { STAGES_MAX = 3 };
extern const char *const unit_names[UNIT_KINDS];  // for people (partition.c)

// A touch of a line.
typedef struct queued_touch {
    uint32_t line;            // in the partition's lines
    uint32_t how;             // TOUCH_..., whose cache in two bits from TOUCH_CACHE on, and from bit TOUCH_MOVE on the number of its
                              // transfers among the partition's, if it has any
} queued_touch;
enum { TOUCH_MISS = 1, TOUCH_REPLACES = 2, TOUCH_MOVES = 4, TOUCH_CACHE = 3, TOUCH_MOVE = 5 };
typedef struct queued_move { transfer fill, spill; } queued_move;

// A stamp on its way through one stage.
typedef struct stage_work {
    uint64_t cost;            // parts of a cycle that the operation takes
    union {
        uint64_t lanes;       // that the stage works on, for the interlock
        uint64_t second_cost; // of the shader stage, which has none: texture reads, at the same time
    };
    uint32_t first_touch, touch_count;  // among the partition's
} stage_work;

// Hundreds wait before a slow unit. What most of them are asked for lies in their first line of the processor's cache.
enum { PROCESSOR_LINE = 64 };
typedef struct job {
    _Alignas(PROCESSOR_LINE) uint64_t ready;  // arrives at its next stage
    uint32_t tile, quads;
    stage_work work[STAGES_MAX];
    uint64_t first_touch, first_move;  // how many the partition had before
    uint64_t stretch;         // in which it came
    uint64_t stream_address;
    uint32_t stream_read, stream_written;
} job;

// Things in the order in which they came; number i is at i & mask. Those of stamps on their way are kept.
typedef struct ring {
    void *items;
    uint64_t mask, end;       // end: the next one's number
    uint64_t limit;           // up to which there is room
} ring;

// An operation that another one on the same sample must wait for.
typedef struct flight { uint32_t tile; uint64_t lanes; uint64_t done; } flight;

typedef struct span { const char *name; uint64_t start, end; } span;  // of a timeline

enum { STEP_STREAM, STEP_PENDING, STEP_SPILL, STEP_SPILL_EVICTED, STEP_FILL_EVICTED };  // of a lookup, in this order

typedef struct unit {
    unit_kind kind;
    uint8_t stage;            // its place among the partition's
    bool last;                // of the pass's stages
    bool lists;               // it is the one that appends to and reads lists
    bool full;                // the next stamp finds no room, and when it will is not known
    bool open;                // a stamp is at hand whose next step moves bytes
    uint8_t step;             // of that stamp: how far it got in its next touch
    uint32_t touch;           // the number of that
    uint64_t when;            // of its next step; NEVER: waits for another unit
    uint64_t could;           // when that might have been, had there been room
    uint64_t last_step;
    uint64_t started;         // stamps begun in this pass
    uint64_t port_free;       // cycle
    uint64_t window;          // stamps, of the shader quads, begun here and not begun in the next stage, at most
    uint64_t operation_free, second_free;  // parts
    uint64_t busy, second_busy;  // parts, in this pass
    uint64_t data_ready;      // of that stamp: when the lines looked up are there
    uint64_t latency;         // of its kind
    uint64_t *begun, begun_mask;  // a ring: when the last stamps began, as many as the stage before has room for, and more
    uint64_t *operations;     // of the last stage: when each of the last `window` began
    uint64_t operation;       // where the next one is noted
    flight *flights;          // a ring of `window` and more
    uint64_t flight_count, flight_mask;
    uint64_t *buckets;        // interlock by buckets: when the last operation there is done
    int partition;
    uint64_t settled, second_settled;  // cycles of `busy` and `second_busy` that statistics have
    span spans[2];            // of operations and lookups, not written yet
} unit;

// The shader's window: stamps, in their order, must have begun in the next stage before the latest one may begin here.
typedef struct shader_room {
    uint32_t *quads;          // a ring of the stamps begun: as many as the shader's window and more
    uint64_t mask;
    uint64_t passed;          // stamps that must have begun there
    uint64_t held;            // quads of those behind them
    uint64_t when;            // when the last one that must began there
} shader_room;

typedef struct line_state {
    uint64_t ready;           // when its bytes are there
    uint64_t last_use;        // when the last operation on it ends
} line_state;

typedef struct fetches {
    uint64_t *misses;         // cache_misses_max places: when the fetch that has it is back
    uint64_t oldest_miss;     // the place taken longest ago
} fetches;

typedef struct partition {
    uint64_t now;             // of the step being done that moves bytes
    uint64_t when;            // no unit has a step before. After partition_advance or partition_step one has a step then,
    int next_stage;           // this one: of several the one nearest to the end of the pipeline
    line_state *lines;        // of all caches, one cache behind the other (clock_state.first_line)
    job *jobs;                // a ring
    uint64_t job_mask, pushed;
    ring touches, moves;      // of them: queued_touch; queued_move of the touches that move bytes, as most do not
    uint64_t moving;          // stamps up to the last one with a step that moves bytes
    unit units[STAGES_MAX];
    shader_room shader_room;
    channel *channel;
    fetches fetches[ACCESS_UNITS];  // of each cache
    uint64_t *used_in;        // of each line: stretch of the stamp that used it last
    uint64_t l2_free;         // parts
    uint64_t flush_time;
    channel_counts before, settled;  // at the pass's start; what statistics have
} partition;

// A value in `count` whole shares that add up to it: number i (from 0) is ceil((i + 1) value / count) - ceil(i value / count). One
// after the other they need no division: `over` / count is by how much those so far, rounded up, are too much.
typedef struct shares {
    uint64_t count, least, rest;  // value = least * count + rest
    uint64_t over;
} shares;

typedef struct front {
    uint64_t now;             // when the last stamp left the rasterizer: all partitions are there, or would be if asked
    uint64_t when;            // when the stamp at hand leaves it
    uint64_t raster_free;     // parts
    uint64_t takes;           // parts that a stamp takes
    uint64_t start;           // of the pass
    uint64_t geometry;        // parts that vertices and set-up take
    uint64_t set_up;          // parts: when the last primitive was
    shares set_up_shares, read_shares;  // of `geometry` by primitive, of `reads` by primitive asked for
    uint64_t *begun;          // when each of the last triangles_ahead primitives came to the rasterizer
    bool begins;              // the stamp at hand begins one
    uint64_t there;           // when that is set up, if nothing but this kept it from the rasterizer; else 0
    uint64_t paced;           // primitives that nothing but set-up kept waiting
    uint64_t primitive;       // of those that come: how many began
    uint64_t asked;           // and for how many the lines were asked for
    uint64_t begun_place, read_place, asked_place;  // of `primitive` in begun and in read_ready, of `asked` in read_ready
    uint64_t reads, reads_issued, *read_ready, read_done;  // geometry lines; by primitive, when all up to it are there
    uint64_t base;            // address of the lines that primitives wait for
    uint64_t busy, settled;   // parts that the rasterizer worked in this pass; cycles of it that statistics have
} front;

enum { BLOCK_QUADS = TILE_LANES / 4 };

// What a stamp costs by its number of quads, in the pass at hand: parts of a cycle.
typedef struct quad_costs {
    uint64_t shader[BLOCK_QUADS + 1], depth[BLOCK_QUADS + 1], write[BLOCK_QUADS + 1];
    uint64_t blend[2][BLOCK_QUADS + 1];  // [1]: of wide planes
} quad_costs;

struct clock_state {
    uint64_t stretch;         // sampling: of stamps that followed each other; lines were replaced unseen between two
    const machine *machine;
    const frame *frame;
    const report *report;
    pass_info pass;
    int stage_count, partition_count;
    unit_kind stages[STAGES_MAX];
    int stage_of[UNIT_KINDS]; // of those that the pass has
    uint32_t first_line[ACCESS_UNITS];  // of each cache, in a partition's lines
    partition *partitions;
    front front;
    divisor texture_rate, kernel_rate, partitions_by;  // charge.c; front.c
    quad_costs costs;
    uint64_t last_stamp;      // when it was done, before what the pass's geometry adds
    uint64_t pass_start, drained, last_fragment;
    uint64_t bounds[RESOURCE_COUNT];
    bool in_order;            // a file is written: steps of all partitions are done in order of time
    request_log *log;
    timeline *timeline;       // NULL, or where what units do goes
    statistics *statistics;
};

// What a stamp costs in each stage (charge.c).
void charge_begin(clock_state *clock);
void charge_stamp(const clock_state *clock, partition *partition, const stamp *stamp, const stamp_lines *lines, job *job);

// The front end (front.c). front_next: when it can hand the stamp on, if there is room; front_step does it at front.when.
void front_begin(clock_state *clock);
void front_next(clock_state *clock, const stamp *stamp);
void front_step(clock_state *clock);
void front_end(clock_state *clock);

// A partition (partition.c).
bool partition_make(clock_state *clock, partition *partition, const uint32_t slots[ACCESS_UNITS]);
void partition_free(partition *partition);
void partition_begin(clock_state *clock, partition *partition);
static inline queued_touch *touch_at(const partition *p, uint32_t number) { return (queued_touch *)p->touches.items + (number & p->touches.mask); }
static inline queued_move *move_at(const partition *p, uint32_t number) { return (queued_move *)p->moves.items + (number & p->moves.mask); }
// As long as no stamps were skipped all are of stretch 0, and need not be asked.
static inline uint64_t stretch_of(const clock_state *c, const job *job) { return c->stretch ? job->stretch : 0; }
// Of the stamp that comes next, with room for so many touches; NULL: out of memory.
job *partition_new_job(const clock_state *clock, partition *partition, uint32_t touches);

// Whether no stamp that it has so far has a step left that moves bytes.
bool partition_moves_nothing(const clock_state *clock, const partition *partition);

// Its steps (unit.c).
void partition_step(clock_state *clock, partition *partition);          // the one at partition.when, if there is one then
void partition_advance(clock_state *clock, partition *partition, uint64_t until);  // all up to and with this cycle

// What moves bytes (moves.c), at partition.now; false: it waits until unit.when.
bool move_line(clock_state *clock, partition *partition, unit *unit, const job *job, const queued_touch *touch);
bool move_stream(clock_state *clock, partition *partition, unit *unit, const job *job);
// Behind stamps that were skipped the line to be replaced may have been another then, used just now, which a stamp that came at once would
// not have met: it waits for the earliest of its set's uses instead, one use each.
uint64_t earliest_use(const clock_state *clock, partition *partition, const queued_touch *touch, uint64_t stretch);
// When the users of the line to be replaced have ended.
static inline uint64_t victim_free(const clock_state *c, partition *p, const queued_touch *touch, const job *job)
{
    if (!c->stretch || c->machine->tile_based || p->used_in[touch->line] == job->stretch)
        return p->lines[touch->line].last_use;
    return earliest_use(c, p, touch, job->stretch);
}
// Requests at cycle `now`: true: taken; else *when is when to ask again.
bool clock_write(partition *partition, uint64_t now, uint64_t address, uint32_t bytes, uint64_t *when);
// Takes the second level's port. The cycle in which its answer is there.
uint64_t clock_l2_move(const clock_state *clock, partition *partition, uint64_t now, uint32_t bytes);

// A timeline's slices (spans.c): notes one, if there is a timeline; completes those of a pass.
void spans_note(const clock_state *clock, unit *unit, bool lookups, const char *name, uint64_t start, uint64_t end);
void spans_end(const clock_state *clock, unit *unit);

#endif
