// Runs in processes of this machine: a worker for each slot, which takes one run after the other.
//
// A worker replays and sends back one sweep_row a run; it never touches the database. A crash of a run ends its worker,
// but costs that run alone: it comes back as a row that says how it ended, and the slot gets a new worker for its next
// run. So does one whose worker ended without a run at hand.
#include "sweep.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

// What a worker is told of a run. Its copy of the sweep may be older than the trace's hash, which rank 0 says with each
// run.
typedef struct request {
    uint64_t index;
    char trace_hash[33];
} request;

// The worker of a slot, busy or not.
typedef struct process {
    pid_t pid;   // 0: there is none
    int socket;  // requests go there, rows come back
    size_t received;
} process;

typedef struct processes {
    sweep_pool pool;
    const sweep *sweep;
    process *processes;  // one a slot
} processes;

// All of it, or false. A worker that is gone must not end us by a signal.
static bool send_whole(int socket, const void *data, size_t size)
{
    for (size_t sent = 0; sent < size;) {
        const ssize_t count = send(socket, (const char *)data + sent, size - sent, MSG_NOSIGNAL);
        if (count < 0 && errno != EINTR)
            return false;
        sent += count > 0 ? (size_t)count : 0;
    }
    return true;
}

// ---- In a worker ---------------------------------------------------------------------------------------

static bool take_request(int socket, request *request)
{
    for (size_t taken = 0; taken < sizeof *request;) {
        const ssize_t count = read(socket, (char *)request + taken, sizeof *request - taken);
        if (count == 0 || (count < 0 && errno != EINTR))
            return false;
        taken += count > 0 ? (size_t)count : 0;
    }
    return true;
}

static _Noreturn void work(const sweep *sweep, int socket, pid_t parent)
{
    sweep_share share = {0};
    sweep_row row;
    request request;
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would take the result
    if (getppid() != parent)
        _exit(1);
    do {
        if (!take_request(socket, &request))
            break;
        sweep_combination run = sweep_get(sweep, request.index);
        sweep_trace trace = *run.trace;
        memcpy(trace.hash, request.trace_hash, sizeof trace.hash);
        run.trace = &trace;
        sweep_share_run(&share, sweep, &run, &row);
    } while (send_whole(socket, &row, sizeof row));
    _exit(0);  // and not exit: buffers, the database and MPI are the parent's
}

// ---- In the sweep --------------------------------------------------------------------------------------

static status start_worker(processes *p, int slot)
{
    int ends[2];
    const pid_t parent = getpid();
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0)
        return report_error(p->sweep->report, STATUS_IO, "no socket to a worker: %s", strerror(errno));
    const pid_t pid = fork();
    if (pid == 0) {
        close(ends[0]);
        for (int i = 0; i < p->pool.slot_count; i++) {  // the others' are not ours to hold open
            if (p->processes[i].pid)
                close(p->processes[i].socket);
        }
        work(p->sweep, ends[1], parent);
    }
    close(ends[1]);  // before another worker could inherit it: it is how we see that this one ended
    if (pid < 0) {
        close(ends[0]);
        return report_error(p->sweep->report, STATUS_IO, "no process for a worker: %s", strerror(errno));
    }
    p->processes[slot] = (process){.pid = pid, .socket = ends[0]};
    return STATUS_OK;
}

static int reap(process *process)
{
    int how = 0;
    while (waitpid(process->pid, &how, 0) < 0 && errno == EINTR)
        continue;
    close(process->socket);
    process->pid = 0;
    return how;
}

static status start(sweep_pool *pool, int slot, uint64_t index)
{
    processes *p = (processes *)pool;
    process *process = &p->processes[slot];
    request request = {.index = index};
    memcpy(request.trace_hash, sweep_get(p->sweep, index).trace->hash, sizeof request.trace_hash);
    for (int tries = 0; tries < 2; tries++) {
        const status status = process->pid ? STATUS_OK : start_worker(p, slot);
        if (status != STATUS_OK)
            return status;
        if (send_whole(process->socket, &request, sizeof request)) {
            pool->slots[slot].state = SLOT_BUSY;
            pool->slots[slot].index = index;
            return STATUS_OK;
        }
        reap(process);  // it ended while it had nothing to do
    }
    return report_error(p->sweep->report, STATUS_IO, "workers end before they have a run");
}

static void say_how_it_ended(int how, sweep_row *row)
{
    *row = (sweep_row){.outcome = OUTCOME_FAILED};
    if (WIFSIGNALED(how))
        snprintf(row->why, sizeof row->why, "the run's process was ended by signal %d (%s)", WTERMSIG(how),
                 strsignal(WTERMSIG(how)));
    else
        snprintf(row->why, sizeof row->why, "the run's process ended with status %d and without a result",
                 WEXITSTATUS(how));
}

// Takes what the socket has: of a row, or that the worker ended.
static void receive(process *process, sweep_slot *slot)
{
    const ssize_t count =
        read(process->socket, (char *)&slot->row + process->received, sizeof slot->row - process->received);
    if (count < 0 && errno == EINTR)
        return;
    if (count > 0) {
        process->received += (size_t)count;
        if (process->received < sizeof slot->row)
            return;
        process->received = 0;
        slot->state = SLOT_ENDED;
        return;
    }
    const int how = reap(process);
    if (slot->state == SLOT_BUSY) {
        say_how_it_ended(how, &slot->row);
        slot->state = SLOT_ENDED;
    }
}

static status wait_for_any(sweep_pool *pool, int milliseconds)
{
    processes *p = (processes *)pool;
    struct pollfd polls[SWEEP_JOBS_MAX];
    for (int i = 0; i < pool->slot_count; i++)
        polls[i] = (struct pollfd){.fd = p->processes[i].pid ? p->processes[i].socket : -1, .events = POLLIN};
    if (poll(polls, (nfds_t)pool->slot_count, milliseconds) < 0) {
        if (errno == EINTR)  // `polls` holds nothing
            return STATUS_OK;
        return report_error(p->sweep->report, STATUS_IO, "waiting for workers: %s", strerror(errno));
    }
    for (int i = 0; i < pool->slot_count; i++) {
        if (p->processes[i].pid && polls[i].revents)
            receive(&p->processes[i], &pool->slots[i]);
    }
    return STATUS_OK;
}

static void close_processes(sweep_pool *pool)
{
    processes *p = (processes *)pool;
    for (int i = 0; p->processes && i < pool->slot_count; i++) {
        if (p->processes[i].pid) {
            kill(p->processes[i].pid, SIGKILL);
            reap(&p->processes[i]);
        }
    }
    free(p->processes);
    free(pool->slots);
    free(p);
}

status processes_open(const sweep *sweep, int jobs, sweep_pool **pool)
{
    *pool = NULL;
    processes *p = calloc(1, sizeof *p);
    if (!p)
        return report_error(sweep->report, STATUS_IO, "out of memory");
    p->sweep = sweep;
    p->pool = (sweep_pool){.start = start, .wait = wait_for_any, .close = close_processes};
    p->pool.slot_count = jobs < 1 ? 1 : jobs > SWEEP_JOBS_MAX ? SWEEP_JOBS_MAX : jobs;
    p->pool.slots = calloc((size_t)p->pool.slot_count, sizeof *p->pool.slots);
    p->processes = calloc((size_t)p->pool.slot_count, sizeof *p->processes);
    if (!p->pool.slots || !p->processes) {
        close_processes(&p->pool);
        return report_error(sweep->report, STATUS_IO, "out of memory");
    }
    *pool = &p->pool;
    return STATUS_OK;
}
