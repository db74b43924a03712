// The units of a partition: stamps in their order, lines looked up one a cycle, an operation when all lines are there.
//
// A stamp begins when it has arrived, the lookup port is free and the next stage's queue has room: at most `window` stamps
// have begun here and not there (in the last stage: not begun their operation). Each lookup takes a cycle of the port; one
// that moves bytes has a step of its own (moves.c), all others of a stamp are one. Data are waited for by the operation alone.
// Operations are in order, each when its lines are there, the unit is free and, by the interlock, no earlier one on the same
// sample is under way. clock.h says where steps need an order.
#include "clock.h"

// A stamp takes few instructions in a unit, so that calls on its way would cost as much as all else.
#define INLINED static inline __attribute__((always_inline))

enum { INTERLOCK_NONE, INTERLOCK_EXACT, INTERLOCK_BUCKETS };  // machine.interlock

// ---- When a stamp can begin ----------------------------------------------------------------------------

static job *job_at(const partition *p, uint64_t number)
{
    return &p->jobs[number & p->job_mask];
}

// Stamps that have arrived, or will at a known time.
static inline uint64_t arrived(const partition *p, const unit *u)
{
    return u->stage ? u[-1].started - u[-1].open : p->pushed;
}

// When a stamp finds room in the shader, which counts quads; a stamp of more than it holds has it alone. NEVER: not known yet.
static inline uint64_t shader_has_room(shader_room *room, const unit *u, const unit *next, uint64_t quads)
{
    for (; room->held + quads > u->window && room->passed < u->started; room->passed++) {
        if (room->passed == next->started)
            return NEVER;
        room->held -= room->quads[room->passed & room->mask];
        room->when = next->begun[room->passed & next->begun_mask];
    }
    return room->when;
}

// When a stamp finds room behind those that are here and not yet in the next stage. NEVER: not known yet.
static inline uint64_t has_room(const unit *u, const unit *next)
{
    if (u->last)
        return u->window ? u->operations[u->operation] : NEVER;  // machine files have no queue of no places
    return u->started < next->started + u->window ? next->begun[(u->started - u->window) & next->begun_mask] : NEVER;
}

// Sets unit.when of a unit that has no stamp at hand, and this one next.
INLINED void unit_next(partition *p, unit *u, const job *job, bool shades)
{
    const uint64_t room = shades ? shader_has_room(&p->shader_room, u, u + 1, job->quads) : has_room(u, u + 1);
    u->could = later(job->ready, u->port_free);
    u->when = later(u->could, room);
    u->full = room == NEVER;
}

// The earliest step; of several the one nearest to the end of the pipeline. Stages that the pass has not never have one.
static void choose_step(partition *p)
{
    uint64_t when = p->units[STAGES_MAX - 1].when;
    int stage = STAGES_MAX - 1;
    for (int s = STAGES_MAX - 2; s >= 0; s--) {
        stage = p->units[s].when < when ? s : stage;
        when = p->units[s].when < when ? p->units[s].when : when;
    }
    p->when = when;
    p->next_stage = stage;
}

// Up to which cycle the unit that is next stays so, as long as no other one does a step.
static uint64_t its_turn(const partition *p)
{
    uint64_t turn = NEVER;
    for (int s = 0; s < STAGES_MAX; s++)
        if (s != p->next_stage)
            turn = earlier(turn, p->units[s].when - (s > p->next_stage));
    return turn;
}

// ---- Operations ----------------------------------------------------------------------------------------

static uint32_t bucket_of(const clock_state *c, uint32_t tile, int lane)
{
    const uint64_t hash = ((uint64_t)tile * TILE_LANES + (uint64_t)lane) * UINT64_C(0x9e3779b97f4a7c15);
    return (uint32_t)((hash >> 32) % (uint64_t)c->machine->interlock_buckets);
}

