// A kernel and lanes in; what of its log a stamp's description needs, out: once for all stamps that the dispatch ran.
//
// Most instructions run on the same few sets of lanes, and an access adds nothing to an earlier one of the same kind by the same
// lanes or more. So a stamp looks at a few masks instead of three for each instruction.
#include "arrival.h"

static void sum_accesses(const arrival *a, const kernel_use *use, dispatch_sum *sum)
{
    sum->access_count = 0;
    sum->written = 0;
    for (int i = 0; i < use->access_count; i++) {
        const kernel_access *access = &use->accesses[i];
        const uint64_t lanes = a->log[access->instruction].executed;
        uint64_t known = 0;
        for (int k = 0; lanes && k < sum->access_count; k++)
            if (sum->accesses[k].access->group == access->group && sum->accesses[k].access->write == access->write)
                known |= sum->accesses[k].lanes;
        if (lanes & ~known)
            sum->accesses[sum->access_count++] = (access_lanes){access, lanes};
        sum->written |= access->write ? lanes : 0;
    }
}

static void add_slots(dispatch_sum *sum, uint64_t lanes, int32_t slots)
{
    int at = sum->slot_count - 1;
    if (!lanes || !slots)
        return;
    while (at >= 0 && sum->slots[at].lanes != lanes)
        at--;
    if (at < 0)
        sum->slots[at = sum->slot_count++] = (slot_lanes){lanes, 0};
    sum->slots[at].slots += slots;
}

// Adds to a run of instructions by the same lanes, or begins one.
static void continue_run(dispatch_sum *sum, slot_lanes *run, uint64_t lanes, int32_t slots)
{
    if (run->lanes != lanes) {
        add_slots(sum, run->lanes, run->slots);
        *run = (slot_lanes){lanes, 0};
    }
    run->slots += slots;
}

// A quad that runs an instruction takes its cycles; one that only has its turn, kernel_guarded_slots.
static void sum_slots(const arrival *a, int kernel, dispatch_sum *sum)
{
    int count;
    const instruction *code = bound_instructions(a->bound, kernel, &count);
    const int32_t guarded = (int32_t)a->machine->kernel_guarded_slots;
    slot_lanes active = {0, 0}, executed = {0, 0};
    sum->slot_count = 0;
    for (int i = 0; i < count; i++) {
        continue_run(sum, &active, a->log[i].active, guarded);
        continue_run(sum, &executed, a->log[i].executed, (int32_t)opcode_table[code[i].op].cycles - guarded);
    }
    add_slots(sum, active.lanes, active.slots);
    add_slots(sum, executed.lanes, executed.slots);
}

// Lanes that an early test lets through: one whose outcome the log has not for what the shader discards. The pass writes no depth then, so
// planes still hold what was tested.
static uint64_t test_early(const arrival *a, const kernel_use *use, const tile_plane *planes, const batch *batch)
{
    if (!tests_directly(a, use))
        return batch->lanes;
    return depth_test_lanes(use->depth_function, batch->depth[bound_plane_format(a->bound, use->depth_plane)], planes[use->depth_plane], batch->lanes);
}

// Lanes whose neighbour one up is not in the mask as they are.
static uint64_t steps(uint64_t mask)
{
    return mask ^ mask >> 1;
}

static uint64_t find_changes(const arrival *a, const kernel_use *use, const dispatch_sum *sum)
{
    uint64_t changes = steps(sum->tested);
    changes |= use->alive_at < 0 ? 0 : steps(a->log[use->alive_at].outcome);
    changes |= use->passed_at < 0 ? 0 : steps(a->log[use->passed_at].outcome);
    for (int i = 0; i < sum->access_count; i++)
        changes |= steps(sum->accesses[i].lanes);
    for (int i = 0; use->free_kernel && i < sum->slot_count; i++)
        changes |= steps(sum->slots[i].lanes);
    return changes;
}

void dispatch_run(arrival *a, int kernel, const tile_plane *planes, const batch *batch)
{
    a->execute(a->bound, kernel, planes, batch, a->counts + a->plan.count_offset[kernel]);
}

void dispatch_sum_up(arrival *a, int kernel, const tile_plane *planes, const batch *batch)
{
    const kernel_use *use = &a->uses[kernel];
    a->sum.tested = test_early(a, use, planes, batch);
    sum_accesses(a, use, &a->sum);
    if (use->free_kernel)
        sum_slots(a, kernel, &a->sum);
    a->sum.changes = find_changes(a, use, &a->sum);
    a->deeds.known = false;
}
