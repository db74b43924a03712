// Passes and stamps with their lookups in, the cycle in which each pass is drained out. See tick.h; docs/machine.md, "Cycles".
//
// A pass is buffered whole and then ticked. Within a cycle the most downstream step that can be taken is taken, until there
// is none: so a stamp may pass through several units in one cycle if nothing holds it.
#include "tick_parts.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct touched {
    line_touch touch;
    access_unit cache;
} touched;

// A stamp in one unit of its partition.
typedef struct visit {
    unit_kind unit;
    uint64_t work, second_work;      // 2^-20 cycles; second: texture reads, at the same time
    uint64_t quads;                  // that the operation is on, for the interlock
    touched *touches;
    int touch_count, looked_up, step;  // step: how far the lookup at hand has come
    uint64_t arrived, begun, may_operate, operates, ends, done;  // cycles; operates, ends: 2^-20; TICK_NEVER: not yet
    struct slot *data;               // of each touch: when its line is there
    bool streams, streamed;          // lists: at the beginning, before all lookups
    const uint64_t *stream_data;
} visit;

// When a line is there: `extra` cycles after what memory answers, and not before `not_before`.
typedef struct slot {
    const uint64_t *answer;  // NULL: nothing was asked
    uint64_t extra, not_before;
} slot;

typedef struct item {
    uint32_t partition, tile;
    uint64_t primitive;
    bool hierarchical;
    uint64_t stream_address;
    uint32_t stream_read, stream_written;
    visit visits[TICK_UNITS_MAX];
} item;

typedef struct partition {
    uint32_t *order;                 // items that left the rasterizer for it
    uint32_t left;
    uint32_t begun[TICK_UNITS_MAX], operating[TICK_UNITS_MAX], first_busy[TICK_UNITS_MAX];
    uint64_t port_free[TICK_UNITS_MAX];
    uint64_t first_free[TICK_UNITS_MAX], second_free[TICK_UNITS_MAX];  // 2^-20 cycles: the unit, and its texture reads
    slot *pending[ACCESS_UNITS];
    uint32_t pending_count[ACCESS_UNITS];
    slot *slots[ACCESS_UNITS];
    uint64_t flush_cycle;
} partition;

typedef struct flushed {
    uint32_t partition;
    transfer transfer;
} flushed;

struct tick {
    const machine *machine;
    const frame *frame;
    uint32_t slot_counts[ACCESS_UNITS];
    tick_memory *memory;
    partition *partitions;
    pass_info pass;
    int units;
    unit_kind kinds[TICK_UNITS_MAX];
    item *items;
    uint32_t item_count, item_capacity, leaving;
    uint32_t flush_count, flush_capacity;
    flushed *flushes;
    uint64_t start, now, last_fragment, clear_end;
    // Rasterizer and set-up:
    uint64_t raster_free;            // 2^-20 cycles
    uint64_t lines, lines_asked, primitive, set_up, geometry_start;
    const uint64_t **line_answers;
};

static uint64_t up(uint64_t fraction)
{
    return (fraction + TICK_ONE - 1) / TICK_ONE;
}

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
    v->quads = tick_quads(t->frame, v->unit, stamp);
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

// ---- Set-up and rasterizer -----------------------------------------------------------------------------

static uint64_t divided_up(uint64_t a, uint64_t b, uint64_t c)  // a * b / c
{
    __extension__ typedef unsigned __int128 wide;
    return (uint64_t)(((wide)a * b + c - 1) / c);
}

// Of the whole pass, in 2^-20 cycles.
static uint64_t geometry_time(const tick *t)
{
    const uint64_t triangles =
        divided_up(t->pass.triangles, 1000 * TICK_ONE, (uint64_t)t->machine->triangles_per_kiloclock);
    const uint64_t vertices =
        divided_up(t->pass.vertices, 1000 * TICK_ONE, (uint64_t)t->machine->vertices_per_kiloclock);
    return triangles > vertices ? triangles : vertices;
}

