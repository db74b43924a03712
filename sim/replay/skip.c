// Stamps that nobody looks at: those of a block are run together, as long as no sample occurs twice, since order matters to a
// sample alone. They are run before the next stamp is looked at, and before the pass or the chunk ends.
#include "arrival.h"

#include <stdlib.h>

static const uint32_t NOTHING = UINT32_MAX;

static const stamp_record *record_of(const arrival *a, const skipped *s)
{
    return &a->stamps.chunks[s->chunk].records[s->record];
}

static status refuse_memory(const arrival *a)
{
    return report_error(a->report, STATUS_IO, "out of memory: stamps that are passed over");
}

static bool make_blocks(arrival *a)
{
    const uint32_t tiles = a->tiling.tile_count;
    a->skipped_blocks = calloc(tiles, sizeof *a->skipped_blocks);
    return a->skipped_blocks;
}

status skip_stamp(arrival *a, const step *step, uint32_t chunk, uint32_t record)
{
    const stamp_record *r = &a->stamps.chunks[chunk].records[record];
    if (stamp_discarded(a, &a->uses[step->kernel], &a->stamps.chunks[chunk], r))
        return STATUS_OK;
    if (!a->skipped_blocks && !make_blocks(a))
        return refuse_memory(a);
    skipped_block *block = &a->skipped_blocks[r->tile];
    if (block->lanes & r->lanes) {
        const status status = skip_run_tile(a, step, r->tile);
        if (status != STATUS_OK)
            return status;
    }
    if (a->skipped_count == a->skipped_capacity) {
        const uint32_t capacity = a->skipped_capacity ? 2 * a->skipped_capacity : 4096;
        skipped *grown = realloc(a->skipped, (size_t)capacity * sizeof *grown);
        if (!grown)
            return refuse_memory(a);
        a->skipped = grown;
        a->skipped_capacity = capacity;
    }
    a->skipped[a->skipped_count] = (skipped){chunk, record, NOTHING};
    if (block->lanes)
        a->skipped[block->last].next = a->skipped_count;
    else
        block->first = a->skipped_count;
    block->last = a->skipped_count++;
    block->lanes |= r->lanes;
    return STATUS_OK;
}

status skip_run_tile(arrival *a, const step *step, uint32_t tile)
{
    skipped_block *block = a->skipped_blocks ? &a->skipped_blocks[tile] : NULL;
    if (!block || !block->lanes)
        return STATUS_OK;
    stamp stamp = {0};
    const uint64_t lanes = block->lanes;
    block->lanes = 0;
    const skipped *first = &a->skipped[block->first];
    if (first->next == NOTHING) {
        block_execute(a, step->kernel, &a->stamps.chunks[first->chunk], record_of(a, first), tile, lanes, &stamp);
    } else {
        stamp_execute_merged(a, step->kernel, block->first, tile, lanes, &stamp);
    }
    return a->sink->skip(a->sink->user, &stamp);
}

// Blocks go in the order of their last stamps, so that caches end up with what they would hold: the lines used last.
status skip_run_all(arrival *a, const step *step)
{
    status status = STATUS_OK;
    for (uint32_t i = 0; status == STATUS_OK && i < a->skipped_count; i++) {
        const uint32_t tile = record_of(a, &a->skipped[i])->tile;
        if (a->skipped[i].next == NOTHING && a->skipped_blocks[tile].last == i)
            status = skip_run_tile(a, step, tile);
    }
    a->skipped_count = 0;
    return status;
}
