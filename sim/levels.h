// Levels of detail below `function`: what passes touch, what that costs in bytes and in cycles.
//
//   arrival_run --stamps--> memory_stamp (caches, compression: bytes) --lines--> clock_stamp (units, DRAM: cycles)
//
// Time never changes pixels, and pixels never know time: sim/replay hands out what it executes in order of arrival and
// takes nothing back; sim/mem sees masks and content, never time; sim/clock sees which lines a stamp touched. Since
// every cache meets its stamps in order of arrival, hits, misses and bytes do not depend on time either: the levels traffic
// and cycle give the same bytes. docs/machine.md describes the machine and every approximation.
//
// Words: a *block* is 64 samples (tile of the replay). A *stamp* is what one primitive covers of one block. A *line* is a
// cache's unit: a block of one plane, or an equal part of it where the block is larger than line_bytes.
#ifndef ROPSIM_LEVELS_H
#define ROPSIM_LEVELS_H

#include "sim.h"

// ---- Statistics ----------------------------------------------------------------------------------------

typedef struct statistics {
#define STAT(name, level, unit, meaning) uint64_t name;
#include "stats.def"
#undef STAT
} statistics;

enum {
#define STAT(name, level, unit, meaning) STAT_INDEX_##name,
#include "stats.def"
#undef STAT
    STATISTIC_COUNT
};

typedef enum detail_level { DETAIL_FUNCTION, DETAIL_TRAFFIC, DETAIL_CYCLE, DETAIL_SAMPLED, DETAIL_COUNT } detail_level;
extern const char *const detail_level_names[DETAIL_COUNT];

typedef struct statistic_row {
    const char *name, *unit, *meaning;
    detail_level level;
} statistic_row;
extern const statistic_row statistic_rows[STATISTIC_COUNT];
bool statistic_is_stall(int index);  // cycles that something waited, for one cause

enum {
#define DERIVED(name, level, unit, expression, meaning) DERIVED_INDEX_##name,
#include "stats.def"
#undef DERIVED
    DERIVED_COUNT
};
extern const statistic_row derived_rows[DERIVED_COUNT];
// In double, so that counts divide as numbers. NaN where it is no finite number.
double derived_value(int index, const statistics *statistics, const machine *machine);

// All fields are uint64_t: a region of a run is end minus start.
void statistics_add(statistics *sum, const statistics *more);
statistics statistics_since(const statistics *now, const statistics *then);
static inline uint64_t statistic_value(const statistics *statistics, int index)
{
    return ((const uint64_t *)(const void *)statistics)[index];
}

// ---- Passes and stamps (from sim/replay) ---------------------------------------------------------------

typedef enum pass_kind { PASS_DRAW, PASS_FULLSCREEN, PASS_COPY, PASS_CLEAR, PASS_DRAIN, PASS_KINDS } pass_kind;
extern const char *const pass_kind_names[PASS_KINDS];

typedef struct pass_info {
    pass_kind kind;
    char name[NAME_SIZE];         // of the kernel or pass; of a copy or clear: the plane written
    uint64_t number;              // geometry (but opaque) and full-screen passes from 1 in the order they run; 0: another
    uint64_t iteration;           // of the outermost repeats, from 1; 0 outside
    bool free_kernel;             // one unit runs it; else the depth and the colour unit do
    bool hierarchical, early;     // the pass allows it (the machine may not have it)
    const char *hierarchical_forbidden, *early_forbidden;  // why not; NULL: it does, or it is no draw
    uint32_t shader_operations;   // of a fragment; 0: nothing is shaded
    uint64_t triangles, vertices; // of the draws drawn
    uint64_t stamps;              // that will come
    uint64_t primitives;          // runs of stamps of one primitive each that will come
    uint64_t binned;              // tile-based: pairs of primitive and region
    uint8_t plane;                // PASS_CLEAR: storage cleared
} pass_info;