static bool bins(const tick *t)
{
    return t->machine->tile_based && t->pass.kind == PASS_DRAW;
}

static uint64_t lines_of(const tick *t, uint64_t primitives)
{
    const uint64_t n = t->pass.primitives;
    return primitives >= n ? t->lines : divided_up(primitives, t->lines, n);
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

static bool lines_there(const tick *t, uint64_t count)
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
        if (t->now >= cycle && t->now >= t->start + divided_up(cycles, done, most)) {
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
    t->set_up = 0;
}

static void start_geometry(tick *t)
{
    t->lines = geometry_reads(t->machine, &t->pass);
    t->lines_asked = 0;
    t->line_answers = realloc(t->line_answers, (t->lines + 1) * sizeof *t->line_answers);
    t->leaving = 0;
    t->primitive = UINT64_MAX;
    t->set_up = geometry_time(t);
    t->now = t->start;
    if (bins(t))
        fill_bins(t);
    t->geometry_start = t->now;
    t->raster_free = t->now * TICK_ONE;
    t->last_fragment = t->now + up(t->set_up);
}

// Whether the primitive's stamps may leave.
static bool is_set_up(const tick *t, uint64_t primitive)
{
    const uint64_t n = t->pass.primitives;
    return n == 0 || (t->now >= t->geometry_start + up(divided_up(t->set_up, primitive + 1, n)) &&
                      lines_there(t, lines_of(t, primitive + 1)));
}

// The rasterizer turns to its next stamp: lines are asked for ahead.
static bool step_geometry(tick *t)
{
    const uint64_t turned_to = t->leaving < t->item_count ? t->items[t->leaving].primitive : t->pass.primitives;
    if (turned_to == t->primitive)
        return false;
    t->primitive = turned_to;
    ask_lines(t, lines_of(t, turned_to + 33));
    return true;
}

static void note_done(tick *t, uint64_t cycle)
{
    t->last_fragment = cycle > t->last_fragment ? cycle : t->last_fragment;
}

static bool step_rasterizer(tick *t)
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
    t->raster_free = at + divided_up(1, TICK_ONE, (uint64_t)t->machine->raster_blocks_per_clock);
    if (!item->hierarchical) {
        item->visits[0].arrived = up(t->raster_free);
        p->order[p->left++] = t->leaving;
    }
    note_done(t, up(t->raster_free));
    t->leaving++;
    return true;
}

// ---- A unit --------------------------------------------------------------------------------------------

static uint64_t queue_of(const tick *t, int u)
{
    switch (t->kinds[u]) {
    case UNIT_SHADER: return (uint64_t)t->machine->shader_queue;
    case UNIT_COLOR: return (uint64_t)t->machine->color_queue;
    default: return (uint64_t)t->machine->depth_queue;
    }
}

static bool step_begin(tick *t, partition *p, int u)
{
    if (p->begun[u] == p->left)
        return false;
    visit *v = &t->items[p->order[p->begun[u]]].visits[u];
    if (v->arrived > t->now || p->port_free[u] > t->now)
        return false;
    if (p->begun[u] > 0) {
        const visit *before = &t->items[p->order[p->begun[u] - 1]].visits[u];
        if (before->looked_up < before->touch_count || (before->streams && !before->streamed))
            return false;
    }
    uint32_t inside = 0;
    const uint32_t window = (uint32_t)queue_of(t, u);
    for (uint32_t i = p->begun[u] > window ? p->begun[u] - window : 0; i < p->begun[u]; i++) {
        const item *other = &t->items[p->order[i]];
        if (u + 1 < t->units)
            inside += other->visits[u + 1].begun == TICK_NEVER;
        else
            inside += other->visits[u].operates == TICK_NEVER;
    }
    if (inside >= window)
        return false;
    v->begun = t->now;
    if (v->touch_count == 0 && !v->streams)
        v->may_operate = t->now;
    p->port_free[u] = t->now + (v->touch_count == 0);
    p->begun[u]++;
    return true;
}

