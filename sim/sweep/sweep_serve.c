// Of every rank but 0: replays what rank 0 hands out, in processes of its own, and sends back what came of it.
//
// A run that crashes ends one of those processes; the rank lives on and says so. MPI's connections are inherited by those
// processes, which never use them.
#include "sweep_ranks.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { WAIT_MILLISECONDS = 2 };

typedef struct server {
    sweep_ranks *ranks;
    const char *path;
    int jobs;
    char why[SWEEP_WHY_SIZE];  // what `report` was told
    report report;
    sweep *sweep;  // from TAG_BEGIN on
    sweep_pool *pool;
    double heard;
    bool ended;
} server;

static status send_row(server *s, int slot, uint64_t index, const sweep_row *row)
{
    rank_row message;
    memset(&message, 0, sizeof message);
    message.slot = slot;
    message.index = index;
    message.row = *row;
    return ranks_send(s->ranks, 0, TAG_ROW, &message, sizeof message);
}

// Rank 0 has recorded the traces, and the file is what it reads.
static status begin(server *s)
{
    rank_ready ready;
    memset(&ready, 0, sizeof ready);
    snprintf(ready.version, sizeof ready.version, "%s", ROPSIM_VERSION);
    gethostname(ready.host, sizeof ready.host - 1);
    if (sweep_open_plan(s->path, &s->report, &s->sweep) == STATUS_OK)
        processes_open(s->sweep, s->jobs, &s->pool);
    memcpy(ready.why, s->why, sizeof ready.why);
    return ranks_send(s->ranks, 0, TAG_READY, &ready, sizeof ready);
}

// Whether our files give the run that rank 0 means. The hash of the trace is compared when the run opens it.
static bool is_meant(server *s, const rank_run *run)
{
    if (!s->pool || run->slot < 0 || run->slot >= s->pool->slot_count || run->index >= sweep_count(s->sweep))
        return false;
    const sweep_combination own = sweep_get(s->sweep, run->index);
    if (strcmp(own.detail->name, run->detail) != 0 || strcmp(own.program->hash, run->program_hash) != 0 ||
        strcmp(own.variant->hash, run->variant_hash) != 0)
        return false;
    sweep_trace *trace = &s->sweep->traces[own.trace - s->sweep->traces];
    memcpy(trace->hash, run->trace_hash, sizeof trace->hash);
    return true;
}

static status start(server *s, const rank_run *run)
{
    sweep_row row = {.outcome = OUTCOME_FAILED};
    s->why[0] = 0;
    if (!is_meant(s, run))
        report_error(
            &s->report, STATUS_REFUSED,
            "rank %d reads another sweep file, program or machine than rank 0; every rank needs the same files",
            s->ranks->rank);
    else if (s->pool->start(s->pool, run->slot, run->index) == STATUS_OK)
        return STATUS_OK;
    memcpy(row.why, s->why, sizeof row.why);
    return send_row(s, run->slot, run->index, &row);
}

static status take_messages(server *s)
{
    for (;;) {
        rank_message message;
        rank_tag tag;
        int from;
        status status = ranks_take(s->ranks, &from, &tag, &message);
        if (status != STATUS_OK || from < 0)
            return status;
        s->heard = ranks_now();
        if (tag == TAG_BEGIN)
            status = begin(s);
        else if (tag == TAG_RUN)
            status = start(s, &message.run);
        else if (tag == TAG_END)
            s->ended = true;
        if (status != STATUS_OK || s->ended)
            return status;
    }
}

static status send_rows(server *s)
{
    status status = s->pool->wait(s->pool, WAIT_MILLISECONDS);
    for (int i = 0; status == STATUS_OK && i < s->pool->slot_count; i++) {
        sweep_slot *slot = &s->pool->slots[i];
        if (slot->state != SLOT_ENDED)
            continue;
        slot->state = SLOT_IDLE;
        status = send_row(s, i, slot->index, &slot->row);
    }
    return status;
}

static status serve(server *s)
{
    status status = STATUS_OK;
    while (status == STATUS_OK) {
        status = take_messages(s);
        if (s->ended)
            return status;
        if (status == STATUS_OK && s->pool)
            status = send_rows(s);
        else
            usleep(1000 * WAIT_MILLISECONDS);
        // Recording may take as long as it takes; after it, rank 0 is heard each second.
        if (status == STATUS_OK && s->sweep && ranks_beat_is_due(s->ranks)) {
            status = ranks_send(s->ranks, 0, TAG_BEAT, NULL, 0);
            if (ranks_now() - s->heard > s->ranks->silence)
                status = STATUS_IO;
        }
    }
    return status;
}

status sweep_serve(const char *path, sweep_ranks *ranks, int jobs)
{
    server s = {.ranks = ranks, .path = path, .jobs = jobs};
    s.report = (report){.say = sweep_keep_reason, .user = s.why};
    const status status = serve(&s);
    if (s.pool)
        s.pool->close(s.pool);
    sweep_close(s.sweep);
    return status;
}
