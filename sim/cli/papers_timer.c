// One program on one machine and one trace at the level cycle: times out, a JSON file a run and one CSV of all.
#include "papers_time.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct paper_timer {
    run_options run;
    char folder[PAPER_FOLDER_SIZE];  // of traces; empty: not made
    const char *out;
    aside *csv;  // NULL: no results are kept
    FILE *csv_file;
    uint64_t done, total;  // runs
};

static status open_csv(paper_timer *timer, const char *name)
{
    char path[PAPER_PATH_SIZE];
    if (mkdir(timer->out, 0777) != 0 && errno != EEXIST)
        return report_error(&command_report, STATUS_IO, "%s: cannot be made: %s", timer->out, strerror(errno));
    snprintf(path, sizeof path, "%s/%s", timer->out, name);
    status status = aside_open(path, &command_report, &timer->csv, &timer->csv_file);
    if (status != STATUS_OK)
        return status;
    fputs("subject,program,machine,note,depth_format,color_format,kernel_slots_per_clock,kernel_guarded_slots,"
          "iterations,geometry_passes,fragments_composited,max_abs,cycles,seconds,memory_bytes",
          timer->csv_file);
    for (int i = 0; i <= RESOURCE_COUNT; i++)
        fprintf(timer->csv_file, ",cycles_bound_by_%s", clock_resource_names[i]);
    putc('\n', timer->csv_file);
    return STATUS_OK;
}

status paper_timer_create(const run_options *run, const char *out, const char *csv, uint64_t runs, paper_timer **timer)
{
    paper_timer *new = *timer = calloc(1, sizeof *new);
    if (!new)
        return report_error(&command_report, STATUS_IO, "out of memory");
    new->run = *run;
    new->run.keep_planes = new->run.log_conditions = true;
    new->out = out;
    new->total = runs;
    status status = paper_folder_make(new->folder);
    if (status == STATUS_OK && out)
        status = open_csv(new, csv);
    if (status != STATUS_OK) {
        paper_timer_destroy(new);
        *timer = NULL;
    }
    return status;
}

static void progress(const paper_timer *timer, const char *what)
{
    report_progress(&command_report, what, timer->done, timer->total);
}

status paper_timer_record(paper_timer *timer, const char *subject, const char *scene, const record_options *options,
                          trace **trace)
{
    char what[2 * PAPER_LABEL_SIZE];
    snprintf(what, sizeof what, "%s: recording", subject);
    progress(timer, what);
    return paper_trace_record(timer->folder, scene, options, trace);
}

// ---- A run ---------------------------------------------------------------------------------------------

static void take_counts(const run_result *result, paper_time *time)
{
    *time = (paper_time){.iterations = result->iterations,
                         .passes = result->geometry_passes,
                         .unsorted = result->passes_by_class[CLASS_TRANSPARENT],
                         .sorted = result->passes_by_class[CLASS_SORTED],
                         .composited = result->fragments_composited,
                         .max_abs = result->error.max_abs};
}

static void take_times(const detail_result *detail, paper_time *time)
{
    const double rate = 1e6 * (double)detail->machine.core_mhz;
    time->known = true;
    time->cycles = detail->drained_cycles;
    time->seconds = (double)detail->drained_cycles / rate;
    time->total = detail->total;
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        const pass_record *pass = &detail->passes[i];
        const uint64_t cycles = pass->drained - pass->start;
        time->bound_by[pass->bound_by] += cycles;
        if (pass->info.iteration == time->iterations)
            time->last_seconds += (double)cycles / rate;
    }
}

static void write_row(FILE *file, const char *subject, const char *program, const machine *machine, const char *note,
                      const paper_time *time)
{
    fprintf(file, "%s,\"%s\",%s,%s,%s,%s,%" PRId64 ",%" PRId64 ",", subject, program, machine->name, note,
            format_table[machine->depth_format].name, format_table[machine->color_format].name,
            machine->kernel_slots_per_clock, machine->kernel_guarded_slots);
    fprintf(file, "%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%.3g,%" PRIu64 ",%.6g,%" PRIu64, time->iterations, time->passes,
            time->composited, time->max_abs, time->cycles, time->seconds,
            time->total.memory_bytes_read + time->total.memory_bytes_written);
    for (int i = 0; i <= RESOURCE_COUNT; i++)
        fprintf(file, ",%" PRIu64, time->bound_by[i]);
    putc('\n', file);
}

