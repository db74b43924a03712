// A stamp in; the time of its operation in each unit out. The table of docs/machine.md, "Units of a partition".
#include "tick_parts.h"

static uint64_t taken(const machine *machine, uint64_t work, int64_t rate)
{
    return (work * (uint64_t)machine->partitions * TICK_ONE + (uint64_t)rate - 1) / (uint64_t)rate;
}

static uint64_t quads_in(const frame *frame, uint64_t lanes)
{
    uint64_t quads = 0;
    for (uint64_t mask = frame_quads(frame, lanes); mask; mask &= mask - 1)
        quads++;
    return quads;
}

uint64_t tick_texture_work(const machine *machine, const frame *frame, const stamp *stamp)
{
    return taken(machine, 4 * (uint64_t)frame->samples * stamp->texture_reads, machine->texture_samples_per_clock);
}

uint64_t tick_lanes(unit_kind unit, const stamp *stamp)
{
    uint64_t lanes = unit == UNIT_KERNEL ? stamp->lanes : 0;
    for (int i = 0; i < stamp->access_count; i++)
        if (stamp->accesses[i].unit == (unit == UNIT_DEPTH ? ACCESS_DEPTH : ACCESS_COLOR))
            lanes |= stamp->accesses[i].read | stamp->accesses[i].written;
    return lanes;
}

uint64_t tick_bucket(uint32_t tile, uint64_t quads, uint64_t buckets)
{
    uint64_t lane = 0;
    while (!(quads >> lane & 1))
        lane++;
    return ((64 * tile + lane) * UINT64_C(0x9e3779b97f4a7c15) >> 32) % buckets;
}

static uint64_t depth_work(const machine *machine, const frame *frame, const stamp *stamp)
{
    uint64_t lanes = 0;
    for (int i = 0; i < stamp->access_count; i++)
        if (stamp->accesses[i].unit == ACCESS_DEPTH)
            lanes |= stamp->accesses[i].read | stamp->accesses[i].written;
    return taken(machine, 4 * (uint64_t)frame->samples * quads_in(frame, lanes), machine->depth_samples_per_clock);
}

static uint64_t color_work(const machine *machine, const frame *frame, const stamp *stamp)
{
    uint64_t sum = 0;
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *a = &stamp->accesses[i];
        if (a->unit != ACCESS_COLOR)
            continue;
        const uint64_t pixels = 4 * quads_in(frame, a->written), blended = a->read ? pixels : 0;
        const int64_t blend_rate = frame->plane_bits[a->plane] > 64 ? machine->blend_wide_samples_per_clock
                                                                    : machine->blend_samples_per_clock;
        const uint64_t write = longer(taken(machine, pixels, machine->color_pixels_per_clock),
                                      taken(machine, pixels * frame->samples, machine->color_samples_per_clock));
        sum += longer(write, taken(machine, blended * frame->samples, blend_rate));
    }
    return sum;
}

uint64_t tick_work(const machine *machine, const frame *frame, unit_kind unit, const stamp *stamp,
                   uint32_t shader_operations)
{
    switch (unit) {
    case UNIT_SHADER:
        return taken(machine, 4 * (uint64_t)shader_operations * stamp->quads_shaded, machine->shader_operations_per_clock);
    case UNIT_DEPTH: return depth_work(machine, frame, stamp);
    case UNIT_COLOR: return color_work(machine, frame, stamp);
    default: return taken(machine, stamp->kernel_slots, machine->kernel_slots_per_clock);
    }
}
