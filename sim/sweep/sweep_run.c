// Runs what is missing: hands combinations to a pool, and what came of each to the store as it ends.
//
// Nothing else touches the database, and each run is added in one transaction. So the process that runs this is the
// only one that can lose anything: nothing. A run whose place went away is handed out a second time.
#include "sweep.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { WAIT_MILLISECONDS = 250 };

// What is to be done of a combination.
typedef enum run_state { RUN_MISSING, RUN_MISSING_AGAIN, RUN_GIVEN, RUN_GIVEN_AGAIN } run_state;

typedef struct sweep_work {
    sweep *sweep;
    sweep_pool *pool;
    sweep_totals *totals;
    unsigned char *states;  // a run_state a combination
    uint64_t next;          // no missing run comes before it
    uint64_t ended;
    double work, work_done;  // of the runs that are or were missing, without those that ended at once; of those done
    struct timespec start;
} sweep_work;

// What a run costs, in no unit: for the time left alone. The factors were measured: a deeper level takes so many times
// what the function level takes.
static double expect_work(const sweep_combination *run)
{
    static const double factors[DETAIL_COUNT] = {
        [DETAIL_FUNCTION] = 1, [DETAIL_TRAFFIC] = 5, [DETAIL_CYCLE] = 9, [DETAIL_SAMPLED] = 5};
    return factors[run->detail->level] * run->trace->work;
}

static status add_row(sweep_work *w, uint64_t index, const sweep_row *row)
{
    const sweep_combination run = sweep_get(w->sweep, index);
    const status status = store_add(w->sweep->store, &run, row);
    w->ended++;
    if (row->outcome == OUTCOME_DONE)
        w->work_done += expect_work(&run);
    else
        w->work -= expect_work(&run);
    w->totals->done += row->outcome == OUTCOME_DONE;
    w->totals->refused += row->outcome == OUTCOME_REFUSED;
    w->totals->failed += row->outcome == OUTCOME_FAILED;
    if (row->outcome == OUTCOME_FAILED)
        report_warning(w->sweep->report, "%s on %s failed: %s", run.program->label, run.trace->label, row->why);
    return status;
}

// A run may be what took its place down; so it gets one more chance, not as many as there are places.
static status take_lost(sweep_work *w, uint64_t index)
{
    static const sweep_row lost_twice = {.outcome = OUTCOME_FAILED,
                                         .why = "the process that it was given to was lost, twice"};
    if (w->states[index] == RUN_GIVEN_AGAIN)
        return add_row(w, index, &lost_twice);
    w->states[index] = RUN_MISSING_AGAIN;
    if (index < w->next)
        w->next = index;
    return STATUS_OK;
}

static void show_progress(const sweep_work *w)
{
    char what[128], left[64] = "";
    struct timespec now;
    const uint64_t total = w->totals->combinations - w->totals->there;
    clock_gettime(CLOCK_MONOTONIC, &now);
    const double seconds = (double)(now.tv_sec - w->start.tv_sec) + 1e-9 * (double)(now.tv_nsec - w->start.tv_nsec);
    if (w->work_done > 0)
        snprintf(left, sizeof left, ", about %.0f s left", seconds / w->work_done * fmax(w->work - w->work_done, 0));
    snprintf(what, sizeof what, "sweep: %" PRIu64 " of %" PRIu64 " runs%s", w->ended, total, left);
    report_progress(w->sweep->report, what, w->ended, total);
}

// Waits until something ended or a moment has passed.
static status collect(sweep_work *w)
{
    sweep_pool *pool = w->pool;
    status status = pool->wait(pool, WAIT_MILLISECONDS);
    for (int i = 0; status == STATUS_OK && i < pool->slot_count; i++) {
        sweep_slot *slot = &pool->slots[i];
        if (slot->state == SLOT_ENDED) {
            slot->state = SLOT_IDLE;
            status = add_row(w, slot->index, &slot->row);
        } else if (slot->state == SLOT_LOST) {
            slot->state = SLOT_CLOSED;
            status = take_lost(w, slot->index);
        }
    }
    show_progress(w);
    return status;
}