// Which lanes of a plane a stamp read or wrote, by which unit. `plane` is a storage number: planes that swap change names.
typedef enum access_unit { ACCESS_TEXTURE, ACCESS_DEPTH, ACCESS_COLOR, ACCESS_UNITS } access_unit;
extern const char *const access_unit_names[ACCESS_UNITS];
typedef struct plane_access {
    uint8_t plane;
    access_unit unit;             // of ROP accesses: by the plane's format, also in free kernels
    uint64_t read, written;       // lanes
} plane_access;

typedef struct stamp {
    uint32_t tile;                // number of the block, by rows
    uint32_t draw;                // index in trace_info.draws; UINT32_MAX: full-screen or copy
    bool begins_primitive;        // the first stamp of its primitive
    bool hierarchical;            // the block's range of depths shows that no lane can pass
    uint64_t lanes;               // covered
    uint64_t shaded;              // of these: all, or those that passed an early depth test
    uint64_t alive;               // of these: not discarded by the shader or its clip
    uint64_t passed;              // of these: got through stencil and depth test
    uint32_t kernel_slots;        // free kernels: issue slots over all quads
    uint32_t quads, quads_shaded, quads_passed;  // quads with such a lane
    uint32_t texture_reads;       // quads times planes read as textures
    uint32_t list_bytes;          // appended to or read from lists of fragments
    uint64_t time;                // sampling: stamps that came before it in the run, and a little more
    const plane_access *accesses; // valid during the call
    int access_count;
} stamp;

// The frame that passes work on, as the models see it. Lanes of a block: lane = (y * tile_width + x) * samples + sample.
typedef struct frame {
    uint32_t width, height, samples;
    uint32_t tile_width, tile_height, columns, rows, tile_count;
    uint64_t quad_corners;        // the first lane of each quad
    int plane_count;
    char plane_names[PLANE_MAX][NAME_SIZE];
    format plane_formats[PLANE_MAX];
    int plane_bits[PLANE_MAX];    // of a sample in memory
    uint32_t draw_count;
    // What plane storage `plane` of a block holds now: 64 words, or 4 x 64 of a colour plane.
    const uint32_t *(*contents)(void *user, int plane, uint32_t tile);
    void *user;
} frame;

// The quads that lanes lie in, as a mask of each quad's first lane.
static inline uint64_t quads_of_lanes(uint64_t lanes, uint32_t samples, uint32_t tile_width, uint64_t quad_corners)
{
    for (uint32_t step = 1; step < samples; step *= 2)
        lanes |= lanes >> step;
    lanes |= lanes >> samples;
    lanes |= lanes >> (samples * tile_width);
    return lanes & quad_corners;
}
static inline uint64_t frame_quads(const frame *frame, uint64_t lanes)
{
    return quads_of_lanes(lanes, frame->samples, frame->tile_width, frame->quad_corners);
}

// Sampling: what is done with a pass's stamps. A pass begins with its head, until the queues of
// units can be full; the rest is cut into strata of `period` stamps, each with one window that ends at a place drawn by `seed`. Units go
// from window to window with what they hold; caches see what comes before a window, and a lead makes units meet what lies there.
typedef enum stamp_phase {
    PHASE_HEAD,     // the pass's first stamps, or all of a short pass: measured, each for itself alone
    PHASE_SKIP,     // executed, and nobody looks
    PHASE_WARM,     // seen by caches, and nothing counted
    PHASE_LEAD,     // through caches and units, not measured
    PHASE_FILL,     // the same, while queues become deeper than they ever were in the pass
    PHASE_MEASURE,  // the same, and measured for all stamps of the pass but its head
} stamp_phase;
typedef struct sampling {
    uint32_t head, warm, lead, window, period;  // stamps; head, lead: the fewest
    uint32_t lead_and_window;       // the fewest of both together
    uint64_t seed;
} sampling;
// What may be asked for: period / window, and window.
enum { SAMPLE_EVERY_LEAST = 2, SAMPLE_EVERY_MOST = 1 << 12, SAMPLE_WINDOW_LEAST = 16, SAMPLE_WINDOW_MOST = 1 << 18 };

