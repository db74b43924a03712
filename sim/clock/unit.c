// The units of a partition: stamps in their order, lines looked up one a cycle, an operation when all lines are there.
//
// A stamp begins when it has arrived, the lookup port is free and the next stage's queue has room: at most `window` stamps
// have begun here and not there (in the last stage: not begun their operation). Each lookup takes a cycle of the port; one
// that moves bytes has a step of its own (moves.c), all others of a stamp are one. Data are waited for by the operation alone.
// Operations are in order, each when its lines are there, the unit is free and, by the interlock, no earlier one on the same
// sample is under way.
#include "clock.h"

enum { INTERLOCK_NONE, INTERLOCK_EXACT, INTERLOCK_BUCKETS };  // machine.interlock

// ---- When a stamp can begin ----------------------------------------------------------------------------

static job *job_at(const partition *p, uint64_t number)
{
    return &p->jobs[number & p->job_mask];
}

// Stamps that have arrived, or will at a known time.
static uint64_t arrived(const partition *p, int stage)
{
    return stage ? p->units[stage - 1].started - p->units[stage - 1].open : p->pushed;
}

// Whether the stamp finds room behind those that are here and not yet in the next stage. The shader counts quads; a stamp
// of more than it holds has it alone.
static bool has_room(const unit *u, const unit *next, const job *job)
{
    if (u->kind != UNIT_SHADER_STAGE)
        return u->started - next->started < u->window;
    const uint64_t quads = u->quads_started - next->quads_started;
    return !quads || quads + job->quads <= u->window;
}

// Sets unit.when of a unit that has no stamp at hand.
static void unit_next(const clock_state *c, partition *p, int stage)
{
    unit *u = &p->units[stage];
    u->when = NEVER;
    if (u->started == arrived(p, stage))
        return;
    const job *job = job_at(p, u->started);
    uint64_t when = later(job->ready, u->port_free);
    if (stage + 1 < c->stage_count) {
        if (!has_room(u, u + 1, job))
            return;  // asked again when the next unit begins one
    } else if (!u->window) {
        return;  // machine files have no such queue
    } else if (u->started >= u->window) {
        when = later(when, u->operations[u->operation]);
    }
    u->when = later(when, p->now);
}

