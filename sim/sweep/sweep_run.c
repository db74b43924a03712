// Runs what is missing: one process a run, at most `jobs` at a time; what came of each goes to the store as it ends.
//
// A worker replays and writes one sweep_row into its pipe; it never touches the database. So a crash of a run costs
// that run alone, and the process that holds the database is the only one that can lose anything: nothing, by
// transactions.
#include "sweep.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { POLL_MILLISECONDS = 250 };

// A run on its way.
typedef struct worker {
    pid_t pid;  // 0: none
    int pipe;
    sweep_combination run;
    sweep_row row;
    size_t received;
} worker;

typedef struct sweep_work {
    sweep *sweep;
    sweep_totals *totals;
    worker *workers;
    int jobs;
    uint64_t ended;
    struct timespec start;
} sweep_work;

// ---- In the worker -------------------------------------------------------------------------------------

// Keeps what is said, one message behind the other.
static void keep_reason(void *user, severity severity, const char *text)
{
    sweep_row *row = user;
    const size_t length = strlen(row->why);
    if (severity == SEVERITY_ERROR)
        snprintf(row->why + length, sizeof row->why - length, "%s%s", length ? "; " : "", text);
}

static void replay_into(const sweep *sweep, const sweep_combination *run, sweep_row *row)
{
    const report report = {.say = keep_reason, .user = row};
    const run_options options = {.threads = sweep->file.threads,
                                 .max_iterations = run->max_iterations,
                                 .occlusion_ratio = -1,
                                 .reference = true};
    const machine *machine = &run->variant->machine;
    rop_limits limits;
    trace *trace = NULL;
    run_result *result = NULL;
    machine_limits(machine, &limits);
    row->outcome = OUTCOME_REFUSED;
    if (verify_program(run->program->program, run->program->path, &limits, &report) != STATUS_OK)
        return;
    row->outcome = OUTCOME_FAILED;
    if (trace_open(run->trace->path, &report, &trace) != STATUS_OK)
        return;
    if (strcmp(trace_get_info(trace)->hash, run->trace->hash) != 0) {
        report_error(&report, STATUS_REFUSED, "%s: is another trace than when the sweep began", run->trace->path);
    } else {
        const status status = replay_run(run->program->program, machine, trace, &options, &report, &result);
        if (status == STATUS_OK)
            sweep_row_fill(row, result);
        else if (status == STATUS_REFUSED)
            row->outcome = OUTCOME_REFUSED;
    }
    result_destroy(result);
    trace_close(trace);
}

static _Noreturn void work(const sweep *sweep, const sweep_combination *run, int pipe, pid_t parent)
{
    sweep_row row = {0};
    prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would take the result
    if (getppid() != parent)
        _exit(1);
    replay_into(sweep, run, &row);
    for (size_t sent = 0; sent < sizeof row;) {
        const ssize_t count = write(pipe, (const char *)&row + sent, sizeof row - sent);
        if (count <= 0 && errno != EINTR)
            _exit(1);
        sent += count > 0 ? (size_t)count : 0;
    }
    _exit(0);  // and not exit: buffers and the database are the parent's
}

// ---- In the sweep --------------------------------------------------------------------------------------

static status start(sweep_work *w, worker *worker, const sweep_combination *run)
{
    int ends[2];
    const report *report = w->sweep->report;
    const pid_t parent = getpid();
    if (pipe(ends) != 0)
        return report_error(report, STATUS_IO, "no pipe to a worker: %s", strerror(errno));
    const pid_t pid = fork();
    if (pid == 0) {
        close(ends[0]);
        work(w->sweep, run, ends[1], parent);
    }
    close(ends[1]);
    if (pid < 0) {
        close(ends[0]);
        return report_error(report, STATUS_IO, "no process for a worker: %s", strerror(errno));
    }
    *worker = (struct worker){.pid = pid, .pipe = ends[0], .run = *run};
    return STATUS_OK;
}

// Takes what the pipe has; true at its end.
static bool receive(worker *worker)
{
    char *row = (char *)&worker->row;
    char over[1];  // a read of nothing would look like the end
    const size_t left = sizeof worker->row - worker->received;
    const ssize_t count = read(worker->pipe, left ? row + worker->received : over, left ? left : sizeof over);
    if (count > 0)
        worker->received += left ? (size_t)count : 0;
    return count == 0 || (count < 0 && errno != EINTR);
}

static void reap(worker *worker, int *ended)
{
    while (waitpid(worker->pid, ended, 0) < 0 && errno == EINTR)
        continue;
    close(worker->pipe);
    worker->pid = 0;
}

static status finish(sweep_work *w, worker *worker)
{
    int ended = 0;
    sweep_row *row = &worker->row;
    reap(worker, &ended);
    if (worker->received < sizeof *row) {
        *row = (sweep_row){.outcome = OUTCOME_FAILED};
        if (WIFSIGNALED(ended))
            snprintf(row->why, sizeof row->why, "the run's process was ended by signal %d (%s)", WTERMSIG(ended),
                     strsignal(WTERMSIG(ended)));
        else
            snprintf(row->why, sizeof row->why, "the run's process ended with status %d and without a result",
                     WEXITSTATUS(ended));
    }
    const status status = store_add(w->sweep->store, &worker->run, row);
    w->ended++;
    w->totals->done += row->outcome == OUTCOME_DONE;
    w->totals->refused += row->outcome == OUTCOME_REFUSED;
    w->totals->failed += row->outcome == OUTCOME_FAILED;
    if (row->outcome == OUTCOME_FAILED)
        report_warning(w->sweep->report, "%s on %s failed: %s", worker->run.program->label, worker->run.trace->label,
                       row->why);
    return status;
}