// Takes passes in order. A status other than STATUS_OK ends the run. `skip` and `phase`: only with sampling.
typedef struct stamp_sink {
    status (*begin_pass)(void *user, const pass_info *pass);
    status (*stamp)(void *user, const stamp *stamp);
    status (*end_pass)(void *user);
    void (*ahead)(void *user, uint32_t tile);  // NULL, or: a stamp of this block will come soon
    status (*warm)(void *user, const stamp *stamp, const uint64_t *times);  // caches hear of this, several stamps of a block as one: by access, when
                                                                 // the last of them made it
    // Storage i of a block was written (bit i) and nobody looked, of no more lanes than these; the last time that may have been.
    void (*skip)(void *user, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time);
    uint64_t (*waiting)(void *user);  // NULL, or: how many stamps have come and are not done
    status (*phase)(void *user, stamp_phase phase, uint64_t begun);  // from now on; a new window, too; primitives that began before
    void *user;
} stamp_sink;


// A trace as stamps, read once for the levels that share it. Levels take turns with it.
typedef struct stamps stamps;

typedef struct arrival arrival;
typedef struct arrival_options {
    uint64_t memory_bytes;        // budget of stamps in memory; 0: 4 GiB. A trace that needs more is read anew for each pass
    int vector_bytes;             // as in run_options
    uint32_t region_pixels;       // tile-based: side of a region; 0: order of arrival
    const uint8_t *tiles;         // NULL, or one a block: only those that are not 0 are replayed
    bool hierarchical, early;     // the machine's
    bool apart;                   // each stamp is dispatched for itself: the same comes out, later
    const sampling *sampling;     // NULL: every stamp is told
    stamps *stamps;               // NULL, or what stamps_read made of the trace with these options: it is not read again
} arrival_options;

// Reads what the replay of a program in order of arrival needs. `trace` must outlive it. Free with stamps_destroy.
status stamps_read(const program *program, const machine *machine, trace *trace, const arrival_options *options, const report *report,
                   stamps **stamps);
// Whether it would make the same, so that these do for this run, too.
bool stamps_fit(const stamps *stamps, const program *program, const machine *machine, const trace *trace, const arrival_options *options);
void stamps_destroy(stamps *stamps);  // NULL is fine
// replay_run without reading the trace once more, if `read` (NULL: it is) has all of it.
status replay_run_on(const program *program, const machine *machine, trace *trace, const stamps *read, const run_options *options,
                     const report *report, run_result **result);

// Prepares the replay of a program pass by pass, in order of arrival. `function`: the result of replay_run with
// log_conditions on the same program, machine and trace: it settles how often loops run. All must outlive the arrival.
status arrival_create(const program *program, const machine *machine, trace *trace, const run_result *function,
                      const arrival_options *options, const report *report, arrival **arrival);
void arrival_destroy(arrival *arrival);  // NULL is fine
const frame *arrival_frame(const arrival *arrival);
status arrival_run(arrival *arrival, const stamp_sink *sink);
// After arrival_run over all tiles: STATUS_REFUSED, as an internal error, unless every plane holds what keep_planes of
// `function` says.
status arrival_check(const arrival *arrival);

// ---- Lines (from sim/mem) ------------------------------------------------------------------------------

// Bytes that go between a cache and what lies behind it.
typedef struct transfer {
    uint64_t address;             // in the partition's channel
    uint32_t bytes;               // whole bursts; 0: nothing moves, and the rest is not set but for evicted_bytes
    uint32_t evicted_bytes;       // written to memory since the second level made room; 0: nothing
    uint64_t evicted_address;
    bool compressed;
    bool on_chip;                 // the second level has it: no read of memory
} transfer;

typedef struct line_touch {
    uint32_t slot;                // of the cache: set * ways + way
    bool miss;                    // it was not there, or not all of it
    bool replaces;                // another line, whose users must be done
    transfer fill, spill;         // read; written back before
} line_touch;

