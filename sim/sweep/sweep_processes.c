// Runs in processes of this machine: one process a run, at most `jobs` at a time.
//
// A process replays and writes one sweep_row into its pipe; it never touches the database. So a crash of a run costs
// that run alone, and comes back as a row that says how it ended.
#include "sweep.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

// Of a slot that is busy.
typedef struct process {
    pid_t pid;
    int pipe;
    size_t received;
} process;

typedef struct processes {
    sweep_pool pool;
    const sweep *sweep;
    process *processes;  // one a slot
} processes;

// ---- In the process of a run ---------------------------------------------------------------------------

// A deeper level refuses a machine, or finds a mistake of its own; that is no property of the machine.
static sweep_outcome outcome_of(status status, const char *why)
{
    if (status == STATUS_OK)
        return OUTCOME_DONE;
    return status == STATUS_REFUSED && !strstr(why, "internal error: ") ? OUTCOME_REFUSED : OUTCOME_FAILED;
}

// At the levels that the combination asks for.
static void replay_trace(const sweep *sweep, const sweep_combination *run, trace *trace, const report *report,
                         sweep_row *row)
{
    const bool deeper = run->detail != DETAIL_FUNCTION;
    const run_options options = {.threads = sweep->file.threads,
                                 .max_iterations = run->max_iterations,
                                 .occlusion_ratio = -1,
                                 .reference = true,
                                 .log_conditions = deeper,
                                 .keep_planes = deeper};
    detail_options detail_options = {.level = run->detail};
    const machine *machine = &run->variant->machine;
    const program *program = run->program->program;
    run_result *result = NULL;
    detail_result *detail = NULL;
    status status = detail_read(program, machine, trace, &detail_options, report, &detail_options.stamps);
    if (status == STATUS_OK)
        status = replay_run_on(program, machine, trace, detail_options.stamps, &options, report, &result);
    if (status == STATUS_OK && deeper)
        status = detail_run(program, machine, trace, result, &detail_options, report, &detail);
    if (status == STATUS_OK)
        sweep_row_fill(row, result, detail);
    else
        row->outcome = outcome_of(status, row->why);
    detail_destroy(detail);
    result_destroy(result);
    stamps_destroy(detail_options.stamps);
}

static void replay_into(const sweep *sweep, const sweep_combination *run, sweep_row *row)
{
    const report report = {.say = sweep_keep_reason, .user = row->why};
    rop_limits limits;
    trace *trace = NULL;
    machine_limits(&run->variant->machine, &limits);
    row->outcome = OUTCOME_REFUSED;
    // A machine that contradicts itself is refused at every level, as it is by `ropsim run`.
    if (machine_check(&run->variant->machine, &report) != STATUS_OK ||
        verify_program(run->program->program, run->program->path, &limits, &report) != STATUS_OK)
        return;
    row->outcome = OUTCOME_FAILED;
    if (trace_open(run->trace->path, &report, &trace) != STATUS_OK)
        return;
    if (strcmp(trace_get_info(trace)->hash, run->trace->hash) != 0)
        report_error(&report, STATUS_REFUSED, "%s: is another trace than when the sweep began", run->trace->path);
    else
        replay_trace(sweep, run, trace, &report, row);
    trace_close(trace);
}

static _Noreturn void work(const sweep *sweep, uint64_t index, int pipe, pid_t parent)
{
    sweep_row row = {0};
    const sweep_combination run = sweep_get(sweep, index);
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would take the result
    if (getppid() != parent)
        _exit(1);
    replay_into(sweep, &run, &row);
    for (size_t sent = 0; sent < sizeof row;) {
        const ssize_t count = write(pipe, (const char *)&row + sent, sizeof row - sent);
        if (count <= 0 && errno != EINTR)
            _exit(1);
        sent += count > 0 ? (size_t)count : 0;
    }
    _exit(0);  // and not exit: buffers, the database and MPI are the parent's
}

// ---- In the sweep --------------------------------------------------------------------------------------

static status start(sweep_pool *pool, int slot, uint64_t index)
{
    processes *p = (processes *)pool;
    int ends[2];
    const pid_t parent = getpid();
    if (pipe(ends) != 0)
        return report_error(p->sweep->report, STATUS_IO, "no pipe to a worker: %s", strerror(errno));
    const pid_t pid = fork();
    if (pid == 0) {
        close(ends[0]);
        work(p->sweep, index, ends[1], parent);
    }
    close(ends[1]);
    if (pid < 0) {
        close(ends[0]);
        return report_error(p->sweep->report, STATUS_IO, "no process for a worker: %s", strerror(errno));
    }
    p->processes[slot] = (process){.pid = pid, .pipe = ends[0]};
    pool->slots[slot].state = SLOT_BUSY;
    pool->slots[slot].index = index;
    return STATUS_OK;
}

// Takes what the pipe has; true at its end.
static bool receive(process *process, sweep_row *row)
{
    char over[1];  // a read of nothing would look like the end
    const size_t left = sizeof *row - process->received;
    const ssize_t count = read(process->pipe, left ? (char *)row + process->received : over, left ? left : sizeof over);
    if (count > 0)
        process->received += left ? (size_t)count : 0;
    return count == 0 || (count < 0 && errno != EINTR);
}

static void reap(process *process, int *ended)
{
    while (waitpid(process->pid, ended, 0) < 0 && errno == EINTR)
        continue;
    close(process->pipe);
    process->pid = 0;
}

static void finish(process *process, sweep_slot *slot)
{
    int ended = 0;
    sweep_row *row = &slot->row;
    reap(process, &ended);
    slot->state = SLOT_ENDED;
    if (process->received == sizeof *row)
        return;
    *row = (sweep_row){.outcome = OUTCOME_FAILED};
    if (WIFSIGNALED(ended))
        snprintf(row->why, sizeof row->why, "the run's process was ended by signal %d (%s)", WTERMSIG(ended),
                 strsignal(WTERMSIG(ended)));
    else
        snprintf(row->why, sizeof row->why, "the run's process ended with status %d and without a result",
                 WEXITSTATUS(ended));
}

static status wait_for_any(sweep_pool *pool, int milliseconds)
{
    processes *p = (processes *)pool;
    struct pollfd polls[SWEEP_JOBS_MAX];
    for (int i = 0; i < pool->slot_count; i++)
        polls[i] = (struct pollfd){.fd = p->processes[i].pid ? p->processes[i].pipe : -1, .events = POLLIN};
    if (poll(polls, (nfds_t)pool->slot_count, milliseconds) < 0) {
        if (errno == EINTR)  // `polls` holds nothing
            return STATUS_OK;
        return report_error(p->sweep->report, STATUS_IO, "waiting for workers: %s", strerror(errno));
    }
    for (int i = 0; i < pool->slot_count; i++) {
        if (p->processes[i].pid && polls[i].revents && receive(&p->processes[i], &pool->slots[i].row))
            finish(&p->processes[i], &pool->slots[i]);
    }
    return STATUS_OK;
}

static void close_processes(sweep_pool *pool)
{
    processes *p = (processes *)pool;
    for (int i = 0; p->processes && i < pool->slot_count; i++) {
        int ended;
        if (p->processes[i].pid) {
            kill(p->processes[i].pid, SIGKILL);
            reap(&p->processes[i], &ended);
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
