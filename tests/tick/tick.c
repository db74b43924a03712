// Passes and stamps with their lookups in, the cycle in which each pass is drained out. See tick.h; docs/machine.md, "Cycles".
//
// A pass is buffered whole and then ticked. Within a cycle the most downstream step that can be taken is taken, until there
// is none: so a stamp may pass through several units in one cycle if nothing holds it.
#include "tick_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

tick *tick_create(const machine *machine, const frame *frame, const uint32_t slots[ACCESS_UNITS])
{
    tick *t = calloc(1, sizeof *t);
    t->machine = machine;
    t->frame = frame;
    memcpy(t->slot_counts, slots, sizeof t->slot_counts);
    t->memory = tick_memory_create(machine);
    t->partitions = calloc((size_t)machine->partitions, sizeof *t->partitions);
    for (int64_t p = 0; p < machine->partitions; p++)
        for (int c = 0; c < ACCESS_UNITS; c++) {
            t->partitions[p].slots[c] = calloc(slots[c], sizeof(slot));
            t->partitions[p].pending[c] = calloc(TICK_MISSES + 1, sizeof *t->partitions[p].pending[c]);
        }
    return t;
}

static void free_items(tick *t)
{
    for (uint32_t i = 0; i < t->item_count; i++)
        for (int u = 0; u < t->units; u++) {
            free(t->items[i].visits[u].touches);
            free(t->items[i].visits[u].data);
        }
    t->item_count = 0;
}

void tick_destroy(tick *t)
{
    if (!t)
        return;
    free_items(t);
    for (int64_t p = 0; p < t->machine->partitions; p++) {
        free(t->partitions[p].order);
        for (int c = 0; c < ACCESS_UNITS; c++) {
            free(t->partitions[p].slots[c]);
            free(t->partitions[p].pending[c]);
        }
    }
    free(t->partitions);
    tick_memory_destroy(t->memory);
    free(t->items);
    free(t->flushes);
    free(t->line_answers);
    free(t->set_up);
    free(t->begun);
    free(t);
}

uint64_t tick_now(const tick *t)
{
    return t->now;
}

uint64_t tick_last_fragment(const tick *t)
{
    return t->last_fragment;
}

uint64_t tick_bytes(const tick *t, bool written)
{
    return tick_memory_bytes(t->memory, written);
}

// ---- What comes in -------------------------------------------------------------------------------------

void tick_begin_pass(tick *t, const pass_info *pass)
{
    t->pass = *pass;
    t->start = t->now;
    t->units = 0;
    const bool early = pass->early && t->machine->early_depth;
    if (pass->free_kernel) {
        t->kinds[t->units++] = UNIT_SHADER;
        t->kinds[t->units++] = UNIT_KERNEL;
    } else {
        t->kinds[t->units++] = early ? UNIT_DEPTH : UNIT_SHADER;
        t->kinds[t->units++] = early ? UNIT_SHADER : UNIT_DEPTH;
        t->kinds[t->units++] = UNIT_COLOR;
    }
    t->flush_count = 0;
}

static void make_visit(tick *t, const stamp *stamp, const stamp_lines *lines, visit *v)
{
    const access_unit first = v->unit == UNIT_SHADER  ? ACCESS_TEXTURE
                              : v->unit == UNIT_COLOR ? ACCESS_COLOR
                                                      : ACCESS_DEPTH;
    const access_unit last = v->unit == UNIT_KERNEL ? ACCESS_COLOR : first;
    v->arrived = v->begun = v->may_operate = v->operates = v->ends = v->done = TICK_NEVER;
    v->work = tick_work(t->machine, t->frame, v->unit, stamp, t->pass.shader_operations);
    v->second_work = v->unit == UNIT_SHADER ? tick_texture_work(t->machine, t->frame, stamp) : 0;
    v->lanes = tick_lanes(v->unit, stamp);
    v->streams = (v->unit == UNIT_KERNEL || v->unit == UNIT_COLOR) && (lines->stream_read || lines->stream_written);
    for (int c = (int)first; c <= (int)last; c++)
        v->touch_count += lines->counts[c];
    v->touches = calloc((size_t)v->touch_count + 1, sizeof *v->touches);
    v->data = calloc((size_t)v->touch_count + 1, sizeof *v->data);
    int n = 0;
    for (int c = (int)first; c <= (int)last; c++)
        for (int i = 0; i < lines->counts[c]; i++)
            v->touches[n++] = (touched){lines->touches[c][i], (access_unit)c};
}

