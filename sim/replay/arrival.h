// What the files of the replay in order of arrival share: arrival.c walks the schedule, stamp_run.c runs and describes one
// stamp, stamp_masks.c knows quads and ranges of depth.
#ifndef ROPSIM_ARRIVAL_H
#define ROPSIM_ARRIVAL_H

#include "../levels.h"
#include "replay.h"
#include "stamps.h"

// One access of a kernel to a plane: by the plane's name, since names swap storage.
typedef struct kernel_access {
    uint8_t plane;
    access_unit unit;
    bool write;
    uint16_t instruction;
} kernel_access;

// What a kernel does, as far as a stamp's description needs it.
typedef struct kernel_use {
    kernel_access *accesses;
    int access_count;
    int alive_at, passed_at;        // instruction whose outcome decides; -1: all
    bool free_kernel, has_skip;
    bool hierarchical, early, early_directly;  // directly: the depth test's outcome for discarded fragments is not in the log
    int depth_plane;                // of the test
    compare_function depth_function;
    uint32_t shader_operations;
    int texture_planes;             // reads of planes as textures for each fragment
    uint32_t depth_formats;         // bit f: it looks at the fragment's depth as a code of format f
    bool color, primitive;          // it looks at the fragment's colour, its primitive
} kernel_use;

typedef struct list_entry { uint64_t place, order; uint32_t code; float rgba[4]; } list_entry;

struct arrival {
    const program *program;
    const machine *machine;
    const run_result *function;
    const report *report;
    arrival_options options;
    bound_program *bound;
    plan plan;
    execute_kernel *execute;
    tiling tiling;
    stamps stamps;
    kernel_use uses[KERNEL_MAX];
    frame frame;
    uint32_t *storage, *empty_storage;
    uint32_t *empty_before;         // what it held before a full-screen pass: all empty blocks start from there
    uint32_t storage_count;
    uint32_t *frame_order;          // blocks by region, on a tile-based machine
    uint32_t *storage_of_tile;      // number of its storage; UINT32_MAX: the empty one
    uint8_t plane_at[PLANE_MAX];    // storage that holds plane i's contents
    uint64_t *counts;               // of instructions, not looked at
    lane_log *log;
    uint32_t *lanes_of_columns;     // dense columns spread over lanes
    const stamp_sink *sink;
    plane_access accesses[PLANE_MAX * 2];

    // While it runs:
    uint64_t condition, pass_number, iteration;
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

// Quads, or pixels, with at least one of the lanes (stamp_masks.c).
uint32_t quads_of(const tiling *tiling, uint64_t lanes);
// Lanes for which the depth test would hold.
uint64_t depth_test_lanes(compare_function function, const uint32_t *codes, const uint32_t *plane, uint64_t lanes);
// Whether none of `count` fragments can pass, by their and the block's least and greatest depth.
bool depth_range_fails(compare_function function, const uint32_t *codes, uint32_t count, const uint32_t *plane);

uint32_t *arrival_plane(const arrival *arrival, int storage, uint32_t tile);
// Runs the kernel on the lanes of a block and describes what it did; `record` NULL: a full-screen pass (stamp_run.c).
void stamp_execute(arrival *arrival, int kernel, const stamp_chunk *chunk, const stamp_record *record, uint32_t tile,
                   uint64_t lanes, stamp *stamp);
// Leaves of a full-screen stamp only what it did to these lanes.
void stamp_cut(arrival *arrival, uint64_t lanes, stamp *stamp);
// Calls body for each stamp of the draws, in the machine's order (arrival.c).
typedef status stamp_body(arrival *arrival, const step *step, const stamp_chunk *chunk, const stamp_record *record);
status each_stamp(arrival *arrival, const step *step, stamp_body *body);
status begin_pass(arrival *arrival, pass_kind kind, const char *name, bool numbered, const step *step, const kernel_use *use);
// A `list` step: keeps, then sorts and blends (arrival_list.c).
status arrival_list(arrival *arrival, const step *step);

#endif
