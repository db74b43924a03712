// The front end: vertices and triangles at their rates, their lines from memory, and the rasterizer that hands stamps out.
//
// Triangles with fragments are set up one behind the other, each in its share of the pass's geometry time, as long as fewer than
// triangles_ahead wait; their lines are asked for as many triangles ahead. A stamp leaves the rasterizer when that is free and its partition's queue
// has room. On a tile-based machine all triangles are set up, written to bins and drained before the first stamp.
#include "clock.h"

// Addresses of their own.
static const uint64_t GEOMETRY_BASE = UINT64_C(1) << 40, BINS_BASE = UINT64_C(1) << 41;

// value * numerator / denominator, rounded up.
static uint64_t share_up(uint64_t value, uint64_t numerator, uint64_t denominator)
{
    __extension__ typedef unsigned __int128 wide;
    return (uint64_t)(((wide)value * numerator + denominator - 1) / denominator);
}

// From share number `i` on.
static shares shares_from(uint64_t value, uint64_t count, uint64_t i)
{
    __extension__ typedef unsigned __int128 wide;
    if (!count)
        return (shares){0};
    const uint64_t behind = (uint64_t)((wide)value * i % count);
    return (shares){.count = count, .least = value / count, .rest = value % count, .over = behind ? count - behind : 0};
}

static uint64_t next_share(shares *s)
{
    const uint64_t one_more = s->rest > s->over;
    s->over += (s->count & -one_more) - s->rest;  // a branch would be missed
    return s->least + one_more;
}

static uint64_t next_place(uint64_t place, int64_t places)
{
    return place + 1 == (uint64_t)places ? 0 : place + 1;
}

// A channel is asked in order of time, so its partition goes first, if it may ask.
static uint64_t read_line(clock_state *c, uint64_t base, uint64_t number)
{
    uint64_t turn;
    const uint64_t address = base + divide(number, &c->partitions_by, &turn) * (uint64_t)c->machine->line_bytes;
    if (!partition_moves_nothing(c, &c->partitions[turn]))
        partition_advance(c, &c->partitions[turn], c->front.now);
    return channel_read(c->partitions[turn].channel, c->front.now, address, (uint32_t)c->machine->line_bytes);
}

static void write_line(clock_state *c, uint64_t number)
{
    uint64_t turn;
    const uint64_t address = BINS_BASE + divide(number, &c->partitions_by, &turn) * (uint64_t)c->machine->line_bytes;
    while (!clock_write(&c->partitions[turn], c->front.now, address, (uint32_t)c->machine->line_bytes, &c->front.now))
        continue;
}

// One line a cycle, at the pace of the set-up; the rasterizer starts when all is there.
static void bin_all(clock_state *c, uint64_t reads, uint64_t writes)
{
    front *f = &c->front;
    uint64_t ready = f->start + cycles_up(f->geometry);
    const uint64_t most = later(reads, writes);
    for (uint64_t i = 0; i < most; i++) {
        f->now = later(f->now + 1, f->start + share_up(cycles_up(f->geometry), i, most));
        if (i < reads)
            ready = later(ready, read_line(c, GEOMETRY_BASE, i));
        if (i < writes)
            write_line(c, i);
    }
    f->now = later(f->now, ready);
    f->raster_free = f->now * CYCLE_PARTS;
    f->geometry = 0;
}

static uint64_t rate_parts(uint64_t count, int64_t per_kiloclock)
{
    return share_up(count, 1000 * CYCLE_PARTS, (uint64_t)per_kiloclock);
}

void front_begin(clock_state *c)
{
    front *f = &c->front;
    const pass_info *pass = &c->pass;
    const uint64_t rate = (uint64_t)c->machine->raster_blocks_per_clock;
    *f = (front){.now = c->drained, .start = c->drained, .raster_free = c->drained * CYCLE_PARTS, .takes = (CYCLE_PARTS + rate - 1) / rate,
                 .read_ready = f->read_ready, .begun = f->begun};
    f->geometry = later(rate_parts(pass->triangles, c->machine->triangles_per_kiloclock),
                        rate_parts(pass->vertices, c->machine->vertices_per_kiloclock));
    c->bounds[RESOURCE_GEOMETRY] = f->geometry / CYCLE_PARTS;
    f->reads = geometry_reads(c->machine, pass);
    f->read_done = f->start;
    f->set_up = f->start * CYCLE_PARTS;
    f->base = GEOMETRY_BASE;
    if (c->machine->tile_based && pass->kind == PASS_DRAW) {
        const uint64_t binned = geometry_writes(c->machine, pass);
        bin_all(c, f->reads - binned, binned);
        f->start = f->now;
        f->set_up = f->start * CYCLE_PARTS;
        f->reads = binned;  // each primitive's record comes back from its bin
        f->base = BINS_BASE;
    }
    f->set_up_shares = shares_from(f->geometry, pass->primitives, 0);
    f->read_shares = shares_from(f->reads, pass->primitives, 0);
}

