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

// The stage's touches are those of one cache, or of two one behind the other.
static void take_touches(const clock_state *c, const stamp_lines *lines, access_unit cache, job *job, stage_work *work)
{
    const line_touch *line = lines->touches[cache];
    const uint32_t count = (uint32_t)lines->counts[cache], first = c->first_line[cache];
    queued_touch *touch = &job->touches[job->touch_count];
    if (!work->touch_count)
        work->first_touch = job->touch_count;
    for (uint32_t i = 0; i < count; i++, line++, touch++) {
        const bool moves = line->fill.bytes || line->spill.bytes;
        *touch = (queued_touch){first + line->slot, job->move_count, (uint8_t)cache, line->miss, line->replaces, moves};
        if (moves)
            job->moves[job->move_count++] = (queued_move){line->fill, line->spill};
    }
    job->touch_count += count;
    work->touch_count += count;
}

static void charge_depth(const clock_state *c, const stamp *stamp, stage_work *work)
{
    uint64_t lanes = 0;
    for (int i = 0; i < stamp->access_count; i++)
        if (stamp->accesses[i].unit == ACCESS_DEPTH)
            lanes |= stamp->accesses[i].read | stamp->accesses[i].written;
    work->lanes = lanes;
    work->cost = lanes ? c->costs.depth[quad_count(c, lanes)] : 0;
}

static void charge_color(const clock_state *c, const stamp *stamp, stage_work *work)
{
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &stamp->accesses[i];
        if (access->unit != ACCESS_COLOR)
            continue;
        work->lanes |= access->read | access->written;
        work->cost += color_cost(c, access);
    }
}

void charge_stamp(const clock_state *c, const stamp *stamp, const stamp_lines *lines, job *job)
{
    job->tile = stamp->tile;
    job->quads = stamp->quads;
    job->touch_count = job->move_count = 0;
    job->stretch = c->stretch;
    job->stream_address = lines->stream_address;
    job->stream_read = lines->stream_read;
    job->stream_written = lines->stream_written;
    for (int s = 0; s < c->stage_count; s++) {
        stage_work *work = &job->work[s];
        *work = (stage_work){0};
        switch (c->stages[s]) {
        case UNIT_SHADER_STAGE:
            work->cost = c->costs.shader[stamp->quads_shaded];
            job->texture_cost = stamp->texture_reads ? cost(c, 4ull * c->frame->samples * stamp->texture_reads, &c->texture_rate) : 0;
            take_touches(c, lines, ACCESS_TEXTURE, job, work);
            break;
        case UNIT_DEPTH_STAGE:
            charge_depth(c, stamp, work);
            take_touches(c, lines, ACCESS_DEPTH, job, work);
            break;
        case UNIT_COLOR_STAGE:
            charge_color(c, stamp, work);
            take_touches(c, lines, ACCESS_COLOR, job, work);
            break;
        default:
            work->lanes = stamp->lanes;
            work->cost = cost(c, stamp->kernel_slots, &c->kernel_rate);
            take_touches(c, lines, ACCESS_DEPTH, job, work);
            take_touches(c, lines, ACCESS_COLOR, job, work);
        }
    }
}