static bool slot_in_use(const tick *t, const partition *p, int u, access_unit cache, uint32_t number)
{
    for (uint32_t i = p->first_busy[u]; i + 1 < p->begun[u]; i++) {
        const visit *v = &t->items[p->order[i]].visits[u];
        if (v->ends != TICK_NEVER && v->ends <= t->now * TICK_ONE)
            continue;
        for (int k = 0; k < v->touch_count; k++)
            if (v->touches[k].cache == cache && v->touches[k].touch.slot == number)
                return true;
    }
    return false;
}

static bool is_there(const tick *t, const slot *line)
{
    return line->not_before <= t->now && (!line->answer || (*line->answer <= t->now && *line->answer + line->extra <= t->now));
}

static uint32_t still_pending(const tick *t, partition *p, access_unit cache)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < p->pending_count[cache]; i++)
        if (!is_there(t, &p->pending[cache][i]))
            p->pending[cache][count++] = p->pending[cache][i];
    p->pending_count[cache] = count;
    return count;
}

// Entries of lists, in the cycle of the beginning if the channel takes them.
static bool step_stream(tick *t, partition *p, uint32_t number, int u)
{
    if (p->begun[u] == 0)
        return false;
    const item *item = &t->items[p->order[p->begun[u] - 1]];
    visit *v = &t->items[p->order[p->begun[u] - 1]].visits[u];
    if (!v->streams || v->streamed)
        return false;
    if (item->stream_written &&
        !tick_memory_write(t->memory, number, t->now, item->stream_address, item->stream_written))
        return false;
    if (item->stream_read)
        v->stream_data = tick_memory_read(t->memory, number, t->now, item->stream_address, item->stream_read);
    v->streamed = true;
    if (v->touch_count == 0) {
        v->may_operate = t->now;
        p->port_free[u] = t->now + 1;
    }
    return true;
}

static bool step_lookup(tick *t, partition *p, uint32_t number, int u)
{
    if (p->begun[u] == 0)
        return false;
    visit *v = &t->items[p->order[p->begun[u] - 1]].visits[u];
    if (v->looked_up == v->touch_count || p->port_free[u] > t->now || (v->streams && !v->streamed))
        return false;
    const touched *x = &v->touches[v->looked_up];
    const line_touch *touch = &x->touch;
    slot *slot = &p->slots[x->cache][touch->slot];
    const bool fetches = touch->miss && touch->fill.bytes > 0;
    if (v->step == 0) {
        if (fetches && still_pending(t, p, x->cache) >= (uint64_t)t->machine->cache_misses_max)
            return false;
        if (touch->replaces && slot_in_use(t, p, u, x->cache, touch->slot))
            return false;
        v->step = 1;
    }
    if (v->step == 1) {
        if (!tick_memory_spill(t->memory, number, t->now, &touch->spill))
            return false;
        v->step = 2;
    }
    if (v->step == 2) {
        if (!tick_memory_make_room(t->memory, number, t->now, &touch->spill))
            return false;
        v->step = 3;
    }
    if (!tick_memory_make_room(t->memory, number, t->now, &touch->fill))
        return false;
    if (touch->miss) {
        slot->answer = fetches ? tick_memory_fetch(t->memory, number, t->now, &touch->fill) : NULL;
        slot->not_before = t->now + 1;
        slot->extra = fetches && touch->fill.compressed ? (uint64_t)t->machine->compression_cycles : 0;
        if (fetches)
            p->pending[x->cache][p->pending_count[x->cache]++] = *slot;
    }
    v->step = 0;
    v->data[v->looked_up++] = *slot;
    p->port_free[u] = t->now + 1;
    if (v->looked_up == v->touch_count)
        v->may_operate = t->now + 1;
    return true;
}

static bool data_there(const tick *t, const visit *v)
{
    for (int i = 0; i < v->touch_count; i++)
        if (!is_there(t, &v->data[i]))
            return false;
    return !v->stream_data || *v->stream_data <= t->now;
}