// What a stamp touches in each unit's caches. A free kernel's depth and colour touches are of one unit, in this order.
typedef struct stamp_lines {
    uint32_t partition;
    const line_touch *touches[ACCESS_UNITS];
    int counts[ACCESS_UNITS];
    uint64_t stream_address;      // lists of fragments
    uint32_t stream_read, stream_written;  // bytes that pass by the caches
} stamp_lines;

typedef struct plane_traffic { uint64_t read, written; } plane_traffic;  // memory bytes

// Lines that a block of a plane takes: a power of two.
static inline uint32_t block_lines(const machine *machine, int plane_bits)
{
    uint32_t lines = 1;
    while ((int64_t)TILE_LANES * plane_bits / 8 / lines > machine->line_bytes)
        lines *= 2;
    return lines;
}

// Whole lines of indices, vertices and binned primitives that a pass reads, and writes, in turn from all channels.
static inline uint64_t geometry_reads(const machine *machine, const pass_info *pass)
{
    const uint64_t bytes = pass->triangles * (uint64_t)machine->triangle_bytes + pass->vertices * (uint64_t)machine->vertex_bytes +
                           pass->binned * (uint64_t)machine->binned_bytes;
    return (bytes + (uint64_t)machine->line_bytes - 1) / (uint64_t)machine->line_bytes;
}
static inline uint64_t geometry_writes(const machine *machine, const pass_info *pass)
{
    return (pass->binned * (uint64_t)machine->binned_bytes + (uint64_t)machine->line_bytes - 1) / (uint64_t)machine->line_bytes;
}

typedef struct memory memory;
status memory_create(const machine *machine, const frame *frame, const report *report, memory **memory);
void memory_destroy(memory *memory);  // NULL is fine
// Slots of a partition's cache, all of them of the same size: for arrays a slot.
uint32_t memory_slots(const memory *memory, access_unit cache);
void memory_begin_pass(memory *memory, const pass_info *pass, statistics *statistics);
// Valid until the next call.
const stamp_lines *memory_stamp(memory *memory, const stamp *stamp, statistics *statistics);
// Nothing but a hint: a stamp of this block will come soon.
void memory_ahead(const memory *memory, uint32_t tile);
// Sampling, where stamps have times. A stamp of this block comes at this time; caches hear what a stamp touched, each access at a time
// of its own; no more than these lanes of storage i of a block were written (bit i), last at this time. In any order, and nothing is counted.
void memory_at(memory *memory, uint32_t tile, uint64_t time);
void memory_warm(memory *memory, const stamp *stamp, const uint64_t *times);
void memory_pass_over(memory *memory, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time);
// After a pass, until it returns false: the next line written back of those still changed; at the end of the run
// (`last`) those of the second level as well. Touches of one cache of one partition, one at a time.
bool memory_flush(memory *memory, bool last, uint32_t *partition, access_unit *cache, transfer *transfer, statistics *statistics);
const plane_traffic *memory_planes(const memory *memory);  // by plane storage, since the start
// STATUS_REFUSED if what went in is not what came out.
status memory_check(const memory *memory, const statistics *total, const report *report);
// Least and most lines that a set of a cache holds, over all partitions: how evenly sets are used.
void memory_occupancy(const memory *memory, access_unit cache, uint32_t *least, uint32_t *most, uint32_t *sets);

// The bank that row number `number` of a channel lies in (docs/dram.md).
static inline uint64_t bank_of_row(uint64_t number, uint64_t banks)
{
    const uint64_t row = number / banks;
    return (number + row + row / banks) % banks;
}

// ---- Time (from sim/clock) -----------------------------------------------------------------------------

typedef struct timeline timeline;
typedef struct clock_state clock_state;
enum { REQUEST_FORMATS = 4 };
extern const char *const request_formats[REQUEST_FORMATS];
typedef struct clock_config {
    const char *requests_path, *requests_format;  // NULL, or requests to memory as they are issued, see docs/dram.md
    const int *requests_channel;                  // NULL: of all channels, or of this one alone
    timeline *timeline;                           // NULL, or what units do goes there; the caller finishes it
} clock_config;

