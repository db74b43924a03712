// A scene to a trace, the trace through every program: counts out, a JSON file a cell and one CSV of all.
#include "papers.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct paper_bench {
    program *programs[PAPER_PROGRAM_COUNT];
    const machine *machine;
    run_options run;
    char folder[PAPER_FOLDER_SIZE];  // of traces; empty: not made
    const char *out;
    aside *csv;  // NULL: no results are kept
    FILE *csv_file;
    uint64_t done, total;  // cells
};

static status load_programs(paper_bench *bench)
{
    char path[PAPER_PATH_SIZE];
    rop_limits limits;
    machine_limits(bench->machine, &limits);
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < PAPER_PROGRAM_COUNT; i++) {
        status = program_load(paper_programs[i].name, &command_report, path, sizeof path, &bench->programs[i]);
        if (status == STATUS_OK)
            status = verify_program(bench->programs[i], path, &limits, &command_report);
    }
    return status;
}

static status open_results(paper_bench *bench)
{
    char path[PAPER_PATH_SIZE];
    if (mkdir(bench->out, 0777) != 0 && errno != EEXIST)
        return report_error(&command_report, STATUS_IO, "%s: cannot be made: %s", bench->out, strerror(errno));
    snprintf(path, sizeof path, "%s/papers.csv", bench->out);
    status status = aside_open(path, &command_report, &bench->csv, &bench->csv_file);
    if (status == STATUS_OK)
        fputs("subject,order,program,width,height,triangles,fragments,deepest_sample,iterations,geometry_passes,"
              "unsorted_passes,sorted_passes,fullscreen_passes,iteration_limit_reached,exact,max_abs,samples_wrong\n",
              bench->csv_file);
    return status;
}

status paper_bench_create(const machine *machine, const run_options *run, const char *out, uint64_t cases,
                          paper_bench **bench)
{
    paper_bench *new = *bench = calloc(1, sizeof *new);
    if (!new)
        return report_error(&command_report, STATUS_IO, "out of memory");
    new->machine = machine;
    new->run = *run;
    new->out = out;
    new->total = cases *PAPER_PROGRAM_COUNT;
    status status = load_programs(new);
    if (status == STATUS_OK)
        status = paper_folder_make(new->folder);
    if (status == STATUS_OK && out)
        status = open_results(new);
    if (status != STATUS_OK) {
        paper_bench_destroy(new);
        *bench = NULL;
    }
    return status;
}

static void write_csv_row(FILE *file, const paper_case *measured, const char *program, const paper_cell *cell)
{
    fprintf(file, "%s,%s,%s,%u,%u,%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",", measured->subject, measured->order, program,
            measured->width, measured->height, measured->triangles, measured->fragments, measured->deepest);
    fprintf(file, "%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%d,%d,%.3g,%" PRIu64 "\n",
            cell->iterations, cell->passes, cell->unsorted, cell->sorted, cell->fullscreen, cell->limit_reached,
            cell->exact, cell->max_abs, cell->samples_wrong);
}

static status replay_cell(paper_bench *bench, trace *trace, paper_program program, paper_case *measured)
{
    run_result *result = NULL;
    paper_cell *cell = &measured->cells[program];
    status status = trace_rewind(trace);
    if (status == STATUS_OK)
        status = replay_run(bench->programs[program], bench->machine, trace, &bench->run, &paper_errors, &result);
    if (status != STATUS_OK)
        return status;
    *cell = (paper_cell){.known = true,
                         .iterations = result->iterations,
                         .passes = result->geometry_passes,
                         .fullscreen = result->fullscreen_passes,
                         .unsorted = result->passes_by_class[CLASS_TRANSPARENT],
                         .sorted = result->passes_by_class[CLASS_SORTED],
                         .samples_wrong = result->error.samples_wrong,
                         .max_abs = result->error.max_abs,
                         .exact = result->error.exact,
                         .limit_reached = result->iteration_limit_reached};
    if (bench->out) {
        char path[2 * PAPER_PATH_SIZE], name[2 * PAPER_LABEL_SIZE];
        snprintf(name, sizeof name, "%s_%s", measured->subject, measured->order);
        snprintf(path, sizeof path, "%s/%s.%s.json", bench->out, name, paper_programs[program].name);
        status = result_write_json(result, bench->machine, name, path, &command_report);
        write_csv_row(bench->csv_file, measured, paper_programs[program].name, cell);
    }
    result_destroy(result);
    return status;
}

static status describe_trace(trace *trace, paper_case *measured)
{
    const trace_info *info = trace_get_info(trace);
    trace_summary summary;
    status status = trace_summarize(trace, &command_report, &summary);
    if (status != STATUS_OK)
        return status;
    measured->width = info->width;
    measured->height = info->height;
    measured->fragments = summary.fragments;
    measured->deepest = summary.deepest;
    if (summary.covered_samples > 0)
        measured->mean = (double)summary.fragments / (double)summary.covered_samples;
    for (uint32_t i = 0; i < info->draw_count; i++)
        measured->triangles += info->draws[i].triangles;
    return STATUS_OK;
}

status paper_measure(paper_bench *bench, const char *scene, const record_options *options, bool on_meshes,
                     const char *subject, const char *order, paper_case *measured)
{
    char what[3 * PAPER_LABEL_SIZE + NAME_SIZE];
    trace *trace = NULL;
    *measured = (paper_case){.order = order};
    snprintf(measured->subject, sizeof measured->subject, "%s", subject);
    snprintf(what, sizeof what, "%s, order %s: recording", subject, order);
    report_progress(&command_report, what, bench->done, bench->total);
    status status = paper_trace_record(bench->folder, scene, options, &trace);
    if (status == STATUS_OK)
        status = describe_trace(trace, measured);
    for (int i = 0; status == STATUS_OK && i < PAPER_PROGRAM_COUNT; i++, bench->done++) {
        snprintf(what, sizeof what, "%s, order %s: %s", subject, order, paper_programs[i].name);
        report_progress(&command_report, what, bench->done, bench->total);
        if (paper_programs[i].on_meshes || !on_meshes)
            status = replay_cell(bench, trace, (paper_program)i, measured);
    }
    report_progress(&command_report, "", bench->total, bench->total);  // takes the line away
    trace_close(trace);
    return status;
}

status paper_bench_finish(paper_bench *bench)
{
    if (!bench->csv)
        return STATUS_OK;
    aside *csv = bench->csv;
    bench->csv = NULL;
    return aside_finish(csv);
}

void paper_bench_destroy(paper_bench *bench)
{
    if (!bench)
        return;
    for (int i = 0; i < PAPER_PROGRAM_COUNT; i++)
        program_destroy(bench->programs[i]);
    if (bench->folder[0])
        rmdir(bench->folder);
    aside_discard(bench->csv);
    free(bench);
}
