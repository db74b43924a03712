// Of rank 0: a pool whose places are the slots of the other ranks.
//
// A rank that was silent for too long is given up, with its runs lost. What it says later is not heard: its runs were
// handed out again. (mpirun ends all ranks with the first that dies, unless it is told to --enable-recovery.)
#include "sweep_ranks.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LOOK_MICROSECONDS = 500 };

typedef struct rank_state {
    double heard;  // when
    bool lost;
    char host[64];
} rank_state;

typedef struct remote {
    sweep_pool pool;
    const sweep *sweep;
    sweep_ranks *ranks;
    rank_state *states;  // one a rank; that of rank 0 is not used
} remote;

// The first runs go to a rank each.
static int rank_of(const remote *r, int slot)
{
    return 1 + slot % (r->ranks->count - 1);
}

static int slot_there(const remote *r, int slot)
{
    return slot / (r->ranks->count - 1);
}

static status start(sweep_pool *pool, int slot, uint64_t index)
{
    remote *r = (remote *)pool;
    const sweep_combination run = sweep_get(r->sweep, index);
    rank_run message;
    memset(&message, 0, sizeof message);
    message.slot = slot_there(r, slot);
    message.index = index;
    memcpy(message.detail, run.detail->name, sizeof message.detail);
    memcpy(message.program_hash, run.program->hash, sizeof message.program_hash);
    memcpy(message.trace_hash, run.trace->hash, sizeof message.trace_hash);
    memcpy(message.variant_hash, run.variant->hash, sizeof message.variant_hash);
    pool->slots[slot].state = SLOT_BUSY;
    pool->slots[slot].index = index;
    return ranks_send(r->ranks, rank_of(r, slot), TAG_RUN, &message, sizeof message);
}

static status take_ready(remote *r, int rank, const rank_ready *ready)
{
    memcpy(r->states[rank].host, ready->host, sizeof ready->host);
    if (ready->why[0])
        return report_error(r->sweep->report, STATUS_REFUSED, "rank %d on %s: %s; every rank needs the same files",
                            rank, ready->host, ready->why);
    if (strcmp(ready->version, ROPSIM_VERSION) != 0)
        return report_error(r->sweep->report, STATUS_REFUSED,
                            "rank %d on %s is ropsim %s, but rank 0 is %s; every rank needs the same", rank,
                            ready->host, ready->version, ROPSIM_VERSION);
    for (int i = rank - 1; i < r->pool.slot_count; i += r->ranks->count - 1)
        r->pool.slots[i].state = SLOT_IDLE;
    return STATUS_OK;
}

static void take_row(remote *r, int rank, const rank_row *row)
{
    const int slot = row->slot * (r->ranks->count - 1) + rank - 1;
    if (row->slot < 0 || slot >= r->pool.slot_count || r->pool.slots[slot].state != SLOT_BUSY ||
        r->pool.slots[slot].index != row->index)
        return;
    r->pool.slots[slot].state = SLOT_ENDED;
    r->pool.slots[slot].row = row->row;
}

static void give_up(remote *r, int rank)
{
    const rank_state *state = &r->states[rank];
    r->states[rank].lost = true;
    r->ranks->lost++;
    report_warning(r->sweep->report,
                   "rank %d%s%s has said nothing for %d seconds and is given up; its runs are handed out again", rank,
                   state->host[0] ? " on " : "", state->host, r->ranks->silence);
    for (int i = rank - 1; i < r->pool.slot_count; i += r->ranks->count - 1) {
        sweep_slot *slot = &r->pool.slots[i];
        assert(slot->state != SLOT_ENDED);  // a row that is not taken yet was heard just now
        slot->state = slot->state == SLOT_BUSY ? SLOT_LOST : SLOT_CLOSED;
    }
}

