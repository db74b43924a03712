// One run after the other, each into a row. What a run read and computed before its deeper level stays for the next,
// which most often is the same trace and program on a machine that differs in keys of time alone.
//
// One trace is kept, its stamps and one result of the function level. What does not do for a run goes before its own is
// made, so that two of a kind never lie in memory.
#include "sweep.h"

#include <string.h>

static void drop_function(sweep_share *share)
{
    result_destroy(share->function);
    share->function = NULL;
}

static void drop_stamps(sweep_share *share)
{
    stamps_destroy(share->stamps);
    share->stamps = NULL;
}

void sweep_share_drop(sweep_share *share)
{
    drop_function(share);
    drop_stamps(share);
    trace_close(share->trace);
    share->trace = NULL;
}

// The file is compared when it is opened: the trace that is kept is the one that the sweep began with, whatever its
// file has become.
static status open_trace(sweep_share *share, const sweep_combination *run)
{
    if (share->trace && strcmp(trace_get_info(share->trace)->hash, run->trace->hash) == 0)
        return STATUS_OK;
    sweep_share_drop(share);
    const status status = trace_open(run->trace->path, &share->report, &share->trace);
    share->counts.opened += status == STATUS_OK;
    if (status != STATUS_OK || strcmp(trace_get_info(share->trace)->hash, run->trace->hash) == 0)
        return status;
    return report_error(&share->report, STATUS_REFUSED, "%s: is another trace than when the sweep began",
                        run->trace->path);
}

static status read_stamps(sweep_share *share, const sweep_combination *run, const detail_options *options)
{
    if (share->stamps)
        return STATUS_OK;
    share->counts.read++;
    return detail_read(run->program->program, &run->variant->machine, share->trace, options, &share->report,
                       &share->stamps);
}

// A deeper level wants planes and conditions of the function level, which by itself does without.
static bool function_fits(const sweep_share *share, const sweep_combination *run)
{
    const sweep_made *made = &share->made;
    return share->function && strcmp(made->program_hash, run->program->hash) == 0 &&
           made->max_iterations == run->max_iterations && made->deeper == (run->detail->level != DETAIL_FUNCTION) &&
           machine_same_limits(&made->machine, &run->variant->machine);
}

static status replay(sweep_share *share, const sweep *sweep, const sweep_combination *run)
{
    const machine *machine = &run->variant->machine;
    const bool deeper = run->detail->level != DETAIL_FUNCTION;
    const run_options options = {.threads = sweep->file.threads,
                                 .max_iterations = run->max_iterations,
                                 .occlusion_ratio = -1,
                                 .reference = true,
                                 .log_conditions = deeper,
                                 .keep_planes = deeper};
    share->counts.replayed++;
    share->made = (sweep_made){.max_iterations = run->max_iterations, .deeper = deeper, .machine = *machine};
    memcpy(share->made.program_hash, run->program->hash, sizeof share->made.program_hash);
    return replay_run_on(run->program->program, machine, share->trace, share->stamps, &options, &share->report,
                         &share->function);
}

// The result is that of every machine with these limits.
static void name_machine(run_result *result, const machine *machine)
{
    memcpy(result->machine, machine->name, sizeof result->machine);
    machine_hash(machine, result->machine_hash);
}

// At the levels that the combination asks for.
static status run_levels(sweep_share *share, const sweep *sweep, const sweep_combination *run, detail_result **detail)
{
    const program *program = run->program->program;
    const machine *machine = &run->variant->machine;
    const bool deeper = run->detail->level != DETAIL_FUNCTION;
    detail_options options = {.level = run->detail->level, .sampling = &run->detail->sampling};
    status status = STATUS_OK;
    if (!function_fits(share, run))
        drop_function(share);
    if (share->stamps && !(deeper && detail_fits(share->stamps, program, machine, share->trace, &options)))
        drop_stamps(share);
    if (deeper && detail_reads_first(machine, &options))
        status = read_stamps(share, run, &options);
    if (status == STATUS_OK && !share->function)
        status = replay(share, sweep, run);
    if (status == STATUS_OK && deeper)
        status = read_stamps(share, run, &options);
    if (status != STATUS_OK)
        return status;
    options.stamps = share->stamps;
    name_machine(share->function, machine);
    if (deeper)
        status = detail_run(program, machine, share->trace, share->function, &options, &share->report, detail);
    return status;
}

// A deeper level refuses a machine, or finds a mistake of its own; that is no property of the machine.
static sweep_outcome outcome_of(status status, const char *why)
{
    if (status == STATUS_OK)
        return OUTCOME_DONE;
    return status == STATUS_REFUSED && !strstr(why, "internal error: ") ? OUTCOME_REFUSED : OUTCOME_FAILED;
}

void sweep_share_run(sweep_share *share, const sweep *sweep, const sweep_combination *run, sweep_row *row)
{
    detail_result *detail = NULL;
    rop_limits limits;
    *row = (sweep_row){.outcome = OUTCOME_REFUSED};
    share->report = (report){.say = sweep_keep_reason, .user = row->why};
    machine_limits(&run->variant->machine, &limits);
    // A machine that contradicts itself is refused at every level, as it is by `ropsim run`.
    if (machine_check(&run->variant->machine, &share->report) != STATUS_OK ||
        verify_program(run->program->program, run->program->path, &limits, &share->report) != STATUS_OK)
        return;
    row->outcome = OUTCOME_FAILED;
    if (open_trace(share, run) == STATUS_OK)
        row->outcome = outcome_of(run_levels(share, sweep, run, &detail), row->why);
    if (row->outcome == OUTCOME_DONE)
        sweep_row_fill(row, share->function, detail);
    if (row->outcome == OUTCOME_FAILED)  // the next run starts from nothing
        sweep_share_drop(share);
    detail_destroy(detail);
}
