// The cases of one test file in, an outcome for each of their programs out.
//
// A program is replayed once for each moment that its expectations look at. What a failed expectation of figures saw is
// kept for --bless.
#include "rtest.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct runner {
    const rtest_file *file;
    const rtest_case *test;
    rtest_result *result;
    rtest_trace trace;
    rtest_messages messages;
    rtest_scene scene;  // the run that is judged
    status trace_status;
    FILE *out;  // failures of the program that runs
    bool sample_shown;
    bool no_memory;
} runner;

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void print_messages(const runner *r)
{
    for (const char *line = r->messages.text; *line; line += strcspn(line, "\n") + (line[strcspn(line, "\n")] == '\n'))
        fprintf(r->out, "      %.*s\n", (int)strcspn(line, "\n"), line);
}

static void print_question(const runner *r, int line)
{
    fprintf(r->out, "    %s:%d: ", r->file->text.path, line);
    rtest_print_line(&r->file->text, line, r->out);
    fputc('\n', r->out);
}

static const expectation *expectations_of(const runner *r)
{
    return r->file->expectations + r->test->first_expectation;
}

// ---- Messages ------------------------------------------------------------------------------------------

static bool expects_refusal(const runner *r)
{
    for (int i = 0; i < r->test->expectation_count; i++)
        if (expectations_of(r)[i].kind == EXPECT_error)
            return true;
    return false;
}

static void check_messages(const runner *r, expect_kind kind, bool said)
{
    for (int i = 0; i < r->test->expectation_count; i++) {
        const expectation *e = &expectations_of(r)[i];
        if (e->kind != kind || (said && strstr(r->messages.text, e->text)))
            continue;
        print_question(r, e->line);
        if (said || r->messages.text[0])
            fputs("      said instead:\n", r->out);
        else
            fputs(kind == EXPECT_error ? "      nothing was refused\n" : "      nothing was said\n", r->out);
        print_messages(r);
    }
}

// ---- Figures -------------------------------------------------------------------------------------------

static void keep_blessing(runner *r, const expectation *e, const rtest_seen *seen)
{
    for (int i = 0; i < seen->count; i++) {
        rtest_blessing *blessing = NULL;
        for (int k = 0; k < r->result->blessing_count; k++)
            if (r->result->blessings[k].word.at == e->figures[i].at)
                blessing = &r->result->blessings[k];
        if (blessing) {
            blessing->contradicted |= strcmp(blessing->seen, seen->words[i]) != 0;
            blessing->failed |= !seen->passed;
            continue;
        }
        blessing = rtest_add(&r->result->blessings, &r->result->blessing_count, sizeof *blessing);
        if (!blessing) {
            r->no_memory = true;
            return;
        }
        blessing->word = e->figures[i];
        memcpy(blessing->seen, seen->words[i], sizeof blessing->seen);
        blessing->failed = !seen->passed;
        blessing->rounded = expect_rows[e->kind].form == FORM_VALUES;
    }
}

static void check_expectation(runner *r, const expectation *e, const run_result *run)
{
    rtest_seen seen;
    rtest_check(e, run, trace_get_info(r->trace.trace)->reversed_depth, &seen);
    const bool is_golden = e->relation == RELATION_EQUAL && expect_rows[e->kind].form != FORM_FLAG && !seen.problem[0];
    if (is_golden)
        keep_blessing(r, e, &seen);
    if (seen.passed)
        return;
    print_question(r, e->line);
    if (seen.problem[0])
        fprintf(r->out, "      %s\n", seen.problem);
    else {
        fputs("      seen", r->out);
        for (int i = 0; i < seen.count; i++)
            fprintf(r->out, " %s", seen.words[i]);
        fputc('\n', r->out);
    }
    if (seen.looks_at_sample && !r->sample_shown) {
        rtest_print_sample(&r->scene, e, r->out);
        r->sample_shown = true;  // once a program is enough
    }
}

static run_options options_at(const runner *r, moment moment)
{
    const rtest_settings *settings = &r->test->settings;
    run_options options = {
        .threads = settings->threads ? (int)settings->threads : 1,
        .vector_bytes = (int)settings->vector_bytes,
        .max_iterations = settings->max_iterations,
        .occlusion_ratio = settings->occlusion_ratio,
        .reference = true,
        .keep_planes = true,
    };
    if (moment.kind == MOMENT_PASS)
        options.stop_after_pass = moment.number;
    if (moment.kind == MOMENT_ITERATION && (!options.max_iterations || moment.number < options.max_iterations))
        options.max_iterations = moment.number;
    return options;
}

static bool same_moment(moment a, moment b)
{
    return a.kind == b.kind && a.number == b.number;
}

static void check_moment(runner *r, int first, const run_result *run)
{
    const moment moment = expectations_of(r)[first].moment;
    const uint64_t made = moment.kind == MOMENT_PASS ? run->geometry_passes + run->fullscreen_passes : run->iterations;
    if (moment.kind != MOMENT_END && made < moment.number) {
        print_question(r, expectations_of(r)[first].line);
        fprintf(r->out, "      the run has only %" PRIu64 " %s\n", made,
                moment.kind == MOMENT_PASS ? "passes" : "iterations");
        return;
    }
    for (int i = first; i < r->test->expectation_count; i++) {
        const expectation *e = &expectations_of(r)[i];
        if (same_moment(e->moment, moment) && expect_rows[e->kind].form != FORM_TEXT)
            check_expectation(r, e, run);
    }
}