static int idle_slot(const sweep_pool *pool)
{
    for (int i = 0; i < pool->slot_count; i++) {
        if (pool->slots[i].state == SLOT_IDLE)
            return i;
    }
    return -1;
}

// Two combinations can stand for the same run: a program under two names, a setting that changes nothing.
static bool on_its_way(const sweep_work *w, const sweep_combination *run)
{
    for (int i = 0; i < w->pool->slot_count; i++) {
        if (w->pool->slots[i].state != SLOT_BUSY)
            continue;
        const sweep_combination other = sweep_get(w->sweep, w->pool->slots[i].index);
        if (other.detail == run->detail && strcmp(other.program->hash, run->program->hash) == 0 &&
            strcmp(other.trace->hash, run->trace->hash) == 0 && strcmp(other.variant->hash, run->variant->hash) == 0)
            return true;
    }
    return false;
}

static status is_there(const sweep_work *w, const sweep_combination *run, bool *there)
{
    sweep_row row;
    const status status = store_find(w->sweep->store, run, there, &row);
    *there = *there && row.outcome != OUTCOME_FAILED;
    return status;
}

// False: every run was given out.
static bool find_missing(sweep_work *w)
{
    while (w->next < w->totals->combinations && w->states[w->next] >= RUN_GIVEN)
        w->next++;
    return w->next < w->totals->combinations;
}

static status give_out(sweep_work *w, int slot)
{
    const uint64_t index = w->next;
    const sweep_combination run = sweep_get(w->sweep, index);
    bool there = false;
    status status = is_there(w, &run, &there);  // another combination of this sweep, or another process, was quicker
    w->states[index] = w->states[index] == RUN_MISSING ? RUN_GIVEN : RUN_GIVEN_AGAIN;
    if (status == STATUS_OK && (there || on_its_way(w, &run))) {
        w->totals->there++;
        w->work -= expect_work(&run);
    } else if (status == STATUS_OK) {
        status = w->pool->start(w->pool, slot, index);
    }
    return status;
}

// Starts the missing runs in order, and takes what comes of them.
static status run_missing(sweep_work *w)
{
    status status = STATUS_OK;
    while (status == STATUS_OK && w->ended < w->totals->combinations - w->totals->there) {
        const int slot = idle_slot(w->pool);
        if (slot >= 0 && find_missing(w)) {
            status = give_out(w, slot);
            show_progress(w);
        } else {
            status = collect(w);
        }
    }
    return status;
}

status sweep_run_in(sweep *sweep, sweep_pool *pool, sweep_totals *totals)
{
    *totals = (sweep_totals){.combinations = sweep_count(sweep)};
    sweep_work w = {.sweep = sweep, .pool = pool, .totals = totals};
    w.states = calloc(totals->combinations, sizeof *w.states);
    status status = w.states ? STATUS_OK : report_error(sweep->report, STATUS_IO, "out of memory");
    for (uint64_t i = 0; status == STATUS_OK && i < totals->combinations; i++) {
        const sweep_combination run = sweep_get(sweep, i);
        bool there = false;
        status = is_there(&w, &run, &there);
        w.states[i] = there ? RUN_GIVEN : RUN_MISSING;
        totals->there += there;
        w.work += there ? 0 : expect_work(&run);
    }
    clock_gettime(CLOCK_MONOTONIC, &w.start);
    if (status == STATUS_OK)
        status = run_missing(&w);
    pool->close(pool);  // after an error, runs may be on their way: nobody takes their results
    free(w.states);
    return status;
}

status sweep_run(sweep *sweep, int jobs, sweep_totals *totals)
{
    sweep_pool *pool = NULL;
    const status status = processes_open(sweep, jobs, &pool);
    return status == STATUS_OK ? sweep_run_in(sweep, pool, totals) : status;
}