static void show_progress(const sweep_work *w)
{
    char what[128], left[64] = "";
    struct timespec now;
    const uint64_t total = w->totals->combinations - w->totals->there;
    clock_gettime(CLOCK_MONOTONIC, &now);
    const double seconds = (double)(now.tv_sec - w->start.tv_sec) + 1e-9 * (double)(now.tv_nsec - w->start.tv_nsec);
    if (w->ended > 0)
        snprintf(left, sizeof left, ", about %.0f s left", seconds / (double)w->ended * (double)(total - w->ended));
    snprintf(what, sizeof what, "sweep: %" PRIu64 " of %" PRIu64 " runs%s", w->ended, total, left);
    report_progress(w->sweep->report, what, w->ended, total);
}

// Waits until something ended or a moment has passed.
static status collect(sweep_work *w)
{
    struct pollfd polls[SWEEP_JOBS_MAX];
    status status = STATUS_OK;
    for (int i = 0; i < w->jobs; i++)
        polls[i] = (struct pollfd){.fd = w->workers[i].pid ? w->workers[i].pipe : -1, .events = POLLIN};
    if (poll(polls, (nfds_t)w->jobs, POLL_MILLISECONDS) < 0 && errno != EINTR)
        return report_error(w->sweep->report, STATUS_IO, "waiting for workers: %s", strerror(errno));
    for (int i = 0; i < w->jobs; i++) {
        if (w->workers[i].pid && polls[i].revents && receive(&w->workers[i]) && status == STATUS_OK)
            status = finish(w, &w->workers[i]);
    }
    show_progress(w);
    return status;
}

static worker *idle_worker(const sweep_work *w)
{
    for (int i = 0; i < w->jobs; i++) {
        if (!w->workers[i].pid)
            return &w->workers[i];
    }
    return NULL;
}

// Two combinations can stand for the same run: a program under two names, a setting that changes nothing.
static bool on_its_way(const sweep_work *w, const sweep_combination *run)
{
    for (int i = 0; i < w->jobs; i++) {
        const sweep_combination *other = &w->workers[i].run;
        if (w->workers[i].pid && strcmp(other->program->hash, run->program->hash) == 0 &&
            strcmp(other->trace->hash, run->trace->hash) == 0 && strcmp(other->variant->hash, run->variant->hash) == 0)
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

// Starts the missing runs among all, in order, and takes what comes of them.
static status run_missing(sweep_work *w, const bool *missing)
{
    status status = STATUS_OK;
    for (uint64_t i = 0; status == STATUS_OK && i < w->totals->combinations; i++) {
        if (!missing[i])
            continue;
        const sweep_combination run = sweep_get(w->sweep, i);
        bool there = false;
        while (status == STATUS_OK && !idle_worker(w))
            status = collect(w);
        if (status == STATUS_OK)
            status = is_there(w, &run, &there);  // another combination of this sweep, or another process, was quicker
        if (status == STATUS_OK && (there || on_its_way(w, &run))) {
            w->totals->there++;
            continue;
        }
        if (status == STATUS_OK)
            status = start(w, idle_worker(w), &run);
        show_progress(w);
    }
    while (status == STATUS_OK && w->ended < w->totals->combinations - w->totals->there)
        status = collect(w);
    return status;
}

status sweep_run(sweep *sweep, int jobs, sweep_totals *totals)
{
    *totals = (sweep_totals){.combinations = sweep_count(sweep)};
    sweep_work w = {.sweep = sweep,
                    .totals = totals,
                    .jobs = jobs < 1                ? 1
                            : jobs > SWEEP_JOBS_MAX ? SWEEP_JOBS_MAX
                                                    : jobs};
    bool *missing = calloc(totals->combinations, sizeof *missing);
    w.workers = calloc((size_t)w.jobs, sizeof *w.workers);
    status status = missing && w.workers ? STATUS_OK : report_error(sweep->report, STATUS_IO, "out of memory");
    for (uint64_t i = 0; status == STATUS_OK && i < totals->combinations; i++) {
        const sweep_combination run = sweep_get(sweep, i);
        bool there = false;
        status = is_there(&w, &run, &there);
        missing[i] = !there;
        totals->there += there;
    }
    clock_gettime(CLOCK_MONOTONIC, &w.start);
    if (status == STATUS_OK)
        status = run_missing(&w, missing);
    for (int i = 0; w.workers && i < w.jobs; i++) {  // after an error: nobody takes their results
        int ended;
        if (w.workers[i].pid) {
            kill(w.workers[i].pid, SIGKILL);
            reap(&w.workers[i], &ended);
        }
    }
    free(w.workers);
    free(missing);
    return status;
}