// ---- Programs ------------------------------------------------------------------------------------------

static status make_machine(runner *r, machine *machine)
{
    const rtest_settings *settings = &r->test->settings;
    const char *name = settings->machine ? settings->machine : "tiny";
    char path[RTEST_PATH_SIZE];
    const size_t length = strlen(name);
    const bool is_path = strchr(name, '/') || (length > 5 && strcmp(name + length - 5, ".yaml") == 0);
    status status = STATUS_OK;
    if (is_path)
        status = rtest_beside(r->file->text.path, name, &r->messages.report, path, sizeof path);
    if (status == STATUS_OK)
        status = machine_load(is_path && strchr(path, '/') ? path : name, &r->messages.report, machine);
    for (int i = 0; status == STATUS_OK && i < settings->set_count; i++)
        status = machine_set(machine, settings->set[i], &r->messages.report);
    return status;
}

static status replay_moments(runner *r, const program *program, const machine *machine)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < r->test->expectation_count; i++) {
        const moment moment = expectations_of(r)[i].moment;
        bool done = false;
        for (int k = 0; k < i; k++)
            done |= same_moment(expectations_of(r)[k].moment, moment);
        if (done)
            continue;
        run_result *run = NULL;
        r->scene = (rtest_scene){program, machine, r->trace.trace, options_at(r, moment)};
        status = replay_run(program, machine, r->trace.trace, &r->scene.options, &r->messages.report, &run);
        if (status == STATUS_OK)
            check_moment(r, i, run);
        result_destroy(run);
    }
    return status;
}

static status run_program(runner *r, const rtest_source *source)
{
    program *program = NULL;
    machine machine = {0};
    rop_limits limits;
    char path[RTEST_PATH_SIZE];
    status status = rtest_program_load(r->file, r->test, source, &r->messages, path, &program);
    if (status == STATUS_OK)
        status = make_machine(r, &machine);
    if (status == STATUS_OK) {
        machine_limits(&machine, &limits);
        status = verify_program(program, path, &limits, &r->messages.report);
    }
    if (status == STATUS_OK)
        status = replay_moments(r, program, &machine);
    program_destroy(program);
    return status;
}

// Judges a program, or the trace alone where `source` is NULL.
static void run_outcome(runner *r, const rtest_source *source)
{
    status status = r->trace_status;
    if (source && status == STATUS_OK)
        status = run_program(r, source);
    const bool refusal = expects_refusal(r);
    if (refusal)
        check_messages(r, EXPECT_error, status != STATUS_OK);
    else if (status != STATUS_OK) {
        fprintf(r->out, "    %s:%d: refused:\n", r->file->text.path, r->test->line);
        print_messages(r);
    }
    if (!refusal && status == STATUS_OK)
        check_messages(r, EXPECT_warning, r->messages.warned);
}

static char *name_of(const runner *r, const rtest_source *source)
{
    char name[NAME_SIZE * 4];
    const rtest_settings *settings = &r->test->settings;
    size_t length = (size_t)snprintf(name, sizeof name, "%.80s",
                                     !source        ? "trace"
                                     : source->name ? source->name
                                                    : "program");
    if (settings->machine && source)
        length += (size_t)snprintf(name + length, sizeof name - length, " on %.60s", settings->machine);
    for (int i = 0; source && i < settings->set_count && length < sizeof name - 64; i++)
        length += (size_t)snprintf(name + length, sizeof name - length, " %.50s", settings->set[i]);
    return strdup(name);
}

static status add_outcome(runner *r, const rtest_source *source)
{
    rtest_outcome *outcome = rtest_add(&r->result->outcomes, &r->result->outcome_count, sizeof *outcome);
    size_t size;
    if (!outcome)
        return STATUS_IO;
    outcome->line = r->test->line;
    outcome->expectation_count = r->test->expectation_count;
    outcome->name = name_of(r, source);
    r->out = open_memstream(&outcome->failures, &size);
    if (!r->out || !outcome->name)
        return STATUS_IO;
    const double start = now();
    if (r->trace_status == STATUS_OK) {
        r->messages.text[0] = 0;
        r->messages.warned = false;
    }
    r->sample_shown = false;
    run_outcome(r, source);
    fclose(r->out);
    outcome->seconds = now() - start;
    return r->no_memory || !outcome->failures ? STATUS_IO : STATUS_OK;
}

status rtest_run_file(const rtest_file *file, rtest_result *result)
{
    runner r = {.file = file, .result = result};
    status status = STATUS_OK;
    int opened = -1;
    for (int i = 0; status == STATUS_OK && i < file->case_count; i++) {
        r.test = &file->cases[i];
        if (r.test->trace != opened) {
            rtest_trace_close(&r.trace);
            opened = r.test->trace;
            rtest_messages_start(&r.messages, file->text.path);
            r.trace_status = rtest_trace_open(file, &file->traces[opened], &r.messages, &r.trace);
        }
        if (r.test->program_count == 0)
            status = add_outcome(&r, NULL);
        for (int p = 0; status == STATUS_OK && p < r.test->program_count; p++)
            status = add_outcome(&r, &r.test->programs[p]);
    }
    rtest_trace_close(&r.trace);
    return status;
}

void rtest_result_free(rtest_result *result)
{
    for (int i = 0; i < result->outcome_count; i++) {
        free(result->outcomes[i].name);
        free(result->outcomes[i].failures);
    }
    free(result->outcomes);
    free(result->blessings);
    free(result->refused);
}
