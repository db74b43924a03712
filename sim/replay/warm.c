// The stamps before a lead: caches see what they touched, and nobody counts it.
//
// They run block by block like those that are passed over (skip.c), several as one. Of each access that these made caches hear when the last
// of them made it, so they end up with the lines that were used last.
#include "arrival.h"

#include <stdlib.h>

enum { BLOCKS_AHEAD = 8 };  // whose stamps are asked for before they are run

status warm_make(arrival *a)
{
    a->warm_last = malloc(a->tiling.tile_count * sizeof *a->warm_last);
    a->warm_seen = calloc(a->tiling.tile_count, sizeof *a->warm_seen);
    return a->warm_last && a->warm_seen ? STATUS_OK : report_error(a->report, STATUS_IO, "out of memory: stamps that warm caches");
}

void warm_free(arrival *a)
{
    free(a->warm_last);
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

// When the last of those stamps from `from` on and before `at` made an access.
static uint64_t last_access(const arrival *a, const plane_access *access, uint32_t from, uint32_t at)
{
    const block_stamp *stamps = a->visited->blocks.stamps;
    while (--at > from && !(stamps[at].lanes & (access->read | access->written)))
        continue;
    return a->visit_time + stamps[at].number;
}

// Shows the stamps of a block from number `first` on, up to number `last`.
static status warm_block(arrival *a, uint32_t first, uint32_t last)
{
    const block_order *blocks = &a->visited->blocks;
    const uint32_t tile = a->visited->records[last].tile, end = blocks->places[last] + 1;
    const int kernel = a->visit_step->kernel;
    status status = STATUS_OK;
    uint32_t at = end - 1;
    while (at > blocks->starts[tile] && blocks->stamps[at - 1].number >= first)
        at--;
    a->position = first;
    skip_until(a, tile, at, end);
    while (status == STATUS_OK && at < end) {
        const block_batch *batch = &blocks->batches[blocks->stamps[at].batch];
        const uint32_t from = at;
        const uint64_t lanes = lanes_seen(a, batch, &at, last + 1);
        uint64_t times[2 * PLANE_MAX];
        stamp stamp;
        if (!lanes || !draws_class(a, a->visit_step, batch->draw))
            continue;
        struct batch columns = {.lanes = lanes, .log = a->log};
        skip_columns(a, batch, &columns);
        lanes_execute(a, kernel, NULL, tile, &columns, &stamp);
        for (int i = 0; i < stamp.access_count; i++)
            times[i] = last_access(a, &stamp.accesses[i], from, at);
        status = a->sink->warm(a->sink->user, &stamp, times);
    }
    return status;
}

// Blocks that fill caches of so many bytes twice, if `looked` stamps touch so many of their lines.
static uint64_t blocks_that_fill(const machine *m, int64_t bytes, uint64_t lines, uint64_t looked)
{
    return lines ? 2 * (uint64_t)((bytes * m->partitions + m->l2_bytes) / m->line_bytes) * looked / lines : 0;
}

// Enough of them for all caches that are touched: what was touched before has been replaced.
static uint64_t blocks_enough(const machine *m, const phase_plan *p)
{
    const uint64_t *lines = p->accesses;
    const int64_t rop = (lines[ACCESS_DEPTH] ? m->depth_cache_bytes : 0) + (lines[ACCESS_COLOR] ? m->color_cache_bytes : 0);
    const uint64_t textures = blocks_that_fill(m, m->texture_cache_bytes, lines[ACCESS_TEXTURE], p->looked);
    const uint64_t changes = blocks_that_fill(m, rop, lines[ACCESS_DEPTH] + lines[ACCESS_COLOR], p->looked);
    return textures > changes ? textures : changes;
}

// Whether a record's block is drawn and had not been seen on this visit.
static bool see(arrival *a, const stamp_record *record)
{
    if (a->warm_seen[record->tile] == a->warm_visit || !draws_class(a, a->visit_step, record->draw))
        return false;
    a->warm_seen[record->tile] = a->warm_visit;
    return true;
}

status warm_run(arrival *a, uint32_t end)
{
    a->warm_visit++;
    a->warming = false;
    const uint64_t enough = blocks_enough(a->machine, &a->plan_of_phases);
    uint32_t count = 0, first = end;
    status status = STATUS_OK;
    while (first > a->warm_first && count < enough) {
        const stamp_record *record = &a->visited->records[--first];
        if (see(a, record))
            a->warm_last[count++] = first;
    }
    while (status == STATUS_OK && count) {
        if (count > BLOCKS_AHEAD)
            skip_ahead(a, a->warm_last[count - 1 - BLOCKS_AHEAD]);
        status = warm_block(a, first, a->warm_last[--count]);
    }
    return status;
}