status clock_create(const machine *machine, const frame *frame, const uint32_t slots[ACCESS_UNITS], const clock_config *config,
                    const report *report, clock_state **clock);
void clock_destroy(clock_state *clock);  // NULL is fine
status clock_begin_pass(clock_state *clock, const pass_info *pass, statistics *statistics);
// Units stay behind: some of what they waited is only in the statistics after clock_catch_up, clock_settle or clock_end_stamps.
status clock_stamp(clock_state *clock, const stamp *stamp, const stamp_lines *lines, statistics *statistics);
void clock_catch_up(clock_state *clock);  // with the rasterizer
// All stamps were handed in: runs until every unit is idle.
status clock_end_stamps(clock_state *clock, statistics *statistics);
// Then each line of memory_flush, then clock_end_pass, which ends when everything is drained.
status clock_flush(clock_state *clock, uint32_t partition, access_unit cache, const transfer *transfer);
status clock_end_pass(clock_state *clock, statistics *statistics);
// Sampling: goes on behind stamps that were skipped, `begun` primitives of which came before. Queues stay as they are, and
// so does the time: as if the stamps to come had followed at once.
void clock_resume(clock_state *clock, uint64_t begun);
uint64_t clock_last_stamp(const clock_state *clock);  // after clock_end_stamps: cycle at which it was done
uint64_t clock_waiting(clock_state *clock);  // stamps that have left the rasterizer by then, and that no last unit has begun
uint64_t clock_front(const clock_state *clock);  // cycle at which the last stamp handed in has left the rasterizer
uint64_t clock_paced(const clock_state *clock);  // primitives of the pass that the rasterizer waited for until they were set up
void clock_settle(clock_state *clock, statistics *statistics);  // brings counts of units and channels up to date
uint64_t clock_now(const clock_state *clock);            // cycle at which the last pass was drained
uint64_t clock_last_fragment(const clock_state *clock);  // cycle at which its last fragment was done
void clock_bytes(const clock_state *clock, uint64_t *read, uint64_t *written);  // that channels moved since the start
status clock_finish(clock_state *clock);                 // completes the requests' file

// What a pass cannot go below, whatever the rest of the machine does; its index in clock_resource_names, whose last is the
// word for none of them, latency.
typedef enum clock_resource {
    RESOURCE_GEOMETRY, RESOURCE_RASTER, RESOURCE_SHADER, RESOURCE_TEXTURE, RESOURCE_DEPTH, RESOURCE_COLOR, RESOURCE_KERNEL,
    RESOURCE_MEMORY, RESOURCE_CLEAR, RESOURCE_COUNT
} clock_resource;
extern const char *const clock_resource_names[RESOURCE_COUNT + 1];
// Of the last pass: cycles that its busiest partition of each resource was taken; none is above the pass's cycles.
const uint64_t *clock_pass_bounds(const clock_state *clock);

// ---- A whole run (sim/detail) --------------------------------------------------------------------------

typedef struct pass_record {
    pass_info info;
    statistics statistics;
    uint64_t start, last_fragment, drained;  // cycles since the run's start
    uint64_t bounds[RESOURCE_COUNT];
    int bound_by;                            // resource; RESOURCE_COUNT: latency, none was taken half of the time
} pass_record;