// Asks for the lines of all primitives up to the next one and those ahead of it.
static void ask_ahead(clock_state *c)
{
    front *f = &c->front;
    const uint64_t count = c->pass.primitives, ahead = (uint64_t)c->machine->triangles_ahead;
    const uint64_t end = f->primitive + ahead < count ? f->primitive + ahead + 1 : count;
    for (; f->asked < end; f->asked++) {
        for (uint64_t left = next_share(&f->read_shares); left > 0; left--)
            f->read_done = later(f->read_done, read_line(c, f->base, f->reads_issued++));
        f->read_ready[f->asked_place] = f->read_done;
        f->asked_place = next_place(f->asked_place, c->machine->triangles_ahead + 1);
    }
}

// When the next primitive is set up: behind the one before it, as soon as fewer than triangles_ahead wait for the rasterizer.
static uint64_t set_up(clock_state *c)
{
    front *f = &c->front;
    // Its share of all that the pass's geometry takes, so that all shares add up to it.
    const uint64_t share = next_share(&f->set_up_shares);
    const uint64_t room = f->primitive < (uint64_t)c->machine->triangles_ahead ? f->start : f->begun[f->begun_place];
    f->set_up = later(f->set_up, room * CYCLE_PARTS) + share;
    return cycles_up(f->set_up);
}

void front_next(clock_state *c, const stamp *stamp)
{
    front *f = &c->front;
    uint64_t when = later(f->now, f->raster_free / CYCLE_PARTS);
    f->begins = stamp->begins_primitive && f->primitive < c->pass.primitives;
    if (f->begins) {
        ask_ahead(c);
        const uint64_t is_set_up = set_up(c), there = later(is_set_up, f->read_ready[f->read_place]);
        f->there = there > when && there == is_set_up ? there : 0;
        if (there > when) {
            c->statistics->raster_wait_geometry += there - when;
            when = there;
        }
    }
    f->when = when;
}

void front_step(clock_state *c)
{
    front *f = &c->front;
    f->now = f->when;
    if (f->begins) {
        f->paced += f->there == f->now;
        f->begun[f->begun_place] = f->now;
        f->begun_place = next_place(f->begun_place, c->machine->triangles_ahead);
        f->read_place = next_place(f->read_place, c->machine->triangles_ahead + 1);
        f->primitive++;
    }
    f->raster_free = later(f->raster_free, f->now * CYCLE_PARTS) + f->takes;
    f->busy += f->takes;
    c->last_fragment = later(c->last_fragment, cycles_up(f->raster_free));
}

void front_end(clock_state *c)
{
    front *f = &c->front;
    while (f->reads_issued < f->reads)
        f->read_done = later(f->read_done, read_line(c, f->base, f->reads_issued++));
    c->last_fragment = later(c->last_fragment, later(f->read_done, later(cycles_up(f->set_up), f->start + cycles_up(f->geometry))));
}

// What stood at i stands at i + step, modulo the size: three reversals.
static void reverse(uint64_t *from, uint64_t count)
{
    for (uint64_t i = 0; i < count / 2; i++) {
        const uint64_t kept = from[i];
        from[i] = from[count - 1 - i];
        from[count - 1 - i] = kept;
    }
}

static void shift_ring(uint64_t *ring, uint64_t size, uint64_t step)
{
    reverse(ring, size);
    reverse(ring, step % size);
    reverse(ring + step % size, size - step % size);
}

// Triangles that wait for the rasterizer, and lines that were asked for, become those of the primitives that come now.
void clock_resume(clock_state *c, uint64_t begun)
{
    front *f = &c->front;
    const uint64_t ahead = (uint64_t)c->machine->triangles_ahead, count = c->pass.primitives;
    c->stretch++;
    if (!count || begun <= f->primitive)
        return;
    const uint64_t step = begun - f->primitive, there = f->asked + step < count ? f->asked + step : count;
    shift_ring(f->begun, ahead, step);
    shift_ring(f->read_ready, ahead + 1, step);
    f->primitive = begun;
    f->begun_place = begun % ahead;
    f->read_place = begun % (ahead + 1);
    f->set_up_shares = shares_from(f->geometry, count, begun);
    f->asked = there;
    f->asked_place = there % (ahead + 1);
    f->read_shares = shares_from(f->reads, count, there);
    f->reads_issued = later(f->reads_issued, share_up(f->reads, there, count));
}
