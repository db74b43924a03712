// What the files of the replay in order of arrival share: arrival.c walks the schedule, stamp_run.c runs and describes one
// stamp, pack.c several small ones together, dispatch.c is what both run, alike.c is for stamps whose lanes all did the same, stamp_masks.c
// knows quads and ranges of depth. Of sampling, sampling.c says which stamps are looked at, skip.c runs the others, and warm.c shows them to
// caches.
#ifndef ROPSIM_ARRIVAL_H
#define ROPSIM_ARRIVAL_H

#include "../levels.h"
#include "replay.h"
#include "stamps.h"

// One access of a kernel to a plane: by the plane's name, since names swap storage.
typedef struct kernel_access {
    uint8_t plane;
    access_unit unit;
    bool write, color;
    uint16_t instruction;
    uint8_t group;                  // of all accesses to the plane by the unit
} kernel_access;

typedef struct kernel_plane { uint8_t plane; bool color, read; } kernel_plane;  // that a kernel reads or writes

// What a kernel does, as far as a stamp's description needs it.
typedef struct kernel_use {
    kernel_access *accesses;        // and one more behind them: what the depth test reads before the shader, if that is early
    int access_count, group_count;
    kernel_plane planes[PLANE_MAX];
    int plane_count;
    int alive_at, passed_at;        // instruction whose outcome decides; -1: all
    bool free_kernel;
    bool hierarchical, early, early_directly;  // directly: the depth test's outcome for discarded fragments is not in the log
    const char *hierarchical_forbidden, *early_forbidden;  // why not; NULL: it may
    int depth_plane;                // of the test
    bool depth_write;
    compare_function depth_function;
    uint32_t shader_operations;
    int texture_planes;             // reads of planes as textures for each fragment
    uint32_t depth_formats;         // bit f: it looks at the fragment's depth as a code of format f
    bool color, primitive;          // it looks at the fragment's colour, its primitive
} kernel_use;

typedef struct block_range { uint64_t pass; depth_range range; } block_range;  // of a pass's depth plane, if it is this pass

// What a pass's range clip holds a block's fragments against: whatever fails there changes nothing. A pass does not write it.
typedef struct clip_limits {
    uint64_t pass;                  // to which it belongs
    int count;
    compare_function functions[CLIP_MAX];
    depth_range ranges[CLIP_MAX];   // of what it holds them against
} clip_limits;

// What a pass's kernel reads of a block: places in its storage, those of colours behind all others.
typedef struct block_reads {
    uint32_t offsets[4 * PLANE_MAX];
    int plain_count, count;
} block_reads;
enum { PREFETCH_WORDS = 16 };       // that come to the processor's cache at once

// Which stamps of the pass at hand are looked at (sampling.c).
typedef struct phase_plan {
    uint64_t stamps, at;            // of the pass; the next one's number
    uint64_t begun;                 // primitives that began before it
    stamp_phase phase;              // at hand
    uint64_t until;                 // the stamp with which another one begins
    uint64_t head;                  // stamps of the head, once it has ended
    uint64_t looked, filled_stamps, filled_quads;  // stamps looked at so far, and what of them came to units
    uint64_t accesses[ACCESS_UNITS];  // planes that they touched by each unit
    uint64_t waiting, steady_at;    // stamps in queues when that was asked last; when it is to be asked again
    bool steady;                    // they were not much more than before
    bool deepens;                   // behind the head, they were: stamps are looked at until they are not
    uint64_t strata, stratum;       // how many; the number of the one at hand
    uint64_t window;                // stamps of one that is not cut off
    uint64_t window_start, window_end, lead;  // of the stratum at hand
    bool whole;                     // a pass that has no windows however long
    stamp_phase told;               // that the sink knows of, and
    uint64_t told_stratum;          // of which stratum
} phase_plan;

// The first of a block's stamps in chunk.blocks that was neither looked at nor run (skip.c), if it is of this visit of a chunk and
// any of them may write.
typedef struct block_cursor { uint64_t visit; uint32_t next, batch; } block_cursor;  // batch: of the block's, none before it has any

enum { PACK_STEP = 4 };             // fragments that are gathered at once

