// A trace, program and machine in; what each level of detail takes and tells, out.
//
// Each level runs in a process of its own and sends its figures through a pipe: so memory is a level's own, and a crash costs
// that level and is told. The level sampled runs all its seeds in one process, after one run of the function level.
#include "trade.h"

#include "command.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// ---- In the process of a level -------------------------------------------------------------------------

static double seconds_used(double *peak_mib)
{
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    *peak_mib = (double)used.ru_maxrss / 1024;
    return (double)used.ru_utime.tv_sec + (double)used.ru_stime.tv_sec +
           1e-6 * ((double)used.ru_utime.tv_usec + (double)used.ru_stime.tv_usec);
}

static bool send(int pipe, const trade_figures *figures)
{
    for (size_t sent = 0; sent < sizeof *figures;) {
        const ssize_t count = write(pipe, (const char *)figures + sent, sizeof *figures - sent);
        if (count <= 0 && errno != EINTR)
            return false;
        sent += count > 0 ? (size_t)count : 0;
    }
    return true;
}

// One run at a deeper level; `before`: CPU seconds that it needs besides its own.
static status run_level(const program *program, const trade_row *row, trace *trace, const run_result *function, const detail_options *options,
                        double before, int pipe)
{
    trade_figures figures = {.visits = function->fragments_replayed};
    detail_result *detail = NULL;
    const double start = seconds_used(&figures.peak_mib);
    status status = STATUS_OK;
    if (options->level != DETAIL_FUNCTION)
        status = detail_run(program, row->machine, trace, function, options, &command_report, &detail);
    if (status != STATUS_OK)
        return status;
    figures.again_seconds = seconds_used(&figures.peak_mib) - start;
    figures.cpu_seconds = before + figures.again_seconds;
    if (detail) {
        figures.cycles = detail->total.cycles;
        figures.bytes_read = detail->total.memory_bytes_read;
        figures.bytes_written = detail->total.memory_bytes_written;
        figures.half_cycles = detail->half_widths[STAT_INDEX_cycles];
        figures.half_bytes = detail->memory_half_width;
        figures.windows = detail->windows;
        figures.stamps = detail->stamps;
        figures.stamps_measured = detail->stamps_measured;
    }
    detail_destroy(detail);
    return send(pipe, &figures) ? STATUS_OK : STATUS_IO;
}

static status work(const trade_row *row, detail_level level, const sampling *first, int pipe)
{
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = level != DETAIL_FUNCTION,
                                 .log_conditions = level != DETAIL_FUNCTION};
    const int runs = level == DETAIL_SAMPLED ? row->seed_count : 1;
    sampling sampling = *first;
    detail_options detail_options = {.level = level, .sampling = &sampling};
    double peak;
    program *program = NULL;
    trace *trace = NULL;
    run_result *function = NULL;
    status status = trace_open(row->trace, &command_report, &trace);
    if (status == STATUS_OK)
        status = command_load_program(row->program, row->machine, &program);
    if (status == STATUS_OK && detail_reads_first(row->machine, &detail_options))
        status = detail_read(program, row->machine, trace, &detail_options, &command_report, &detail_options.stamps);
    if (status == STATUS_OK)
        status = replay_run_on(program, row->machine, trace, detail_options.stamps, &options, &command_report, &function);
    if (status == STATUS_OK && level != DETAIL_FUNCTION && !detail_options.stamps)
        status = detail_read(program, row->machine, trace, &detail_options, &command_report, &detail_options.stamps);
    const double before = seconds_used(&peak);
    for (int i = 0; status == STATUS_OK && i < runs; i++) {
        sampling.seed = first->seed + (uint64_t)i;
        status = run_level(program, row, trace, function, &detail_options, before, pipe);
    }
    result_destroy(function);
    stamps_destroy(detail_options.stamps);
    program_destroy(program);
    trace_close(trace);
    return status;
}

// ---- In the command ------------------------------------------------------------------------------------

static bool receive(int pipe, trade_figures *figures, size_t bytes)
{
    for (size_t got = 0; got < bytes;) {
        const ssize_t count = read(pipe, (char *)figures + got, bytes - got);
        if (count == 0 || (count < 0 && errno != EINTR))
            return false;
        got += count > 0 ? (size_t)count : 0;
    }
    return true;
}

