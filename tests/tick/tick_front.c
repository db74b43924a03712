// The front end of the ticking machine: geometry and bins from memory, set-up by the rates, stamps to their partitions.
#include "tick_parts.h"

#include <stdlib.h>

uint64_t tick_divided_up(uint64_t a, uint64_t b, uint64_t c)  // a * b / c
{
    __extension__ typedef unsigned __int128 wide;
    return (uint64_t)(((wide)a * b + c - 1) / c);
}

// Of the whole pass, in 2^-20 cycles.
static uint64_t geometry_time(const tick *t)
{
    const uint64_t triangles =
        tick_divided_up(t->pass.triangles, 1000 * TICK_ONE, (uint64_t)t->machine->triangles_per_kiloclock);
    const uint64_t vertices =
        tick_divided_up(t->pass.vertices, 1000 * TICK_ONE, (uint64_t)t->machine->vertices_per_kiloclock);
    return triangles > vertices ? triangles : vertices;
}

static bool bins(const tick *t)
{
    return t->machine->tile_based && t->pass.kind == PASS_DRAW;
}

static uint64_t lines_of(const tick *t, uint64_t primitives)
{
    const uint64_t n = t->pass.primitives;
    return primitives >= n ? t->lines : tick_divided_up(primitives, t->lines, n);
}

// Geometry has a place of its own, and so have bins: line i is in channel i mod partitions.
static uint64_t geometry_address(const tick *t, uint64_t line, bool of_bins)
{
    const uint64_t base = UINT64_C(1) << (of_bins ? 41 : 40);
    return base + line / (uint64_t)t->machine->partitions * (uint64_t)t->machine->line_bytes;
}

static const uint64_t *read_line(tick *t, uint64_t line, bool of_bins)
{
    const uint32_t p = (uint32_t)(line % (uint64_t)t->machine->partitions);
    return tick_memory_read(t->memory, p, t->now, geometry_address(t, line, of_bins), (uint32_t)t->machine->line_bytes);
}

static void ask_lines(tick *t, uint64_t until)
{
    for (; t->lines_asked < until; t->lines_asked++)
        t->line_answers[t->lines_asked] = read_line(t, t->lines_asked, bins(t));
}

bool tick_lines_there(const tick *t, uint64_t count)
{
    for (uint64_t i = 0; i < count; i++)
        if (i >= t->lines_asked || *t->line_answers[i] > t->now)
            return false;
    return true;
}

static bool write_bin_line(tick *t, uint64_t line)
{
    const uint32_t p = (uint32_t)(line % (uint64_t)t->machine->partitions);
    return tick_memory_write(t->memory, p, t->now, geometry_address(t, line, true), (uint32_t)t->machine->line_bytes);
}

// Tile-based: from the cycle after the start on, at the pace of the set-up and at most one of each a cycle, geometry is
// read and bins are written. Nothing else goes on meanwhile.
static void fill_bins(tick *t)
{
    const uint64_t written = geometry_writes(t->machine, &t->pass), read = t->lines - written;
    const uint64_t most = read > written ? read : written, cycles = up(geometry_time(t));
    const uint64_t **answers = calloc(read + 1, sizeof *answers);
    uint64_t done = 0, cycle = t->start + 1;
    bool asked = false;
    while (done < most) {
        tick_memory_advance(t->memory, t->now);
        if (t->now >= cycle && t->now >= t->start + tick_divided_up(cycles, done, most)) {
            if (!asked && done < read)
                answers[done] = read_line(t, done, false);
            asked = true;
            if (done >= written || write_bin_line(t, done)) {
                done++;
                asked = false;
                cycle = t->now + 1;
                if (done == most)
                    break;
            }
        }
        t->now++;
    }
    for (bool there = false; !there; t->now += !there) {
        tick_memory_advance(t->memory, t->now);
        there = t->now >= t->start + cycles;
        for (uint64_t i = 0; i < read; i++)
            there &= *answers[i] <= t->now;
    }
    free(answers);
    t->lines = written;
    t->geometry = 0;
}

void tick_start_geometry(tick *t)
{
    t->lines = geometry_reads(t->machine, &t->pass);
    t->lines_asked = 0;
    t->line_answers = realloc(t->line_answers, (t->lines + 1) * sizeof *t->line_answers);
    t->leaving = 0;
    t->primitive = UINT64_MAX;
    t->geometry = geometry_time(t);
    t->set_up = realloc(t->set_up, (t->pass.primitives + 1) * sizeof *t->set_up);
    t->begun = realloc(t->begun, (t->pass.primitives + 1) * sizeof *t->begun);
    t->set_up_count = 0;
    t->now = t->start;
    if (bins(t))
        fill_bins(t);
    t->geometry_start = t->now;
    t->raster_free = t->now * TICK_ONE;
    t->last_fragment = t->now + up(t->geometry);
}

// Primitives are set up one behind the other, at most so many ahead of the one that the rasterizer has come to.
static void set_up_until(tick *t, uint64_t primitive)
{
    const uint64_t n = t->pass.primitives, ahead = (uint64_t)t->machine->triangles_ahead;
    for (uint64_t j = t->set_up_count; j <= primitive; j++) {
        const uint64_t before = j ? t->set_up[j - 1] : t->geometry_start * TICK_ONE;
        const uint64_t room = (j < ahead ? t->geometry_start : t->begun[j - ahead]) * TICK_ONE;
        const uint64_t share = tick_divided_up(t->geometry, j + 1, n) - tick_divided_up(t->geometry, j, n);
        t->set_up[j] = longer(before, room) + share;
        t->set_up_count = j + 1;
    }
}

// Whether the primitive's stamps may leave.
static bool is_set_up(tick *t, uint64_t primitive)
{
    if (t->pass.primitives == 0)
        return true;
    set_up_until(t, primitive);
    return t->now >= up(t->set_up[primitive]) && tick_lines_there(t, lines_of(t, primitive + 1));
}

// The rasterizer turns to its next stamp: lines are asked for ahead.
static bool step_geometry(tick *t)
{
    const uint64_t turned_to = t->leaving < t->item_count ? t->items[t->leaving].primitive : t->pass.primitives;
    if (turned_to == t->primitive)
        return false;
    t->primitive = turned_to;
    ask_lines(t, lines_of(t, turned_to + (uint64_t)t->machine->triangles_ahead + 1));
    return true;
}

bool tick_step_rasterizer(tick *t)
{
    if (step_geometry(t))
        return true;
    if (t->leaving == t->item_count)
        return false;
    item *item = &t->items[t->leaving];
    partition *p = &t->partitions[item->partition];
    if (t->raster_free >= (t->now + 1) * TICK_ONE || !is_set_up(t, item->primitive))
        return false;
    if (!item->hierarchical && p->left - p->begun[0] >= (uint64_t)t->machine->raster_queue)
        return false;
    const uint64_t at = t->raster_free > t->now * TICK_ONE ? t->raster_free : t->now * TICK_ONE;
    t->raster_free = at + tick_divided_up(1, TICK_ONE, (uint64_t)t->machine->raster_blocks_per_clock);
    if (!item->hierarchical) {
        item->visits[0].arrived = up(t->raster_free);
        p->order[p->left++] = t->leaving;
    }
    note_done(t, up(t->raster_free));
    if (t->pass.primitives && (t->leaving == 0 || item[-1].primitive != item->primitive))
        t->begun[item->primitive] = t->now;
    t->leaving++;
    return true;
}