void tick_stamp(tick *t, const stamp *stamp, const stamp_lines *lines)
{
    if (t->item_count == t->item_capacity) {
        t->item_capacity = 2 * t->item_capacity + 64;
        t->items = realloc(t->items, t->item_capacity * sizeof *t->items);
    }
    item *item = &t->items[t->item_count];
    memset(item, 0, sizeof *item);
    item->partition = lines->partition;
    item->tile = stamp->tile;
    item->quads = stamp->quads;
    item->primitive = t->item_count ? item[-1].primitive + stamp->begins_primitive : 0;
    item->hierarchical = stamp->hierarchical && t->machine->hierarchical_depth;
    item->stream_address = lines->stream_address;
    item->stream_read = lines->stream_read;
    item->stream_written = lines->stream_written;
    for (int u = 0; u < t->units; u++) {
        item->visits[u].unit = t->kinds[u];
        make_visit(t, stamp, lines, &item->visits[u]);
    }
    t->item_count++;
}

// ---- The cycles of a pass ------------------------------------------------------------------------------

static bool step_once(tick *t)
{
    for (int64_t n = 0; n < t->machine->partitions; n++)
        for (int u = t->units - 1; u >= 0; u--)
            if (tick_step_unit(t, (uint32_t)n, u))
                return true;
    return tick_step_rasterizer(t);
}

static bool all_done(const tick *t)
{
    if (t->leaving < t->item_count)
        return false;
    for (int64_t n = 0; n < t->machine->partitions; n++)
        if (t->partitions[n].operating[t->units - 1] < t->partitions[n].left)
            return false;
    return tick_lines_there(t, t->lines_asked);
}

void tick_end_stamps(tick *t)
{
    for (int64_t n = 0; n < t->machine->partitions; n++) {
        partition *p = &t->partitions[n];
        p->order = realloc(p->order, ((size_t)t->item_count + 1) * sizeof *p->order);
        p->left = 0;
        for (int u = 0; u < TICK_UNITS_MAX; u++) {
            p->begun[u] = p->operating[u] = p->first_busy[u] = 0;
            p->port_free[u] = t->start;
            p->first_free[u] = p->second_free[u] = 0;
        }
        for (int c = 0; c < ACCESS_UNITS; c++) {
            p->pending_count[c] = 0;
            memset(p->slots[c], 0, t->slot_counts[c] * sizeof(slot));
        }
    }
    tick_start_geometry(t);
    for (;; t->now++) {
        tick_memory_advance(t->memory, t->now);
        while (step_once(t))
            ;
        if (all_done(t))
            break;
        if (t->now - t->start > 100000000) {
            fprintf(stderr, "the ticking machine waits for ever\n");
            abort();
        }
    }
    for (uint64_t i = 0; i < t->lines_asked; i++)
        note_done(t, *t->line_answers[i]);
    if (t->set_up_count)
        note_done(t, up(t->set_up[t->set_up_count - 1]));
    if (t->pass.kind == PASS_CLEAR && t->machine->fast_clear) {
        const uint64_t lines = (uint64_t)t->frame->tile_count *
                               block_lines(t->machine, t->frame->plane_bits[t->pass.plane]);
        t->clear_end = t->start + tick_divided_up(lines, 1, (uint64_t)t->machine->clear_blocks_per_clock);
    }
    t->now = t->last_fragment;
}

void tick_flush(tick *t, uint32_t partition, access_unit cache, const transfer *transfer)
{
    (void)cache;
    if (t->flush_count == t->flush_capacity) {
        t->flush_capacity = 2 * t->flush_capacity + 64;
        t->flushes = realloc(t->flushes, t->flush_capacity * sizeof *t->flushes);
    }
    t->flushes[t->flush_count++] = (flushed){partition, *transfer};
}

// One line a cycle and partition; a partition that has handed in all its lines drains.
void tick_end_pass(tick *t)
{
    const uint32_t partitions = (uint32_t)t->machine->partitions;
    uint64_t end = t->last_fragment;
    uint32_t draining = 0;
    uint32_t *next = calloc(partitions, sizeof *next), *steps = calloc(partitions, sizeof *steps);
    bool *drains = calloc(partitions, sizeof *drains);
    if (t->clear_end > t->last_fragment)
        t->last_fragment = t->clear_end;
    t->clear_end = 0;
    for (; draining < partitions; t->now++) {
        tick_memory_advance(t->memory, t->now);
        for (uint32_t p = 0; p < partitions; p++) {
            while (next[p] < t->flush_count && t->flushes[next[p]].partition != p)
                next[p]++;
            if (drains[p])
                continue;
            if (next[p] == t->flush_count) {
                end = longer(end, tick_memory_drain(t->memory, p, longer(t->now, t->last_fragment)));
                drains[p] = true;
                draining++;
                continue;
            }
            const transfer *transfer = &t->flushes[next[p]].transfer;
            if (steps[p] == 0 && tick_memory_spill(t->memory, p, t->now, transfer))
                steps[p] = 1;
            if (steps[p] == 1 && tick_memory_make_room(t->memory, p, t->now, transfer)) {
                steps[p] = 0;
                next[p]++;
            }
        }
    }
    free(next);
    free(steps);
    free(drains);
    t->now = longer(end, t->last_fragment);
    tick_memory_advance(t->memory, t->now);
    tick_memory_forget(t->memory);
    free_items(t);
}