// The same where something happened that it may have waited for. What can begin, or is at hand, knows when.
static void unit_wake(const clock_state *c, partition *p, int stage)
{
    if (p->units[stage].when == NEVER)
        unit_next(c, p, stage);
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

// ---- Operations ----------------------------------------------------------------------------------------

static uint32_t bucket_of(const clock_state *c, uint32_t tile, int lane)
{
    const uint64_t hash = ((uint64_t)tile * TILE_LANES + (uint64_t)lane) * UINT64_C(0x9e3779b97f4a7c15);
    return (uint32_t)((hash >> 32) % (uint64_t)c->machine->interlock_buckets);
}

// When earlier operations on the same samples are done; by buckets, on quads of the same hash.
static uint64_t interlocked(const clock_state *c, const unit *u, uint32_t tile, uint64_t lanes, uint64_t from)
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

static void note_flight(const clock_state *c, unit *u, uint32_t tile, uint64_t lanes, uint64_t done)
{
    u->flights[u->flight_count++ & u->flight_mask] = (flight){tile, lanes, done};
    if (c->machine->interlock == INTERLOCK_BUCKETS)
        for (uint64_t left = frame_quads(c->frame, lanes); left; left &= left - 1)
            u->buckets[bucket_of(c, tile, __builtin_ctzll(left))] = done;
}

static void note_operation(const clock_state *c, unit *u, uint64_t looked_up, uint64_t free, uint64_t begin, uint64_t end)
{
    const uint64_t ready = later(looked_up, cycles_up(free));
    spans_note(c, u, false, "waits for data", ready, u->data_ready);
    spans_note(c, u, false, "waits for a sample", later(ready, u->data_ready), begin / CYCLE_PARTS);
    spans_note(c, u, false, "works", begin / CYCLE_PARTS, cycles_up(end));
}

// Lines are in use until the operation ends. As long as no stamps were skipped all are of stretch 0, which stands there.
static void use_lines(partition *p, const job *job, const stage_work *work, uint64_t until)
{
    const queued_touch *touches = job->touches + work->first_touch;
    for (uint32_t i = 0; i < work->touch_count; i++)
        p->lines[touches[i].line].last_use = until;
    if (job->stretch)
        for (uint32_t i = 0; i < work->touch_count; i++)
            p->used_in[touches[i].line] = job->stretch;
}

// The stamp's operation: when it begins, ends and is done. The last lookup was made in cycle `at`.
static void operate(clock_state *c, partition *p, unit *u, int stage, job *job, uint64_t at)
{
    const stage_work *work = &job->work[stage];
    const uint64_t second_cost = u->kind == UNIT_SHADER_STAGE ? job->texture_cost : 0;
    const uint64_t looked_up = work->touch_count ? at + 1 : at, free = u->operation_free;
    uint64_t begin = later(looked_up * CYCLE_PARTS, free);
    begin = second_cost ? later(begin, u->second_free) : begin;
    if (u->data_ready * CYCLE_PARTS > begin) {
        c->statistics->unit_wait_data += u->data_ready - begin / CYCLE_PARTS;
        begin = u->data_ready * CYCLE_PARTS;
    }
    // A stamp that leaves the unit nothing to do neither waits nor keeps others waiting. So flights are done in order.
    const bool works = work->cost || second_cost || work->touch_count;
    const uint64_t lanes = works ? work->lanes : 0;
    if (lanes) {
        const uint64_t done = interlocked(c, u, job->tile, lanes, begin / CYCLE_PARTS);
        if (done * CYCLE_PARTS > begin) {
            c->statistics->unit_wait_interlock += done - begin / CYCLE_PARTS;
            begin = done * CYCLE_PARTS;
        }
    }
    const uint64_t end = begin + later(work->cost, second_cost), ended = cycles_up(end);
    if (c->timeline && works)
        note_operation(c, u, looked_up, free, begin, end);
    u->operation_free = begin + work->cost;
    u->busy += work->cost;
    if (second_cost) {
        u->second_free = begin + second_cost;
        u->second_busy += second_cost;
    }
    job->ready = ended + (works ? u->latency : 0);
    if (lanes)
        note_flight(c, u, job->tile, lanes, job->ready);
    use_lines(p, job, work, ended);
    if (stage == c->stage_count - 1) {
        u->operations[u->operation] = begin / CYCLE_PARTS;
        u->operation = u->operation + 1 == u->window ? 0 : u->operation + 1;
        c->last_fragment = later(c->last_fragment, job->ready);
    }
}

// ---- Steps ---------------------------------------------------------------------------------------------

// Begins the stamp: the room that it had in the queue before is free.
static void begin_stamp(clock_state *c, partition *p, unit *u, int stage, const job *job)
{
    const uint64_t could = later(job->ready, u->port_free);
    c->statistics->unit_wait_queue += p->now - could;
    if (c->timeline)
        spans_note(c, u, true, "next queue full", could, p->now);
    u->open = true;
    u->touch = 0;
    u->data_ready = 0;
    u->quads_started += job->quads;
    u->started++;
    u->step = u->first_step;
    if (stage)
        unit_wake(c, p, stage - 1);
}

// A lookup that moves no bytes asks nothing of what others use, so it need not wait for its turn among their steps. It is made
// in its cycle or when the replaced line is free: that cycle.
static uint64_t miss_alone(clock_state *c, partition *p, unit *u, const job *job, const queued_touch *touch, uint64_t at)
{
    const uint64_t free = touch->replaces ? victim_free(c, p, touch, job->stretch) : 0;
    if (free > at) {
        c->statistics->unit_wait_victim += free - at;
        if (c->timeline)
            spans_note(c, u, true, "line in use", at, free);
        at = free;
    }
    p->lines[touch->line].ready = at + 1;
    return at;
}

// All lookups that can be made now: the cycle of the last one. NEVER: the next one has a step of its own, at unit.when.
static uint64_t look_up(clock_state *c, partition *p, unit *u, const job *job, const stage_work *work)
{
    const queued_touch *touches = job->touches + work->first_touch;
    const uint32_t count = work->touch_count;
    uint64_t at = p->now, data_ready = u->data_ready;
    for (uint32_t i = u->touch; i < count; i++) {
        const queued_touch *touch = &touches[i];
        if (touch->moves) {
            u->touch = i;
            u->data_ready = data_ready;
            u->when = at;
            if (at > p->now || !move_line(c, p, u, job, touch))
                return NEVER;
            data_ready = u->data_ready;
            u->step = STEP_PENDING;
        } else {
            at = touch->miss ? miss_alone(c, p, u, job, touch, at) : at;
            data_ready = later(data_ready, p->lines[touch->line].ready);
        }
        at += i + 1 < count;
    }
    u->data_ready = data_ready;
    return at;
}

static void unit_step(clock_state *c, partition *p, int stage)
{
    unit *u = &p->units[stage];
    if (!u->open)
        begin_stamp(c, p, u, stage, job_at(p, u->started));
    job *job = job_at(p, u->started - 1);
    if (u->step == STEP_STREAM && !move_stream(c, p, u, job))
        return;
    const uint64_t at = look_up(c, p, u, job, &job->work[stage]);
    if (at == NEVER)
        return;
    operate(c, p, u, stage, job, at);
    u->open = false;
    u->port_free = at + 1;
    unit_next(c, p, stage);
    if (stage + 1 < c->stage_count)
        unit_wake(c, p, stage + 1);
}

void partition_push(const clock_state *c, partition *p)
{
    p->pushed++;
    unit_wake(c, p, 0);
    if (p->units[0].when < p->when) {
        p->when = p->units[0].when;
        p->next_stage = 0;
    }
}

void partition_step(clock_state *c, partition *p)
{
    p->now = p->when;
    unit_step(c, p, p->next_stage);
    choose_step(p);
}

void partition_advance(clock_state *c, partition *p, uint64_t until)
{
    while (p->when <= until)
        partition_step(c, p);
}
