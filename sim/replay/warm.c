// The stamps before a lead: caches see what they touched, and nobody counts it. What the lead touches comes by itself.
//
// They run block by block like those that are passed over (skip.c), several as one, in the order of each block's last stamp:
// so caches end up with the lines that were used last, as they would.
#include "arrival.h"

#include <stdlib.h>

enum { BLOCKS_AHEAD = 8 };  // whose stamps are asked for before they are run

status warm_make(arrival *a)
{
    a->warm_blocks = malloc(a->tiling.tile_count * sizeof *a->warm_blocks);
    a->warm_seen = calloc(a->tiling.tile_count, sizeof *a->warm_seen);
    return a->warm_blocks && a->warm_seen ? STATUS_OK : report_error(a->report, STATUS_IO, "out of memory: stamps that warm caches");
}

void warm_free(arrival *a)
{
    free(a->warm_blocks);
    free(a->warm_seen);
}

// Those stamps of a batch, from *at on, that came before number `end` and are not discarded by the block's range of depths.
static uint64_t lanes_seen(arrival *a, const block_batch *batch, uint32_t *at, uint32_t end)
{
    const block_stamp *stamps = a->visited->blocks.stamps;
    uint64_t lanes = 0;
    for (; *at < batch->end && stamps[*at].number < end; ++*at)
        if (!stamp_discarded(a, &a->uses[a->visit_step->kernel], a->visited, &a->visited->records[stamps[*at].number]))
            lanes |= stamps[*at].lanes;
    return lanes;
}

static status warm_block(arrival *a, uint32_t tile, uint32_t first, uint32_t end)
{
    const block_order *blocks = &a->visited->blocks;
    const int kernel = a->visit_step->kernel;
    status status = STATUS_OK;
    a->position = first;
    skip_catch_up(a, tile);
    uint32_t at = skip_cursor(a, tile)->next;
    while (status == STATUS_OK && at < blocks->starts[tile + 1] && blocks->stamps[at].number < end) {
        const block_batch *batch = &blocks->batches[blocks->stamps[at].batch];
        const uint64_t lanes = lanes_seen(a, batch, &at, end);
        stamp stamp;
        if (!lanes || !draws_class(a, a->visit_step, batch->draw))
            continue;
        struct batch columns = {.lanes = lanes, .log = a->log};
        skip_columns(a, batch, &columns);
        lanes_execute(a, kernel, NULL, tile, &columns, &stamp);
        status = a->sink->warm(a->sink->user, &stamp);
    }
    skip_cursor(a, tile)->next = at;
    return status;
}

// Blocks enough to fill every cache, at a line each, twice: some touch nothing. What was touched before them has been replaced.
static uint64_t blocks_that_fill(const machine *m)
{
    int64_t most = m->texture_cache_bytes > m->depth_cache_bytes ? m->texture_cache_bytes : m->depth_cache_bytes;
    most = m->color_cache_bytes > most ? m->color_cache_bytes : most;
    return 2 * (uint64_t)((most * m->partitions + m->l2_bytes) / m->line_bytes);
}

// Whether a record's block is drawn and had not been seen on this visit.
static bool see(arrival *a, const stamp_record *record)
{
    if (a->warm_seen[record->tile] == a->warm_visit || !draws_class(a, a->visit_step, record->draw))
        return false;
    a->warm_seen[record->tile] = a->warm_visit;
    return true;
}

// Blocks that the lead, which begins with number `first`, brings to caches itself.
static uint64_t blocks_of_lead(arrival *a, uint32_t first)
{
    const uint64_t end = first + a->plan_of_phases.lead;
    uint64_t count = 0;
    for (uint64_t r = first; r < end && r < a->visited->count; r++)
        count += see(a, &a->visited->records[r]);
    return count;
}

status warm_run(arrival *a, uint32_t end)
{
    a->warm_visit++;
    a->warming = false;
    const uint64_t all = blocks_that_fill(a->machine), led = blocks_of_lead(a, end), enough = all > led ? all - led : 0;
    uint32_t count = 0, first = end;
    status status = STATUS_OK;
    while (first > a->warm_first && count < enough) {
        const stamp_record *record = &a->visited->records[--first];
        if (see(a, record))
            a->warm_blocks[count++] = record->tile;
    }
    while (status == STATUS_OK && count) {
        if (count > BLOCKS_AHEAD)
            skip_ahead(a, a->warm_blocks[count - 1 - BLOCKS_AHEAD]);
        status = warm_block(a, a->warm_blocks[--count], first, end);
    }
    return status;
}
