// A program, a machine and a trace in, a run_result out: what a run needs is set up here, and freed again.
#include "run.h"

#include "foregone.h"
#include "stamps.h"
#include "write_log.h"

#include <stdlib.h>
#include <string.h>

static const uint64_t DEFAULT_MEMORY = 4ull << 30;
static const uint64_t IMAGE_MEMORY_FREE = 1ull << 28;  // an image may take this much, however small the budget of the bins is

static void set_limits(replay *r)
{
    const program *program = r->plan.program;
    const run_options *options = r->options;
    r->plan.max_iterations = options->max_iterations    ? options->max_iterations
                             : program->max_iterations ? program->max_iterations
                                                       : 2 * (uint64_t)r->counts.deepest + 16;
    const double ratio = options->occlusion_ratio >= 0 ? options->occlusion_ratio : program->occlusion_ratio;
    const double samples = (double)r->info->width * r->info->height * r->info->samples;
    r->plan.stop_after_pass = options->stop_after_pass;
    r->plan.threshold_while = (uint64_t)(ratio * samples);
    r->request = (bin_request){
        .depth_formats = bound_depth_formats(r->plan.bound) | list_depth_formats(program, r->plan.bound),
        .primitive = bound_reads(r->plan.bound, SOURCE_PRIMITIVE),
        .depth = options->reference,
        .draw = r->plan.has_batches,
        .memory_bytes = options->memory_bytes ? options->memory_bytes : DEFAULT_MEMORY,
    };
}

static status make_batches(replay *r, format depth_format)
{
    const program *program = r->plan.program;
    status status = STATUS_OK;
    for (int s = 0; status == STATUS_OK && s < program->step_count; s++)
        if (program->steps[s].kind == STEP_BATCHES)
            status = batches_make(r->info, r->counts.ranges, program->steps[s].entries, depth_format, r->report,
                                  &r->plan.batches[r->plan.batches_index[s]]);
    return status;
}

// What every image costs, however few fragments it has. A header is easily written; memory is not.
static status check_image(const replay *r)
{
    const uint64_t budget = r->options->memory_bytes ? r->options->memory_bytes : DEFAULT_MEMORY;
    const uint64_t pixels = (uint64_t)r->info->width * r->info->height, samples = pixels * r->info->samples;
    const uint64_t sample_bytes = 2 * sizeof(uint32_t) + 3 * sizeof(float), tile_bytes = sizeof(tile) + sizeof(error_sum) + sizeof(uint32_t);
    const uint64_t bytes = samples * sample_bytes + pixels * 3 * sizeof(float) + r->tiling.tile_count * tile_bytes;
    if (bytes <= budget || bytes <= IMAGE_MEMORY_FREE)
        return STATUS_OK;
    return report_error(r->report, STATUS_REFUSED, "an image of %u x %u pixels with %u samples takes %llu MiB; the budget is %llu MiB (--memory)",
                        r->info->width, r->info->height, r->info->samples, (unsigned long long)(bytes >> 20),
                        (unsigned long long)(budget >> 20));
}

// Batches of draws go by exact depths, which stamps do not have; lists take each sample's fragments from batch after batch.
static bool can_share(const replay *r, const program *program)
{
    return r->read && bins_can_share(r->read) && !r->plan.has_batches && !list_depth_formats(program, r->plan.bound);
}

static status log_writes(replay *r)
{
    enum { PART = 8 };  // of the budget: several times what deep scenes take
    const uint64_t budget = r->options->memory_bytes ? r->options->memory_bytes : DEFAULT_MEMORY;
    r->plan.writes = write_log_create(&r->bins, budget / PART);
    return r->plan.writes ? STATUS_OK : report_error(r->report, STATUS_IO, "out of memory: log of writes");
}

static status run_bound(replay *r, const program *program, const bound_program *bound, const machine *machine)
{
    status status = plan_make(&r->plan, program, bound, r->report);
    r->plan.depth_format = foregone_format(bound, machine->depth_format);
    if (status == STATUS_OK && !r->options->every_batch && !(r->plan.foregone = foregone_find(program, bound, r->plan.depth_format)))
        status = report_error(r->report, STATUS_IO, "out of memory: kernels");
    if (status == STATUS_OK && !(r->plan.execute = execute_select(r->options->vector_bytes)))
        status = report_error(r->report, STATUS_USAGE, "vectors of %d bytes: this processor or build has none", r->options->vector_bytes);
    if (status == STATUS_OK)
        status = check_image(r);
    if (status == STATUS_OK && can_share(r, program))
        status = bins_share(r->read, r->plan.depth_format, r->report, &r->counts, &r->bins);
    else if (status == STATUS_OK)
        status = bins_count(r->trace, &r->tiling, r->plan.has_batches, r->report, &r->counts);
    if (status == STATUS_OK)
        status = make_batches(r, machine->depth_format);
    if (status == STATUS_OK && r->bins.shared && r->options->log_conditions)
        status = log_writes(r);
    if (status != STATUS_OK)
        return status;
    set_limits(r);
    status = rounds_prepare(r);
    if (status == STATUS_OK)
        status = rounds_run(r);
    return status == STATUS_OK ? finish_run(r, machine) : status;
}

static void release(replay *r)
{
    for (int i = 0; r->workers && i < r->threads; i++)
        worker_destroy(r->workers[i]);
    free(r->workers);
    worker_destroy(r->empty_worker);
    global_destroy(r->global);
    for (int i = 0; i < BATCHES_MAX; i++)
        batches_free(&r->plan.batches[i]);
    free(r->plan.foregone);
    write_log_destroy(r->plan.writes);
    sample_counts_free(&r->counts);
    bins_free(&r->bins);
    free(r->tiles);
    free(r->order);
    free(r->errors);
    free(r->storage);
    free(r->empty_storage);
}

status replay_run(const program *program, const machine *machine, trace *trace, const run_options *options,
                  const report *report, run_result **result)
{
    return replay_run_on(program, machine, trace, NULL, options, report, result);
}

status replay_run_on(const program *program, const machine *machine, trace *trace, const stamps *read, const run_options *options,
                     const report *report, run_result **result)
{
    *result = NULL;
    rop_limits limits;
    machine_limits(machine, &limits);
    status status = verify_program(program, program->name, &limits, report);
    if (status != STATUS_OK)
        return status;
    const trace_info *info = trace_get_info(trace);
    bound_program *bound;
    status = bind_program(program, &limits, info->reversed_depth, info->background, report, &bound);
    if (status != STATUS_OK)
        return status;
    replay r = {.trace = trace, .info = info, .report = report, .options = options, .read = read};
    tiling_init(&r.tiling, info);
    r.result = calloc(1, sizeof *r.result);
    status = r.result ? run_bound(&r, program, bound, machine) : report_error(report, STATUS_IO, "out of memory");
    release(&r);
    bound_destroy(bound);
    if (status == STATUS_OK)
        *result = r.result;
    else
        result_destroy(r.result);
    return status;
}

void result_destroy(run_result *result)
{
    if (!result)
        return;
    free(result->image);
    free(result->sample_rgb);
    free(result->conditions);
    for (int i = 0; i < BATCHES_MAX; i++)
        batches_free(&result->batches[i]);
    write_log_destroy(result->writes);
    for (int i = 0; i < PLANE_MAX; i++)
        free(result->plane_values[i]);
    free(result);
}