// When earlier operations on the same samples are done; by buckets, on quads of the same hash.
INLINED uint64_t interlocked(const clock_state *c, const unit *u, uint32_t tile, uint64_t lanes, uint64_t from)
{
    uint64_t done = from;
    if (c->machine->interlock == INTERLOCK_BUCKETS) {
        for (uint64_t left = frame_quads(c->frame, lanes); left; left &= left - 1)
            done = later(done, u->buckets[bucket_of(c, tile, __builtin_ctzll(left))]);
    } else if (c->machine->interlock == INTERLOCK_EXACT) {
        // Done in order: the first one met that is done by then ends the search.
        for (uint64_t i = u->flight_count; i > 0 && u->flight_count - i <= u->flight_mask; i--) {
            const flight *flight = &u->flights[(i - 1) & u->flight_mask];
            if (flight->done <= from)
                break;
            if (flight->tile == tile && (flight->lanes & lanes)) {
                done = flight->done;
                break;
            }
        }
    }
    return done;
}

INLINED void note_flight(const clock_state *c, unit *u, uint32_t tile, uint64_t lanes, uint64_t done)
{
    u->flights[u->flight_count++ & u->flight_mask] = (flight){tile, lanes, done};
    if (c->machine->interlock == INTERLOCK_BUCKETS)
        for (uint64_t left = frame_quads(c->frame, lanes); left; left &= left - 1)
            u->buckets[bucket_of(c, tile, __builtin_ctzll(left))] = done;
}

static void note_operation(const clock_state *c, unit *u, uint64_t looked_up, uint64_t free, uint64_t begin, uint64_t end, uint64_t data_ready)
{
    const uint64_t ready = later(looked_up, cycles_up(free));
    spans_note(c, u, false, "waits for data", ready, data_ready);
    spans_note(c, u, false, "waits for a sample", later(ready, data_ready), begin / CYCLE_PARTS);
    spans_note(c, u, false, "works", begin / CYCLE_PARTS, cycles_up(end));
}

// Lines are in use until the operation ends.
INLINED void use_lines(const clock_state *c, partition *p, const job *job, const stage_work *work, uint64_t until)
{
    const uint32_t end = work->first_touch + work->touch_count;
    const uint64_t stretch = stretch_of(c, job);
    for (uint32_t i = work->first_touch; i != end; i++)
        p->lines[touch_at(p, i)->line].last_use = until;
    for (uint32_t i = work->first_touch; stretch && i != end; i++)
        p->used_in[touch_at(p, i)->line] = stretch;
}

// The stamp's operation begins at `begin`, in parts; the last lookup was made in cycle `at`.
INLINED void finish(clock_state *c, unit *u, job *job, uint64_t at, uint64_t begin, uint64_t ready)
{
    job->ready = ready;
    u->port_free = at + 1;
    if (u->last) {
        const uint64_t place = u->operation, next = place + 1;
        u->operations[place] = begin / CYCLE_PARTS;
        u->operation = next == u->window ? 0 : next;
        c->last_fragment = later(c->last_fragment, ready);
    }
}

// The stamp's operation: when it begins, ends and is done. The last lookup was made in cycle `at`.
INLINED void operate(clock_state *c, partition *p, unit *u, job *job, const stage_work *work, uint64_t at, uint64_t data_ready, bool shades)
{
    const uint64_t cost = work->cost, second_cost = shades ? work->second_cost : 0, lanes = shades ? 0 : work->lanes;
    const uint64_t looked_up = work->touch_count ? at + 1 : at, free = u->operation_free;
    uint64_t begin = later(looked_up * CYCLE_PARTS, free);
    begin = second_cost ? later(begin, u->second_free) : begin;
    if (data_ready * CYCLE_PARTS > begin) {
        c->statistics->unit_wait_data += data_ready - begin / CYCLE_PARTS;
        begin = data_ready * CYCLE_PARTS;
    }
    if (lanes) {
        const uint64_t done = interlocked(c, u, job->tile, lanes, begin / CYCLE_PARTS);
        if (done * CYCLE_PARTS > begin) {
            c->statistics->unit_wait_interlock += done - begin / CYCLE_PARTS;
            begin = done * CYCLE_PARTS;
        }
    }
    const uint64_t end = begin + later(cost, second_cost), ended = cycles_up(end), ready = ended + u->latency;
    if (c->timeline)
        note_operation(c, u, looked_up, free, begin, end, data_ready);
    u->operation_free = begin + cost;
    u->busy += cost;
    if (second_cost) {
        u->second_free = begin + second_cost;
        u->second_busy += second_cost;
    }
    if (lanes)
        note_flight(c, u, job->tile, lanes, ready);
    use_lines(c, p, job, work, ended);
    finish(c, u, job, at, begin, ready);
}