typedef struct detail_result {
    detail_level level;
    machine machine;
    statistics total;
    pass_record *passes;  uint64_t pass_count;
    statistics *draws;    uint32_t draw_count;             // of each draw, over all passes; what no draw caused is in no row
    statistics *iterations; uint64_t iteration_count;      // [0]: outside of repeats
    plane_traffic planes[PLANE_MAX]; char plane_names[PLANE_MAX][NAME_SIZE]; int plane_count;
    uint64_t cycles, drained_cycles;                       // last fragment; everything, the second level's lines too
    uint64_t bound_cycles;                                 // sum over passes of the largest of bounds: no run is faster
    struct { uint32_t least, most, sets; } occupancy[ACCESS_UNITS];
    double wall_seconds;                                   // of this level, without the function level's run
    // DETAIL_SAMPLED: statistics are estimates, and each lies within so much of the truth with 95 % confidence.
    sampling sampling;
    uint64_t windows, stamps_measured, stamps;
    double half_widths[STATISTIC_COUNT], memory_half_width;  // memory bytes: of those read and written together
} detail_result;

typedef struct detail_options {
    detail_level level;
    const clock_config *clock;  // NULL: no files
    uint64_t memory_bytes;
    const uint8_t *tiles;       // as arrival_options
    const sampling *sampling;   // DETAIL_SAMPLED: NULL: sampling_default
    stamps *stamps;             // NULL, or what detail_read made, if detail_fits
} detail_options;

// One stamp in 16, and seed 1.
sampling sampling_default(void);
sampling sampling_of(uint64_t every, uint64_t window, uint64_t seed);  // one stamp in `every`; the rest as by default

// Reads the trace for a level below `function`. Any number of runs may use it, one at a time, of whatever program, machine and options it
// fits; detail_run reads for itself where there is none. `trace` and `report` must outlive it. Free with stamps_destroy.
status detail_read(const program *program, const machine *machine, trace *trace, const detail_options *options, const report *report,
                   stamps **stamps);
bool detail_fits(const stamps *stamps, const program *program, const machine *machine, const trace *trace, const detail_options *options);
// Whether replay_run_on can use it: then the trace is read first, and only once. Elsewhere it would lie beside the function level's bins.
bool detail_reads_first(const machine *machine, const detail_options *options);
// `function` as for arrival_create, with keep_planes where tiles is NULL. Conservation is checked in every run.
status detail_run(const program *program, const machine *machine, trace *trace, const run_result *function,
                  const detail_options *options, const report *report, detail_result **result);
void detail_destroy(detail_result *result);  // NULL is fine
// STATUS_REFUSED with every reason if keys of the machine contradict each other.
status machine_check(const machine *machine, const report *report);

// ---- Results of levels (sim/report) --------------------------------------------------------------------

// All of result_write_json, then what `detail` adds: docs/results.md lists the keys. Statistics and times of a deeper level
// than the result's are left out, in every form.
status detail_write_json(const run_result *function, const detail_result *detail, const char *trace_path, const char *path,
                         const report *report);
// One header line, then a row for the total, each pass, each draw and each iteration. What a row does not have is empty.
status detail_write_csv(const detail_result *detail, const char *path, const report *report);
status detail_print(const detail_result *detail, FILE *out);
// The glossary: every statistic and derived number with unit, level and meaning, as Markdown tables.
status statistics_print(FILE *out);

// A timeline as Chrome trace events, which Perfetto and chrome://tracing open. Times are cycles of the run. It is streamed to
// a file that is renamed by timeline_finish; what cannot be written is noticed there.
status timeline_open(const char *path, const machine *machine, const report *report, timeline **timeline);
// A slice in the track of passes, within one of its iteration, and the cycles of its stalls. Passes come in order of time.
void timeline_pass(timeline *timeline, const pass_record *pass);
// A slice from `start` until `end` in a track of its own name, at most TIMELINE_TRACKS of them; and a value that holds from
// `time` on. Slices of one track do not overlap, or lie within each other, the outer one handed in first.
enum { TIMELINE_TRACKS = 1024 };
void timeline_slice(timeline *timeline, const char *track, const char *name, uint64_t start, uint64_t end);
void timeline_counter(timeline *timeline, const char *track, uint64_t time, double value);
status timeline_finish(timeline *timeline);   // frees it, also on failure
void timeline_discard(timeline *timeline);    // frees it and leaves no file; NULL is fine

#endif