// Several stamps that one dispatch ran (pack.c); those from record `next` up to `end` have not been taken out.
typedef struct stamp_pack {
    const stamp_chunk *chunk;
    uint32_t next, end;
    uint64_t pass;
    int kernel;
    uint32_t lane;                  // of the first fragment of `next`
    uint32_t *at[TILE_LANES + PACK_STEP];  // each fragment's sample in its block's storage; behind them, of any
    uint32_t primitives[TILE_LANES];
    uint64_t from[TILE_LANES + PACK_STEP];      // if fragments lie by lanes: each one's place in the chunk's columns,
    uint32_t columns[COLUMNS_MAX][TILE_LANES];  // and those of all, side by side
    tile_plane planes[PLANE_MAX];
    uint32_t *words;                // that those lie in
    bool reads_colors;              // most lanes of the dispatch before did
} stamp_pack;

// What a dispatch did (dispatch.c): accesses that any lane made, in their order, without those that add nothing to earlier ones;
// and what each quad with one of so many lanes takes of a kernel's issue slots.
typedef struct access_lanes { const kernel_access *access; uint64_t lanes; } access_lanes;
typedef struct slot_lanes { uint64_t lanes; int32_t slots; } slot_lanes;
typedef struct dispatch_sum {
    uint64_t tested;                // lanes that passed an early test, if the machine makes one; else all
    uint64_t written;               // lanes that wrote to a plane
    uint64_t changes;               // bit i: lane i + 1 did something else than lane i
    int access_count, slot_count;   // slots: of free kernels alone
    access_lanes accesses[WORD_MAX];
    slot_lanes slots[2 * WORD_MAX];
} dispatch_sum;

// What one lane of a dispatch did (alike.c).
typedef struct lane_deeds {
    bool known;
    uint32_t lane;
    stamp stamp;                    // of this lane alone; what became of it: all 64 lanes or none
    bool writes_depth;              // the plane of the depth test
    plane_access accesses[PLANE_MAX * 2];  // the stamp's: the same
    int written_count;
    kernel_plane written[PLANE_MAX];
} lane_deeds;

// A stamp's fragments among the lanes of the dispatch that ran it: its block's, or those of a pack.
typedef struct dispatch_part {
    uint64_t lanes;                 // of the block
    uint32_t first, count;          // lanes of the pack; count 0: the dispatch's lanes are the block's
    const lane_deeds *alike;        // NULL, or what each of them did
} dispatch_part;

typedef struct list_entry { uint64_t place, order; uint32_t code; float rgba[4]; } list_entry;

struct arrival {
    const program *program;
    const machine *machine;
    const run_result *function;
    const report *report;
    arrival_options options;
    bound_program *bound;
    rop_limits limits;              // the machine's
    plan plan;
    execute_kernel *execute;
    tiling tiling;
    stamps *stamps;
    bool owns_stamps;
    kernel_use uses[KERNEL_MAX];
    frame frame;
    uint32_t *storage, *empty_storage;
    uint32_t *empty_before;         // what it held before a full-screen pass: all empty blocks start from there
    uint32_t storage_count;
    uint32_t *frame_order;          // blocks by region, on a tile-based machine
    uint32_t *storage_of_tile;      // number of its storage; UINT32_MAX: the empty one
    uint8_t plane_at[PLANE_MAX];    // storage that holds plane i's contents
    uint64_t *counts;               // of instructions, not looked at
    lane_log *log;                  // of the last dispatch
    dispatch_sum sum;
    lane_deeds deeds;               // of a lane of that
    uint32_t *lanes_of_columns;     // dense columns spread over lanes
    block_range *ranges;            // of each block
    block_reads reads;              // of the pass at hand
    stamp_pack pack;
    const stamp_sink *sink;
    phase_plan plan_of_phases;
    block_cursor *cursors;          // sampling: one a block
    clip_limits *clip_limits;       // the same
    uint64_t *skip_counts, *skip_counts_seen;
    const struct write_log *writes; // NULL, or which batches write: of the same as the blocks'
    uint64_t draws;                 // that ended
    const stamp_chunk *visited;     // whose stamps may have been passed over; NULL: none
    const step *visit_step;
    uint64_t visit;
    uint64_t time, visit_time;      // of the next stamp; of the visited chunk's first
    uint32_t position;              // of the stamp at hand in that chunk
    bool warming;                   // stamps from number warm_first on may be shown to caches
    uint32_t warm_first, *warm_last;  // of each block that is shown, the last stamp
    uint64_t warm_visit, *warm_seen;  // of each block, the visit it was seen in last
    plane_access accesses[PLANE_MAX * 2];