// A stamp that leaves the unit nothing to do neither waits nor keeps others waiting, so flights are done in order.
INLINED void pass_on(clock_state *c, unit *u, job *job, uint64_t at, uint64_t data_ready)
{
    const uint64_t begin = later(later(at, data_ready) * CYCLE_PARTS, u->operation_free);
    if (data_ready * CYCLE_PARTS > later(at * CYCLE_PARTS, u->operation_free))
        c->statistics->unit_wait_data += data_ready - later(at, u->operation_free / CYCLE_PARTS);
    u->operation_free = begin;
    finish(c, u, job, at, begin, cycles_up(begin));
}

// ---- Steps ---------------------------------------------------------------------------------------------

// Begins the stamp: the room that it had in the queue before is free.
INLINED void begin_stamp(clock_state *c, partition *p, unit *u, const job *job, bool shades)
{
    const uint64_t now = u->when;
    if (c->timeline)
        spans_note(c, u, true, "next queue full", u->could, now);
    if (shades) {
        p->shader_room.quads[u->started & p->shader_room.mask] = job->quads;
        p->shader_room.held += job->quads;
    }
    u->begun[u->started++ & u->begun_mask] = now;
    u->last_step = now;
}

// A lookup that moves no bytes asks nothing of what others use, so it need not wait for its turn among their steps. It is made
// in its cycle or when the replaced line is free: that cycle.
static uint64_t miss_alone(clock_state *c, partition *p, unit *u, const job *job, const queued_touch *touch, uint64_t at)
{
    const uint64_t free = touch->how & TOUCH_REPLACES ? victim_free(c, p, touch, job) : 0;
    if (free > at) {
        c->statistics->unit_wait_victim += free - at;
        if (c->timeline)
            spans_note(c, u, true, "line in use", at, free);
        at = free;
    }
    p->lines[touch->line].ready = at + 1;
    return at;
}

// The stamp stays at hand.
static bool stay_at(unit *u, uint32_t touch, uint64_t when, uint64_t data_ready, uint8_t step)
{
    u->open = true;
    u->touch = touch;
    u->when = when;
    u->data_ready = data_ready;
    u->step = step;
    return false;
}

// All lookups of a stamp at unit.when that can be made now, from touch number `i` on; false: the next one moves bytes and has a step
// of its own. *at: the cycle of the last one.
INLINED bool look_up(clock_state *c, partition *p, unit *u, const job *job, const stage_work *work, uint32_t i, uint64_t *at, uint64_t *data_ready)
{
    const uint32_t from = i, count = work->touch_count;
    uint64_t now = u->when, ready = *data_ready;
    for (; i < count; i++, now++) {
        const queued_touch *touch = touch_at(p, work->first_touch + i);
        if (touch->how & TOUCH_MOVES)
            return stay_at(u, i, now, ready, STEP_PENDING);
        now = touch->how & TOUCH_MISS ? miss_alone(c, p, u, job, touch, now) : now;
        ready = later(ready, p->lines[touch->line].ready);
    }
    *at = i > from ? now - 1 : now;
    *data_ready = ready;
    return true;
}

// The lookups from number `i` on, the first of which is due at unit.when, and the operation, as far as no bytes move.
INLINED void go_on(clock_state *c, partition *p, unit *u, job *job, uint32_t i, uint64_t data_ready, bool shades)
{
    const stage_work *work = &job->work[u->stage];
    uint64_t at;
    if (!(work->cost | (shades ? work->second_cost : 0) | work->touch_count))
        pass_on(c, u, job, u->when, data_ready);
    else if (look_up(c, p, u, job, work, i, &at, &data_ready))
        operate(c, p, u, job, work, at, data_ready, shades);
}

// Begins the next stamp at unit.when, and does all that can be done at once.
INLINED void begin_next(clock_state *c, partition *p, unit *u, job *job, bool shades)
{
    begin_stamp(c, p, u, job, shades);
    if (u->lists && (job->stream_written || job->stream_read))
        stay_at(u, 0, u->when, 0, STEP_STREAM);
    else
        go_on(c, p, u, job, 0, 0, shades);
}