// A comma of the program's words would end a field of shells.
static status write_results(const paper_timer *timer, const char *subject, const char *program, const char *note,
                            const run_result *function, const detail_result *detail, const paper_time *time)
{
    char path[2 * PAPER_PATH_SIZE], name[4 * PAPER_LABEL_SIZE];
    const machine *machine = &detail->machine;
    snprintf(name, sizeof name, "%s.%s.%s", subject, program, note);
    for (char *at = name; *at; at++)
        *at = *at == ',' || *at == '=' ? '_' : *at;
    snprintf(path, sizeof path, "%s/%s.json", timer->out, name);
    write_row(timer->csv_file, subject, program, machine, note, time);
    return detail_write_json(function, detail, subject, path, &command_report);
}

static status replay(paper_timer *timer, trace *trace, const char *words, const machine *machine, program **program,
                     run_result **result)
{
    char path[PAPER_PATH_SIZE];
    rop_limits limits;
    *program = NULL;
    *result = NULL;
    machine_limits(machine, &limits);
    status status = program_load(words, &command_report, path, sizeof path, program);
    if (status == STATUS_OK)
        status = verify_program(*program, path, &limits, &command_report);
    if (status == STATUS_OK)
        status = trace_rewind(trace);
    if (status == STATUS_OK)
        status = replay_run(*program, machine, trace, &timer->run, &paper_errors, result);
    return status;
}

status paper_timer_run(paper_timer *timer, trace *trace, const char *subject, const char *words, const machine *machine,
                       const char *note, paper_time *time)
{
    const detail_options options = {.level = DETAIL_CYCLE};
    char what[4 * PAPER_LABEL_SIZE];
    program *program;
    run_result *function;
    detail_result *detail = NULL;
    snprintf(what, sizeof what, "%s: %s on %s", subject, words, note);
    progress(timer, what);
    status status = replay(timer, trace, words, machine, &program, &function);
    if (status == STATUS_OK)
        status = detail_run(program, machine, trace, function, &options, &paper_errors, &detail);
    if (status == STATUS_OK) {
        take_counts(function, time);
        take_times(detail, time);
    }
    if (status == STATUS_OK && timer->out)
        status = write_results(timer, subject, words, note, function, detail, time);
    timer->done++;
    detail_destroy(detail);
    result_destroy(function);
    program_destroy(program);
    return status;
}

status paper_timer_count(paper_timer *timer, trace *trace, const char *words, const machine *machine, paper_time *time)
{
    program *program;
    run_result *function;
    status status = replay(timer, trace, words, machine, &program, &function);
    if (status == STATUS_OK)
        take_counts(function, time);
    result_destroy(function);
    program_destroy(program);
    return status;
}

void paper_timer_skip(paper_timer *timer, uint64_t runs)
{
    timer->done += runs;
}

status paper_timer_finish(paper_timer *timer)
{
    report_progress(&command_report, "", timer->total, timer->total);  // takes the line away
    if (!timer->csv)
        return STATUS_OK;
    aside *csv = timer->csv;
    timer->csv = NULL;
    return aside_finish(csv);
}

void paper_timer_destroy(paper_timer *timer)
{
    if (!timer)
        return;
    if (timer->folder[0])
        rmdir(timer->folder);
    aside_discard(timer->csv);
    free(timer);
}

clock_resource paper_time_bound(const paper_time *time, double *share)
{
    int most = 0;
    for (int i = 1; i <= RESOURCE_COUNT; i++)
        most = time->bound_by[i] > time->bound_by[most] ? i : most;
    *share = time->cycles > 0 ? (double)time->bound_by[most] / (double)time->cycles : 0;
    return (clock_resource)most;
}
