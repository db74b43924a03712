// One unit of a partition of the ticking machine, and what it can do in this cycle: begin a stamp, look up a line, operate.
#include "tick_parts.h"

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
    const uint64_t window = queue_of(t, u);
    const item *item = &t->items[p->order[p->begun[u]]];
    uint64_t inside = 0;
    for (uint32_t i = p->begun[u] > window ? (uint32_t)(p->begun[u] - window) : 0; i < p->begun[u]; i++) {
        const struct item *other = &t->items[p->order[i]];
        const bool gone = u + 1 < t->units ? other->visits[u + 1].begun != TICK_NEVER
                                           : other->visits[u].operates != TICK_NEVER;
        inside += gone ? 0 : v->unit == UNIT_SHADER ? other->quads : 1;
    }
    if (inside && inside + (v->unit == UNIT_SHADER ? item->quads : 1) > window)
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

static bool same_bucket(const tick *t, uint32_t tile, uint64_t lanes, uint32_t other_tile, uint64_t other_lanes)
{
    const uint64_t quads = frame_quads(t->frame, lanes), other_quads = frame_quads(t->frame, other_lanes);
    const uint64_t buckets = (uint64_t)t->machine->interlock_buckets;
    for (uint64_t a = quads; a; a &= a - 1)
        for (uint64_t b = other_quads; b; b &= b - 1)
            if (tick_bucket(tile, a, buckets) == tick_bucket(other_tile, b, buckets))
                return true;
    return false;
}

// Whether an earlier operation of the unit on the same sample is under way.
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
        if (t->machine->interlock == 1 ? other->tile == item->tile && (w->lanes & v->lanes)
                                       : same_bucket(t, item->tile, v->lanes, other->tile, w->lanes))
            return true;
    }
    return false;
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

bool tick_step_unit(tick *t, uint32_t number, int u)
{
    partition *p = &t->partitions[number];
    return step_operate(t, p, u) || step_stream(t, p, number, u) || step_lookup(t, p, number, u) ||
           step_begin(t, p, u);
}