    // While it runs:
    bool ran;                       // or did before
    uint64_t condition, pass_number, iteration, passes_begun;
    int nest;
    const draw_batches *batches;
    uint32_t batch;
    list_entry *entries;
    uint64_t entry_count, entry_capacity;
    uint32_t *list_lengths;         // of each sample
};

// Finds out what each kernel does (kernel_use.c). Free uses[].accesses.
status kernel_use_find(const program *program, const bound_program *bound, const machine *machine, const report *report,
                       kernel_use uses[KERNEL_MAX]);

// Quads with at least one of the lanes (stamp_masks.c).
uint32_t quads_of(const arrival *arrival, uint64_t lanes);
// Lanes for which the depth test would hold.
uint64_t depth_test_lanes(compare_function function, const uint32_t *codes, const uint32_t *plane, uint64_t lanes);
// Of a stamp's fragments, in a format that the chunk has codes of.
depth_range stamp_depths(const stamp_chunk *chunk, const stamp_record *record, format format);
// Whether no fragment can pass, by their and the block's range.
bool depth_range_fails(compare_function function, depth_range fragments, depth_range block);

// What a block's planes hold; a plane lies at plan.plane_offset of its storage.
static inline uint32_t *arrival_block(const arrival *a, uint32_t tile)
{
    const uint32_t number = a->storage_of_tile[tile];
    return number == UINT32_MAX ? a->empty_storage : a->storage + (size_t)number * a->plan.tile_words;
}
static inline uint32_t *arrival_plane(const arrival *a, int storage, uint32_t tile)
{
    return arrival_block(a, tile) + a->plan.plane_offset[storage];
}
// Of what the plane of the depth test holds of a block now.
depth_range block_depths(arrival *arrival, const kernel_use *use, uint32_t tile);
// Whether hierarchical depth discards a stamp: then its kernel would change nothing (stamp_run.c).
bool stamp_discarded(arrival *arrival, const kernel_use *use, const stamp_chunk *chunk, const stamp_record *record);
// Whether an early test is made that the log does not tell of.
static inline bool tests_directly(const arrival *a, const kernel_use *use)
{
    return a->options.early && use->early && use->early_directly;
}
// What each plane of the program holds of a block.
static inline void arrival_planes(const arrival *a, uint32_t tile, tile_plane planes[PLANE_MAX])
{
    for (int i = 0; i < a->program->plane_count; i++)
        planes[i] = arrival_plane(a, a->plane_at[i], tile);
}
// Runs the kernel; sums up its log (dispatch.c).
void dispatch_run(arrival *arrival, int kernel, const tile_plane *planes, const batch *batch);
void dispatch_sum_up(arrival *arrival, int kernel, const tile_plane *planes, const batch *batch);
// What each of these lanes of the last dispatch did, if all did the same; else NULL (alike.c).
const lane_deeds *lanes_alike(arrival *arrival, const kernel_use *use, uint32_t first, uint32_t count);
// A pack (pack.c): begins one with this record, unless that would be one stamp alone (false); takes out the stamp that comes next: writes
// to its block what it wrote. pack_has: whether the record is next.
bool pack_begin(arrival *arrival, int kernel, const stamp_chunk *chunk, const stamp_record *record);
bool pack_has(const arrival *arrival, int kernel, const stamp_chunk *chunk, const stamp_record *record);
dispatch_part pack_take(arrival *arrival, const kernel_use *use, const stamp_record *record);
void pack_pass_over(arrival *arrival, const stamp_record *record);  // it is next, and was discarded
// The lanes of a mask that belong to a part, as lanes of its block.
static inline uint64_t part_mask(const dispatch_part *part, uint64_t mask)
{
    if (!part->count)
        return mask & part->lanes;
    const uint64_t all = UINT64_MAX >> (TILE_LANES - part->count);
    mask = mask >> part->first & all;
    if (!mask || mask == all)
        return mask ? part->lanes : 0;
    uint64_t found = 0;
    for (uint64_t left = part->lanes; mask; left &= left - 1, mask >>= 1)
        found |= mask & 1 ? left & -left : 0;
    return found;
}