// Who is silent, and who must hear that we are not.
static status look_after_ranks(remote *r)
{
    status status = STATUS_OK;
    if (!ranks_beat_is_due(r->ranks))
        return STATUS_OK;
    const double now = ranks_now();
    for (int rank = 1; status == STATUS_OK && rank < r->ranks->count; rank++) {
        if (r->states[rank].lost)
            continue;
        if (now - r->states[rank].heard > r->ranks->silence)
            give_up(r, rank);
        else
            status = ranks_send(r->ranks, rank, TAG_BEAT, NULL, 0);
    }
    return status;
}

// Takes all messages that are there; *any: one was of use.
static status take_messages(remote *r, bool *any)
{
    for (;;) {
        rank_message message;
        rank_tag tag;
        int from;
        status status = ranks_take(r->ranks, &from, &tag, &message);
        if (status != STATUS_OK || from < 0)
            return status;
        if (r->states[from].lost)
            continue;
        r->states[from].heard = ranks_now();
        *any = *any || tag != TAG_BEAT;
        if (tag == TAG_ROW)
            take_row(r, from, &message.row);
        else if (tag == TAG_READY)
            status = take_ready(r, from, &message.ready);
        if (status != STATUS_OK)
            return status;
    }
}

static status wait_for_any(sweep_pool *pool, int milliseconds)
{
    remote *r = (remote *)pool;
    const double until = ranks_now() + 1e-3 * milliseconds;
    const int lost = r->ranks->lost;
    for (;;) {
        bool any = false;
        // In this order: what a rank said while we did something else counts as said now.
        status status = take_messages(r, &any);
        if (status == STATUS_OK)
            status = look_after_ranks(r);
        if (status == STATUS_OK && r->ranks->lost == r->ranks->count - 1)
            status = report_error(r->sweep->report, STATUS_IO,
                                  "every other rank was given up; what was done is kept, and the next call goes on");
        if (status != STATUS_OK || any || lost != r->ranks->lost || ranks_now() >= until)
            return status;
        nanosleep(&(struct timespec){.tv_nsec = 1000L * LOOK_MICROSECONDS}, NULL);
    }
}

static void close_remote(sweep_pool *pool)
{
    remote *r = (remote *)pool;
    ranks_end(r->ranks);
    free(r->states);
    free(pool->slots);
    free(r);
}

static status remote_open(const sweep *sweep, sweep_ranks *ranks, int jobs, sweep_pool **pool)
{
    *pool = NULL;
    remote *r = calloc(1, sizeof *r);
    if (!r)
        return report_error(sweep->report, STATUS_IO, "out of memory");
    *r = (remote){.sweep = sweep, .ranks = ranks};
    r->pool = (sweep_pool){.start = start, .wait = wait_for_any, .close = close_remote};
    r->pool.slot_count = jobs * (ranks->count - 1);
    r->pool.slots = calloc((size_t)r->pool.slot_count, sizeof *r->pool.slots);
    r->states = calloc((size_t)ranks->count, sizeof *r->states);
    status status = STATUS_OK;
    if (!r->pool.slots || !r->states)
        status = report_error(sweep->report, STATUS_IO, "out of memory");
    for (int i = 0; status == STATUS_OK && i < r->pool.slot_count; i++)
        r->pool.slots[i].state = SLOT_CLOSED;
    for (int rank = 1; status == STATUS_OK && rank < ranks->count; rank++) {
        r->states[rank].heard = ranks_now();
        status = ranks_send(ranks, rank, TAG_BEGIN, NULL, 0);
    }
    if (status == STATUS_OK)
        *pool = &r->pool;
    else
        close_remote(&r->pool);
    return status;
}

status sweep_run_on_ranks(sweep *sweep, sweep_ranks *ranks, int jobs, sweep_totals *totals)
{
    sweep_pool *pool = NULL;
    const status status = remote_open(sweep, ranks, jobs, &pool);
    return status == STATUS_OK ? sweep_run_in(sweep, pool, totals) : status;
}
