// What the work on a stamp costs in each stage, in parts of a cycle, by the machine's rates.
//
// Rates are of the chip; a partition has its share. A quad with any sample counts whole. A colour access that reads is a
// blend; one that only writes replaces.
#include "clock.h"

enum { RATE_SHADER, RATE_TEXTURE, RATE_DEPTH, RATE_PIXELS, RATE_SAMPLES, RATE_BLEND, RATE_WIDE, RATE_KERNEL };

void charge_init(clock_state *c)
{
    const machine *m = c->machine;
    const int64_t rates[] = {
        [RATE_SHADER] = m->shader_operations_per_clock, [RATE_TEXTURE] = m->texture_samples_per_clock,
        [RATE_DEPTH] = m->depth_samples_per_clock,      [RATE_PIXELS] = m->color_pixels_per_clock,
        [RATE_SAMPLES] = m->color_samples_per_clock,    [RATE_BLEND] = m->blend_samples_per_clock,
        [RATE_WIDE] = m->blend_wide_samples_per_clock,  [RATE_KERNEL] = m->kernel_slots_per_clock,
    };
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++)
        c->rates[i] = divisor_of((uint64_t)rates[i]);
}

static uint64_t cost(const clock_state *c, uint64_t work, int rate)
{
    uint64_t rest;
    const uint64_t parts = divide(work * (uint64_t)c->partition_count * CYCLE_PARTS, &c->rates[rate], &rest);
    return parts + (rest > 0);
}

static uint64_t quad_count(const clock_state *c, uint64_t lanes)
{
    return count_lanes(frame_quads(c->frame, lanes));
}

static uint64_t color_cost(const clock_state *c, const plane_access *access)
{
    const uint64_t pixels = 4 * quad_count(c, access->written), samples = pixels * c->frame->samples;
    if (!access->written)
        return 0;
    const uint64_t by_pixels = cost(c, pixels, RATE_PIXELS), by_samples = cost(c, samples, RATE_SAMPLES);
    const uint64_t write = by_pixels > by_samples ? by_pixels : by_samples;
    if (!access->read)
        return write;
    // What was blended is written like anything else, so a blend is never faster.
    const uint64_t blend = cost(c, samples, c->frame->plane_bits[access->plane] > 64 ? RATE_WIDE : RATE_BLEND);
    return blend > write ? blend : write;
}

// The stage's touches are those of one cache, or of two one behind the other.
static void take_touches(const stamp_lines *lines, access_unit cache, job *job, stage_work *work)
{
    if (!work->touch_count)
        work->first_touch = job->touch_count;
    for (int i = 0; i < lines->counts[cache]; i++) {
        const line_touch *line = &lines->touches[cache][i];
        const bool moves = line->fill.bytes || line->spill.bytes;
        if (moves)
            job->moves[job->move_count] = (queued_move){line->fill, line->spill};
        job->touches[job->touch_count++] = (queued_touch){line->slot, job->move_count, (uint8_t)cache, line->miss, line->replaces, moves};
        job->move_count += moves;
    }
    work->touch_count += (uint32_t)lines->counts[cache];
}

static void charge_rop(const clock_state *c, const stamp *stamp, access_unit unit, stage_work *work)
{
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &stamp->accesses[i];
        if (access->unit != unit)
            continue;
        work->lanes |= access->read | access->written;
        work->cost += unit == ACCESS_COLOR ? color_cost(c, access) : 0;
    }
    if (unit == ACCESS_DEPTH && work->lanes)
        work->cost = cost(c, 4 * c->frame->samples * quad_count(c, work->lanes), RATE_DEPTH);
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
            work->cost = cost(c, 4ull * c->pass.shader_operations * stamp->quads_shaded, RATE_SHADER);
            work->second_cost = cost(c, 4ull * c->frame->samples * stamp->texture_reads, RATE_TEXTURE);
            take_touches(lines, ACCESS_TEXTURE, job, work);
            break;
        case UNIT_DEPTH_STAGE:
            charge_rop(c, stamp, ACCESS_DEPTH, work);
            take_touches(lines, ACCESS_DEPTH, job, work);
            break;
        case UNIT_COLOR_STAGE:
            charge_rop(c, stamp, ACCESS_COLOR, work);
            take_touches(lines, ACCESS_COLOR, job, work);
            break;
        default:
            work->lanes = stamp->lanes;
            work->cost = cost(c, stamp->kernel_slots, RATE_KERNEL);
            take_touches(lines, ACCESS_DEPTH, job, work);
            take_touches(lines, ACCESS_COLOR, job, work);
        }
    }
}