// Describes what the last dispatch did to a stamp, of which lanes and quads are known (stamp_run.c). Whether it wrote the plane of the
// depth test.
bool stamp_describe(arrival *arrival, const kernel_use *use, const dispatch_part *part, stamp *stamp);
// Runs the kernel on a stamp's fragments, maybe together with those that follow, and describes what it did (stamp_run.c).
void stamp_execute(arrival *arrival, int kernel, const stamp_chunk *chunk, const stamp_record *record, stamp *stamp);
// Runs it on these lanes of a block and describes what it did; `record` NULL: they are of no stamp.
void lanes_execute(arrival *arrival, int kernel, const stamp_record *record, uint32_t tile, const batch *batch, stamp *stamp);
// The same on the lanes of a block alone; `record` NULL: a full-screen pass.
void block_execute(arrival *arrival, int kernel, const stamp_chunk *chunk, const stamp_record *record, uint32_t tile,
                   uint64_t lanes, stamp *stamp);
// Leaves of a full-screen stamp only what it did to these lanes.
void stamp_cut(arrival *arrival, uint64_t lanes, stamp *stamp);
// Calls body for each stamp of the draws, in the machine's order (arrival.c).
typedef status stamp_body(arrival *arrival, const step *step, const stamp_chunk *chunk, const stamp_record *record);
status each_stamp(arrival *arrival, const step *step, stamp_body *body);
status begin_pass(arrival *arrival, pass_kind kind, const char *name, bool numbered, const step *step, const kernel_use *use);
// Sampling (sampling.c): begins a pass of so many stamps; the phase of its next stamp, told to the sink where it changes.
void phases_begin(arrival *arrival, uint64_t stamps);
void phases_fill(arrival *arrival, const stamp *stamp);  // it went through units
status phases_next(arrival *arrival, bool begins_primitive, stamp_phase *phase);
static inline bool phases_skip(const arrival *a)  // the stamp at hand is not looked at
{
    return a->plan_of_phases.phase == PHASE_SKIP || a->plan_of_phases.phase == PHASE_WARM;
}
bool draws_class(const arrival *arrival, const step *step, uint32_t draw);
// Sampling (skip.c); without it, none of these does anything. A chunk comes; its stamp `number` is looked at; what of a block
// came before the stamp at hand has been run; all of the chunk has.
status skip_make(arrival *arrival);
void skip_free(arrival *arrival);
void skip_forget(arrival *arrival);  // what is known of blocks: another run begins
void skip_begin(arrival *arrival, const step *step, const stamp_chunk *chunk);
status skip_pass_by(arrival *arrival, uint32_t number);
void skip_catch_up(arrival *arrival, uint32_t tile);
void skip_catch_up_before(arrival *arrival, uint32_t number);  // the same, of the block of a stamp that has not come yet, or comes now
void skip_until(arrival *arrival, uint32_t tile, uint32_t first, uint32_t next);  // of a block up to place `first`; what comes then is looked at, up to `next`
void skip_ahead(arrival *arrival, uint32_t number);  // asks for what that reads first
status skip_end(arrival *arrival);
void skip_columns(const arrival *arrival, const block_batch *stamps, batch *batch);  // points at those that the kernel reads
// Sampling (warm.c): of the stamps from warm_first on, up to number `end`, as many of the last as fill caches are shown to them.
status warm_make(arrival *arrival);
void warm_free(arrival *arrival);
status warm_run(arrival *arrival, uint32_t end);
// A `list` step: keeps, then sorts and blends (arrival_list.c).
status arrival_list(arrival *arrival, const step *step);

#endif
