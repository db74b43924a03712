// Program, machine, trace and a sample's position in; its history to a sink out, checked against the replay.
#include "history.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// What one call works on.
typedef struct request {
    const program *program;
    const machine *machine;
    trace *trace;
    uint32_t x, y, sample;
    const history_options *options;
    const report *report;
} request;

static status check_position(const request *r, const trace_info *info)
{
    if (r->x < info->width && r->y < info->height && r->sample < info->samples)
        return STATUS_OK;
    return report_error(
        r->report, STATUS_USAGE,
        "pixel %u, %u, sample %u is not in the trace: x is 0 to %u, y is 0 to %u, the sample is 0%s%.0u", r->x, r->y,
        r->sample, info->width - 1, info->height - 1, info->samples > 1 ? " to " : "", info->samples - 1);
}

static bool same_float(float a, float b)
{
    return a == b || (isnan(a) && isnan(b));
}

static status check_against_replay(const history *h, const report *report)
{
    const uint64_t sample = ((uint64_t)h->y * h->info->width + h->x) * h->info->samples + h->sample;
    for (int p = 0; p < h->program->plane_count; p++) {
        const size_t words = format_table[bound_plane_format(h->bound, p)].class == FORMAT_CLASS_COLOR ? 4 : 1;
        if (memcmp(h->planes[p], h->run->plane_values[p] + sample * words, words * sizeof(uint32_t)) != 0)
            return report_error(
                report, STATUS_REFUSED,
                "internal error: at pixel %u, %u, sample %u the history ends with another value of plane '%s' than "
                "the replay; please report program, trace and machine",
                h->x, h->y, h->sample, h->program->planes[p].name);
    }
    float rgb[3];
    value_output(h, rgb);
    for (uint64_t c = 0; c < 3; c++)
        if (!same_float(rgb[c], h->run->sample_rgb[3 * sample + c]))
            return report_error(
                report, STATUS_REFUSED,
                "internal error: at pixel %u, %u, sample %u the history ends with another colour than the replay; "
                "please report program, trace and machine",
                h->x, h->y, h->sample);
    return STATUS_OK;
}

static status check_shown(const history *h, const report *report)
{
    const history_options *options = h->options;
    if (h->shown || (!options->pass && !options->iteration))
        return STATUS_OK;
    char pass[64] = "", iteration[64] = "";
    if (options->pass)
        snprintf(pass, sizeof pass, "pass %" PRIu64, options->pass);
    if (options->iteration)
        snprintf(iteration, sizeof iteration, "%siteration %" PRIu64, options->pass ? " of " : "", options->iteration);
    return report_error(report, STATUS_REFUSED,
                        "there is no %s%s: the schedule ran %" PRIu64 " passes in %" PRIu64 " iterations", pass,
                        iteration, h->pass, h->run->iterations);
}

static status walk(const request *r, history *h, const sink *sink)
{
    status status = fragments_gather(r->trace, r->report, h);
    if (status != STATUS_OK)
        return status;
    if (!schedule_walk(h, sink))
        return report_error(r->report, STATUS_IO, "out of memory: list of %" PRIu64 " fragments", h->fragment_count);
    status = check_against_replay(h, r->report);
    return status == STATUS_OK ? check_shown(h, r->report) : status;
}

static status run_history(const request *r, const sink *sink)
{
    const trace_info *info = trace_get_info(r->trace);
    rop_limits limits;
    run_result *run = NULL;
    bound_program *bound = NULL;
    machine_limits(r->machine, &limits);
    status status = check_position(r, info);
    if (status != STATUS_OK)
        return status;
    run_options options = r->options->run;
    options.reference = false;
    options.keep_planes = options.log_conditions = true;
    status = replay_run(r->program, r->machine, r->trace, &options, r->report, &run);
    if (status == STATUS_OK)
        status = bind_program(r->program, &limits, info->reversed_depth, info->background, r->report, &bound);
    history *h = status == STATUS_OK ? calloc(1, sizeof *h) : NULL;
    if (status == STATUS_OK && !h)
        status = report_error(r->report, STATUS_IO, "out of memory");
    if (status == STATUS_OK) {
        *h = (history){.program = r->program,
                       .bound = bound,
                       .limits = &limits,
                       .info = info,
                       .options = r->options,
                       .run = run,
                       .machine = r->machine->name,
                       .x = r->x,
                       .y = r->y,
                       .sample = r->sample};
        status = walk(r, h, sink);
        free(h->fragments);
    }
    free(h);
    bound_destroy(bound);
    result_destroy(run);
    return status;
}

static status check_output(status result, const report *report, FILE *out)
{
    return result == STATUS_OK && ferror(out) ? report_error(report, STATUS_IO, "the history cannot be written")
                                              : result;
}

status history_print(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                     uint32_t sample, const history_options *options, const report *report, FILE *out)
{
    const request request = {program, machine, trace, x, y, sample, options, report};
    const sink sink = history_text_sink(out);
    return check_output(run_history(&request, &sink), report, out);
}

status history_print_json(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                          uint32_t sample, const history_options *options, const report *report, FILE *out)
{
    const request request = {program, machine, trace, x, y, sample, options, report};
    json_writer writer = {.out = out};
    const sink sink = history_json_sink(&writer);
    return check_output(run_history(&request, &sink), report, out);
}

// ---- One plane's value ---------------------------------------------------------------------------------

typedef struct capture {
    int plane;
    bool at_end;
    uint64_t captured;
    uint32_t *value;
} capture;

static void capture_pass(void *user, const history *h, const step *step)
{
    capture *capture = user;
    (void)step;
    if (!capture->at_end && !capture->captured++)
        memcpy(capture->value, h->planes[capture->plane], sizeof h->planes[0]);
}

static void capture_end(void *user, const history *h)
{
    capture *capture = user;
    if (capture->at_end)
        memcpy(capture->value, h->planes[capture->plane], sizeof h->planes[0]);
}

static int find_plane(const program *program, const char *name)
{
    for (int p = 0; p < program->plane_count; p++)
        if (strcmp(program->planes[p].name, name) == 0)
            return p;
    return -1;
}

status history_plane_value(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                           uint32_t sample, const char *plane, const history_options *options, const report *report,
                           uint32_t value[4])
{
    capture capture = {find_plane(program, plane), options->pass == 0, 0, value};
    memset(value, 0, 4 * sizeof *value);
    if (capture.plane < 0) {
        const char *names[PLANE_MAX];
        for (int p = 0; p < program->plane_count; p++)
            names[p] = program->planes[p].name;
        const char *meant = nearest_word(plane, names, (size_t)program->plane_count);
        return report_error(report, STATUS_REFUSED, "program '%s' has no plane '%s'%s%s%s", program->name, plane,
                            meant ? "; did you mean '" : "", meant ? meant : "", meant ? "'?" : "");
    }
    const request request = {program, machine, trace, x, y, sample, options, report};
    return run_history(&request, &(sink){.user = &capture, .pass_end = capture_pass, .end = capture_end});
}
