// What the work on a stamp costs in each stage, in parts of a cycle, by the machine's rates.
//
// Rates are of the chip; a partition has its share. A quad with any sample counts whole. A colour access that reads is a
// blend; one that only writes replaces. Most costs depend on a number of quads alone, of which a block has few: they are
// worked out at a pass's start.
#include "clock.h"

static uint64_t cost(const clock_state *c, uint64_t work, const divisor *rate)
{
    uint64_t rest;
    const uint64_t parts = divide(work * (uint64_t)c->partition_count * CYCLE_PARTS, rate, &rest);
    return parts + (rest > 0);
}

void charge_begin(clock_state *c)
{
    const machine *m = c->machine;
    const divisor shader = divisor_of((uint64_t)m->shader_operations_per_clock), depth = divisor_of((uint64_t)m->depth_samples_per_clock);
    const divisor by_pixels = divisor_of((uint64_t)m->color_pixels_per_clock), by_samples = divisor_of((uint64_t)m->color_samples_per_clock);
    const divisor blend = divisor_of((uint64_t)m->blend_samples_per_clock), wide = divisor_of((uint64_t)m->blend_wide_samples_per_clock);
    quad_costs *costs = &c->costs;
    for (uint64_t quads = 0; quads <= BLOCK_QUADS; quads++) {
        const uint64_t pixels = 4 * quads, samples = pixels * c->frame->samples;
        costs->shader[quads] = cost(c, pixels * c->pass.shader_operations, &shader);
        costs->depth[quads] = cost(c, samples, &depth);
        costs->write[quads] = later(cost(c, pixels, &by_pixels), cost(c, samples, &by_samples));
        // What was blended is written like anything else, so a blend is never faster.
        costs->blend[0][quads] = later(cost(c, samples, &blend), costs->write[quads]);
        costs->blend[1][quads] = later(cost(c, samples, &wide), costs->write[quads]);
    }
    c->texture_rate = divisor_of((uint64_t)m->texture_samples_per_clock);
    c->kernel_rate = divisor_of((uint64_t)m->kernel_slots_per_clock);
}

static uint64_t quad_count(const clock_state *c, uint64_t lanes)
{
    return count_lanes(frame_quads(c->frame, lanes));
}

static uint64_t color_cost(const clock_state *c, const plane_access *access)
{
    if (!access->written)
        return 0;
    const uint64_t quads = quad_count(c, access->written);
    return access->read ? c->costs.blend[c->frame->plane_bits[access->plane] > 64][quads] : c->costs.write[quads];
}

// The touches of a cache join the partition's; how many.
static inline uint32_t take_touches(const clock_state *c, partition *p, const stamp_lines *lines, access_unit cache)
{
    const line_touch *line = lines->touches[cache];
    const uint32_t first = c->first_line[cache], count = (uint32_t)lines->counts[cache];
    for (uint32_t i = 0; i < count; i++, line++) {
        uint32_t how = (uint32_t)cache << TOUCH_CACHE | (line->miss ? TOUCH_MISS : 0) | (line->replaces ? TOUCH_REPLACES : 0);
        if (line->fill.bytes | line->spill.bytes) {
            how |= TOUCH_MOVES | (uint32_t)p->moves.end << TOUCH_MOVE;
            *move_at(p, (uint32_t)p->moves.end++) = (queued_move){line->fill, line->spill};
        }
        *touch_at(p, (uint32_t)p->touches.end + i) = (queued_touch){first + line->slot, how};
    }
    p->touches.end += count;
    return count;
}

static void charge_kernel(const clock_state *c, partition *p, const stamp *stamp, const stamp_lines *lines, job *job)
{
    const uint32_t first = (uint32_t)p->touches.end;
    const uint32_t depth = take_touches(c, p, lines, ACCESS_DEPTH), color = take_touches(c, p, lines, ACCESS_COLOR);
    job->work[c->stage_of[UNIT_KERNEL_STAGE]] =
        (stage_work){.lanes = stamp->lanes, .cost = cost(c, stamp->kernel_slots, &c->kernel_rate), .first_touch = first, .touch_count = depth + color};
}

static void charge_depth_and_color(const clock_state *c, partition *p, const stamp *stamp, const stamp_lines *lines, job *job)
{
    uint64_t depth_lanes = 0, color_lanes = 0, colors_cost = 0;
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &stamp->accesses[i];
        if (access->unit == ACCESS_DEPTH) {
            depth_lanes |= access->read | access->written;
        } else if (access->unit == ACCESS_COLOR) {
            color_lanes |= access->read | access->written;
            colors_cost += color_cost(c, access);
        }
    }
    const uint64_t depth_cost = depth_lanes ? c->costs.depth[quad_count(c, depth_lanes)] : 0;
    const uint32_t first = (uint32_t)p->touches.end;
    const uint32_t depth = take_touches(c, p, lines, ACCESS_DEPTH), color = take_touches(c, p, lines, ACCESS_COLOR);
    job->work[c->stage_of[UNIT_DEPTH_STAGE]] = (stage_work){.lanes = depth_lanes, .cost = depth_cost, .first_touch = first, .touch_count = depth};
    job->work[c->stage_of[UNIT_COLOR_STAGE]] =
        (stage_work){.lanes = color_lanes, .cost = colors_cost, .first_touch = first + depth, .touch_count = color};
}

void charge_stamp(const clock_state *c, partition *p, const stamp *stamp, const stamp_lines *lines, job *job)
{
    const uint32_t first = (uint32_t)p->touches.end;
    job->tile = stamp->tile;
    job->quads = stamp->quads;
    job->first_touch = p->touches.end;
    job->first_move = p->moves.end;
    job->stretch = c->stretch;
    job->stream_address = lines->stream_address;
    job->stream_read = lines->stream_read;
    job->stream_written = lines->stream_written;
    const uint32_t texture = take_touches(c, p, lines, ACCESS_TEXTURE);
    const uint64_t reads_cost = stamp->texture_reads ? cost(c, 4ull * c->frame->samples * stamp->texture_reads, &c->texture_rate) : 0;
    job->work[c->stage_of[UNIT_SHADER_STAGE]] =
        (stage_work){.second_cost = reads_cost, .cost = c->costs.shader[stamp->quads_shaded], .first_touch = first, .touch_count = texture};
    if (c->pass.free_kernel)
        charge_kernel(c, p, stamp, lines, job);
    else
        charge_depth_and_color(c, p, stamp, lines, job);
}