static bool works(const visit *v)
{
    return v->work || v->second_work || v->touch_count;
}

static bool same_bucket(const tick *t, uint32_t tile, uint64_t quads, uint32_t other_tile, uint64_t other_quads)
{
    const uint64_t buckets = (uint64_t)t->machine->interlock_buckets;
    for (uint64_t a = quads; a; a &= a - 1)
        for (uint64_t b = other_quads; b; b &= b - 1)
            if (tick_bucket(tile, a, buckets) == tick_bucket(other_tile, b, buckets))
                return true;
    return false;
}

// Whether an earlier operation of the unit on the same quad is under way.
static bool interlocked(const tick *t, const partition *p, int u, const item *item)
{
    const visit *v = &item->visits[u];
    if (t->machine->interlock == 0 || v->unit == UNIT_SHADER || !works(v))
        return false;
    for (uint32_t i = p->first_busy[u]; i < p->operating[u]; i++) {
        const struct item *other = &t->items[p->order[i]];
        const visit *w = &other->visits[u];
        if (w->done <= t->now || !works(w))
            continue;
        if (t->machine->interlock == 1 ? other->tile == item->tile && (w->quads & v->quads)
                                       : same_bucket(t, item->tile, v->quads, other->tile, w->quads))
            return true;
    }
    return false;
}

static uint64_t longer(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

static bool step_operate(tick *t, partition *p, int u)
{
    if (p->operating[u] == p->begun[u])
        return false;
    item *item = &t->items[p->order[p->operating[u]]];
    visit *v = &item->visits[u];
    const uint64_t before = longer(p->first_free[u], v->second_work ? p->second_free[u] : 0);
    if (v->may_operate > t->now || before >= (t->now + 1) * TICK_ONE || !data_there(t, v) ||
        interlocked(t, p, u, item))
        return false;
    v->operates = longer(before, t->now * TICK_ONE);
    p->first_free[u] = v->operates + v->work;
    if (v->second_work)
        p->second_free[u] = v->operates + v->second_work;
    v->ends = v->operates + longer(v->work, v->second_work);
    v->done = up(v->ends);
    if (works(v))
        v->done += (uint64_t)(v->unit == UNIT_SHADER ? t->machine->shader_latency_cycles : t->machine->rop_latency_cycles);
    if (u + 1 < t->units)
        item->visits[u + 1].arrived = v->done;
    note_done(t, v->done);
    p->operating[u]++;
    while (p->first_busy[u] < p->operating[u] && t->items[p->order[p->first_busy[u]]].visits[u].done <= t->now)
        p->first_busy[u]++;
    return true;
}

// ---- The cycles of a pass ------------------------------------------------------------------------------

static bool step_once(tick *t)
{
    for (int64_t n = 0; n < t->machine->partitions; n++)
        for (int u = t->units - 1; u >= 0; u--) {
            partition *p = &t->partitions[n];
            if (step_operate(t, p, u) || step_stream(t, p, (uint32_t)n, u) || step_lookup(t, p, (uint32_t)n, u) ||
                step_begin(t, p, u))
                return true;
        }
    return step_rasterizer(t);
}

static bool all_done(const tick *t)
{
    if (t->leaving < t->item_count)
        return false;
    for (int64_t n = 0; n < t->machine->partitions; n++)
        if (t->partitions[n].operating[t->units - 1] < t->partitions[n].left)
            return false;
    return lines_there(t, t->lines_asked);
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
    start_geometry(t);
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
    if (t->pass.kind == PASS_CLEAR && t->machine->fast_clear) {
        const uint64_t lines = (uint64_t)t->frame->tile_count *
                               block_lines(t->machine, t->frame->plane_bits[t->pass.plane]);
        t->clear_end = t->start + divided_up(lines, 1, (uint64_t)t->machine->clear_blocks_per_clock);
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