static status measure_level(const trade_row *row, detail_level level, const sampling *first, trade_figures *figures, int count)
{
    int ends[2], ended = 0;
    const pid_t parent = getpid();
    fflush(NULL);
    if (pipe(ends) != 0)
        return report_error(&command_report, STATUS_IO, "no pipe to a level's process: %s", strerror(errno));
    const pid_t pid = fork();
    if (pid == 0) {
        close(ends[0]);
        prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would take the figures
        _exit(getppid() == parent ? (int)work(row, level, first, ends[1]) : 1);
    }
    close(ends[1]);
    const bool whole = pid > 0 && receive(ends[0], figures, (size_t)count * sizeof *figures);
    close(ends[0]);
    if (pid < 0)
        return report_error(&command_report, STATUS_IO, "no process for a level: %s", strerror(errno));
    while (waitpid(pid, &ended, 0) < 0 && errno == EINTR)
        continue;
    if (WIFSIGNALED(ended))
        return report_error(&command_report, STATUS_IO, "%s with %s: the process of the level %s was ended by signal %d (%s)", row->trace,
                            row->program, detail_level_names[level], WTERMSIG(ended), strsignal(WTERMSIG(ended)));
    if (WEXITSTATUS(ended) != 0)
        return (status)WEXITSTATUS(ended);  // it said why
    return whole ? STATUS_OK : report_error(&command_report, STATUS_IO, "the process of a level ended without its figures");
}

status trade_measure(trade_row *row, const sampling *first)
{
    status status = STATUS_OK;
    for (int level = 0; status == STATUS_OK && level < DETAIL_SAMPLED; level++)
        status = measure_level(row, (detail_level)level, first, &row->levels[level], 1);
    if (status == STATUS_OK)
        status = measure_level(row, DETAIL_SAMPLED, first, row->seeds, row->seed_count);
    const trade_figures *traffic = &row->levels[DETAIL_TRAFFIC], *cycle = &row->levels[DETAIL_CYCLE];
    if (status == STATUS_OK && (traffic->bytes_read != cycle->bytes_read || traffic->bytes_written != cycle->bytes_written))
        return report_error(&command_report, STATUS_REFUSED,
                            "internal error: %s with %s: traffic reads %llu and writes %llu bytes, cycle %llu and %llu", row->trace, row->program,
                            (unsigned long long)traffic->bytes_read, (unsigned long long)traffic->bytes_written,
                            (unsigned long long)cycle->bytes_read, (unsigned long long)cycle->bytes_written);
    return status;
}

// ---- What it is worth ----------------------------------------------------------------------------------

static double quantity_of(const trade_figures *f, trade_quantity quantity)
{
    return quantity == TRADE_CYCLES ? (double)f->cycles : (double)f->bytes_read + (double)f->bytes_written;
}

static double half_width(const trade_figures *f, trade_quantity quantity)
{
    return quantity == TRADE_CYCLES ? f->half_cycles : f->half_bytes;
}

static double per_cent(const trade_row *row, double part, trade_quantity quantity)
{
    const double truth = quantity_of(&row->levels[DETAIL_CYCLE], quantity);
    return truth > 0 ? 100 * part / truth : 0;
}

double trade_error(const trade_row *row, const trade_figures *figures, trade_quantity quantity)
{
    return per_cent(row, quantity_of(figures, quantity) - quantity_of(&row->levels[DETAIL_CYCLE], quantity), quantity);
}

double trade_half_width(const trade_row *row, const trade_figures *figures, trade_quantity quantity)
{
    return per_cent(row, half_width(figures, quantity), quantity);
}

bool trade_covers(const trade_row *row, const trade_figures *figures, trade_quantity quantity)
{
    return fabs(quantity_of(figures, quantity) - quantity_of(&row->levels[DETAIL_CYCLE], quantity)) <= half_width(figures, quantity);
}

trade_summary trade_summarize(const trade_row *row, trade_quantity quantity)
{
    trade_summary sum = {0};
    for (int i = 0; i < row->seed_count; i++) {
        const double error = trade_error(row, &row->seeds[i], quantity);
        sum.bias += error / row->seed_count;
        sum.mean += fabs(error) / row->seed_count;
        sum.worst = fabs(error) > fabs(sum.worst) ? error : sum.worst;
        sum.half_width += trade_half_width(row, &row->seeds[i], quantity) / row->seed_count;
        sum.covered += trade_covers(row, &row->seeds[i], quantity);
    }
    return sum;
}

static double rate(const trade_figures *figures, double seconds)
{
    return seconds > 0 ? (double)figures->visits / seconds : 0;
}

double trade_rate(const trade_figures *figures)
{
    return rate(figures, figures->cpu_seconds);
}

double trade_rate_again(const trade_figures *figures)
{
    return rate(figures, figures->again_seconds);
}

trade_figures trade_sampled(const trade_row *row)
{
    trade_figures figures = row->seeds[0];
    figures.cpu_seconds = figures.again_seconds = 0;
    for (int i = 0; i < row->seed_count; i++) {
        figures.cpu_seconds += row->seeds[i].cpu_seconds / row->seed_count;
        figures.again_seconds += row->seeds[i].again_seconds / row->seed_count;
    }
    return figures;
}
