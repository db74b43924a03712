// A machine and a frame in; where each block lies and what partition has it out.
//
// A block in column x and row y belongs to partition (x + step * y) mod partitions; on a tile-based machine, the region's
// column and row count. Within a partition its blocks are numbered by rows; a plane's blocks follow each other, so that
// the bits that choose a partition are no bits of the cache's set.
#include "memory.h"

#include <stdlib.h>
#include <string.h>

static uint32_t power_above(uint32_t value)
{
    uint32_t power = 1;
    while (power < value)
        power *= 2;
    return power;
}

static uint64_t valid_lanes(const frame *f, uint32_t tile)
{
    const uint32_t x = tile % f->columns * f->tile_width, y = tile / f->columns * f->tile_height;
    uint64_t lanes = 0;
    for (uint32_t lane = 0; lane < TILE_LANES; lane++) {
        const uint32_t pixel = lane / f->samples;
        lanes |= (uint64_t)(x + pixel % f->tile_width < f->width && y + pixel / f->tile_width < f->height) << lane;
    }
    return lanes;
}

static status deal_out(memory *m)
{
    const frame *f = m->frame;
    const machine *k = m->machine;
    m->homes = malloc(f->tile_count * sizeof *m->homes);
    m->blocks = calloc((size_t)k->partitions, sizeof *m->blocks);
    m->stream_bytes = calloc((size_t)k->partitions, sizeof *m->stream_bytes);
    if (!m->homes || !m->blocks || !m->stream_bytes)
        return report_error(m->report, STATUS_IO, "out of memory: %u blocks", f->tile_count);
    const uint32_t across = k->tile_based ? (uint32_t)k->region_pixels / f->tile_width : 1;
    const uint32_t down = k->tile_based ? (uint32_t)k->region_pixels / f->tile_height : 1;
    for (uint32_t t = 0; t < f->tile_count; t++) {
        const uint32_t column = t % f->columns, row = t / f->columns;
        const uint64_t x = column / across, y = row / down;
        home *home = &m->homes[t];
        home->partition = (uint8_t)((x + y * (uint64_t)k->partition_row_step) % (uint64_t)k->partitions);
        home->number = m->blocks[home->partition]++;
        home->lanes = valid_lanes(f, t);
        home->region = row / down * f->columns + column / across + 1;
        home->region_block = row % down * across + column % across;
    }
    m->region_blocks = across * down;
    return STATUS_OK;
}

static uint64_t most_blocks(const memory *m)
{
    uint64_t most = 0;
    for (int64_t p = 0; p < m->machine->partitions; p++)
        most = m->blocks[p] > most ? m->blocks[p] : most;
    return most;
}

// Planes stay on the chip in the order in which they are declared, as long as they fit.
static status choose_on_chip(memory *m)
{
    enum { OVERFLOW_REFUSE = 0 };  // on_chip_overflow: "refuse spill"
    const machine *k = m->machine;
    int64_t bits = 0;
    for (int i = 0; i < m->frame->plane_count; i++) {
        bits += m->frame->plane_bits[i];
        m->planes[i].on_chip = k->tile_based && bits <= k->on_chip_bits;
        m->planes[i].one_line = m->planes[i].parts == 1 && !m->planes[i].on_chip;
        m->planes[i].chip_slot = m->chip_lines;
        m->chip_lines += m->planes[i].on_chip ? m->planes[i].parts : 0;
    }
    if (k->tile_based && bits > k->on_chip_bits && k->on_chip_overflow == OVERFLOW_REFUSE)
        return report_error(m->report, STATUS_REFUSED,
                            "the planes take %lld bits a sample, and %s keeps %lld on the chip (on_chip_bits); on_chip_overflow=spill lets the rest go through caches",
                            (long long)bits, k->name, (long long)k->on_chip_bits);
    return STATUS_OK;
}

status layout_make(memory *m)
{
    enum { PLANE_BANKS = 3 };  // from one plane to the next: stamps go to and fro between planes, each time to another row
    const frame *f = m->frame;
    status status = deal_out(m);
    if (status != STATUS_OK)
        return status;
    const uint64_t row = (uint64_t)m->machine->memory_row_bytes, banks = (uint64_t)m->machine->memory_banks, blocks = most_blocks(m);
    uint64_t base = 0;
    for (int i = 0; i < f->plane_count; i++) {
        plane_layout *plane = &m->planes[i];
        const uint32_t block_bytes = (uint32_t)(TILE_LANES * f->plane_bits[i] / 8);
        const bool color = format_table[f->plane_formats[i]].class == FORMAT_CLASS_COLOR;
        plane->parts = 1;
        while (block_bytes / plane->parts > (uint32_t)m->machine->line_bytes)
            plane->parts *= 2;
        plane->part_shift = (uint32_t)__builtin_ctz(TILE_LANES / plane->parts);
        plane->first_lanes = UINT64_MAX >> (TILE_LANES - TILE_LANES / plane->parts);
        plane->first_line = m->block_lines;
        m->block_lines += plane->parts;
        plane->part_bytes = block_bytes / plane->parts;
        for (uint32_t quarters = STATE_CLEARED; quarters <= STATE_WHOLE; quarters++)
            plane->state_bytes[quarters] = round_to_bursts(m, (plane->part_bytes * quarters + 3) / 4);
        plane->part_stride = power_above(round_to_bursts(m, plane->part_bytes));
        while (bank_of_row(base / row, banks) != (uint64_t)(PLANE_BANKS * i) % banks)
            base += row;
        plane->base = base;
        plane->unit = color ? ACCESS_COLOR : ACCESS_DEPTH;
        plane->compressed = color ? m->machine->color_compression : m->machine->depth_compression;
        const size_t states = (size_t)f->tile_count * plane->parts;
        plane->states = malloc(states);
        if (!plane->states)
            return report_error(m->report, STATUS_IO, "out of memory: states of %zu lines", states);
        // Memory that nothing was written to holds zeros, which is what a plane without a clear starts with.
        memset(plane->states, STATE_WHOLE, states);
        base += (blocks * plane->parts * plane->part_stride + row - 1) / row * row;
    }
    m->stream_base = base;
    return choose_on_chip(m);
}

uint64_t line_address(const memory *m, line_place at)
{
    const plane_layout *plane = &m->planes[at.plane];
    return plane->base + ((uint64_t)m->homes[at.tile].number * plane->parts + at.part) * plane->part_stride;
}

// Planes start at different sets, so that those of one block do not meet in one.
uint32_t line_set(const memory *m, const cache *cache, line_place at)
{
    enum { PLANE_STEP = 7 };
    const plane_layout *plane = &m->planes[at.plane];
    return cache_set(cache, m->homes[at.tile].number * plane->parts + at.part + at.plane * PLANE_STEP);
}