// What moves bytes of the stamp at hand from unit.when up to cycle `until`, and what follows without.
static void move(clock_state *c, partition *p, unit *u, uint64_t until)
{
    job *job = job_at(p, u->started - 1);
    const stage_work *work = &job->work[u->stage];
    do {
        const queued_touch *touch = touch_at(p, work->first_touch + u->touch);
        p->now = u->last_step = u->when;
        if (u->step == STEP_STREAM && !move_stream(c, p, u, job))
            continue;
        if (u->touch < work->touch_count && touch->how & TOUCH_MOVES) {
            if (!move_line(c, p, u, job, touch))
                continue;
            u->when += ++u->touch < work->touch_count;
        }
        u->open = false;
        go_on(c, p, u, job, u->touch, u->data_ready, u->kind == UNIT_SHADER_STAGE);
    } while (u->open && u->when <= until);
}

// Sets unit.when.
static void unit_look(partition *p, unit *u)
{
    if (u->open)
        return;
    u->when = NEVER;
    u->full = false;
    if (u->started < arrived(p, u))
        unit_next(p, u, job_at(p, u->started), u->kind == UNIT_SHADER_STAGE);
}

// All steps up to cycle `until` that move no bytes; whether there was one. Sets unit.when.
INLINED bool run_kind(clock_state *c, partition *p, unit *u, uint64_t until, bool shades)
{
    const uint64_t started = u->started, end = arrived(p, u);
    uint64_t waited = 0;
    while (!u->open && u->started < end) {
        job *job = job_at(p, u->started);
        unit_next(p, u, job, shades);
        if (u->when > until)
            break;
        waited += u->when - u->could;
        begin_next(c, p, u, job, shades);
    }
    if (!u->open && u->started == end) {
        u->when = NEVER;
        u->full = false;
    }
    c->statistics->unit_wait_queue += waited;
    return u->started > started;
}

// A stamp asks at each turn whether it is in the shader, so each of both ways has a piece of its own.
static bool unit_run(clock_state *c, partition *p, unit *u, uint64_t until)
{
    return u->kind == UNIT_SHADER_STAGE ? run_kind(c, p, u, until, true) : run_kind(c, p, u, until, false);
}

// Whether it may have one, as long as the next unit begins nothing. A time that is known stays as it is.
static inline bool may_run(const unit *u, uint64_t until)
{
    return !u->open && !u->full && (u->when <= until || u->when == NEVER);
}

// The same of all units from stage `first` on; those before it have no step. What one did may be what the one before it waits for.
static void run_units(clock_state *c, partition *p, int first, uint64_t until)
{
    bool woken = false;
    for (int s = first; s < c->stage_count;) {
        const bool ran = (woken || may_run(&p->units[s], until)) && unit_run(c, p, &p->units[s], until);
        woken = ran && s > 0 && p->units[s - 1].full;
        s += woken ? -1 : 1;
    }
}

void partition_step(clock_state *c, partition *p)
{
    const uint64_t due = p->when;
    for (int s = 0; s < c->stage_count; s++)
        unit_look(p, &p->units[s]);
    choose_step(p);
    if (p->when > due)
        return;
    unit *u = &p->units[p->next_stage];
    unit_run(c, p, u, due);  // one step, if any: a stamp takes a cycle at least
    if (u->open && u->when == due)
        move(c, p, u, due);
    for (int s = 0; s < c->stage_count; s++)
        unit_look(p, &p->units[s]);
    choose_step(p);
}

// When all that moves no bytes is done, what is left up to `until` is a unit that waits for its turn to move some. It does so as long as no
// other one is first. When it has moved all of a stamp, that gives steps to it and to the units behind it.
void partition_advance(clock_state *c, partition *p, uint64_t until)
{
    if (p->when > until)
        return;
    run_units(c, p, 0, until);
    for (choose_step(p); p->when <= until; choose_step(p)) {
        unit *u = &p->units[p->next_stage];
        move(c, p, u, earlier(until, its_turn(p)));
        if (!u->open)
            run_units(c, p, p->next_stage, until);
    }
}
