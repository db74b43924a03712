// `ropsim bench`: the replay of the ideal program against C written by hand over the same bins, in turns.
#include "command.h"

#include <stdlib.h>
#include <unistd.h>

enum { ROW_TURNS, ROW_VECTORS, TRACES_MAX = 16 };
static const command_option option_rows[] = {
    [ROW_TURNS] = {"turns", 0, "N", "how often the two take turns, 1 to 1000; the least time of each counts; default 5"},
    [ROW_VECTORS] = {"vector-bytes", 0, "N", "vectors of 16, 32 or 64 bytes; default 0: the widest that the processor has"},
    {0},
};

static void print_head(void)
{
    printf("ideal_coherent_layer_peel on one thread; visits are fragments times geometry passes\n\n");
    printf("%-28s %12s %12s %14s %14s %8s %8s\n", "trace", "fragments", "visits", "replay M/s", "native M/s", "ratio", "memory");
}

static status bench_trace(const char *path, const char *name, const program *program, const machine *machine,
                          const run_options *options, int turns)
{
    trace *trace;
    status status = trace_open(path, &command_report, &trace);
    if (status != STATUS_OK)
        return status;
    bench_result r;
    status = bench_run(program, machine, trace, options, turns, &command_report, &r);
    if (status == STATUS_OK)
        printf("%-28s %12llu %12llu %14.0f %14.0f %8.2f %8.2f\n", name,
               (unsigned long long)trace_get_info(trace)->fragment_count, (unsigned long long)r.replay_visits,
               1e-6 * (double)r.replay_visits / r.replay_seconds, 1e-6 * (double)r.native_visits / r.native_seconds,
               r.native_seconds / r.replay_seconds, r.read_seconds / r.replay_seconds);
    trace_close(trace);
    return status;
}

// The traces of the README's figures, recorded to a folder of their own and removed again.
static status bench_scenes(const program *program, const machine *machine, const run_options *options, int turns)
{
    static const char *const scenes[] = {"scene:slices_cone,slices=64", "scene:knot", "scene:soup,count=20000"};
    char folder[] = "/tmp/ropsim-bench-XXXXXX", path[64];
    if (!mkdtemp(folder))
        return report_error(&command_report, STATUS_IO, "%s: cannot be made", folder);
    snprintf(path, sizeof path, "%s/trace.ropt", folder);
    status status = STATUS_OK;
    for (size_t i = 0; status == STATUS_OK && i < sizeof scenes / sizeof *scenes; i++) {
        record_options record;
        record_defaults(&record);
        status = record_scenes(&scenes[i], 1, &record, path, &command_report);
        if (status == STATUS_OK)
            status = bench_trace(path, scenes[i], program, machine, options, turns);
    }
    unlink(path);
    rmdir(folder);
    return status;
}

static status bench(const char *const *traces, int trace_count, const run_options *options, int turns)
{
    char path[4096];
    program *program = NULL;
    machine machine;
    status status = machine_load(COMMAND_DEFAULT_MACHINE, &command_report, &machine);
    if (status == STATUS_OK)
        status = program_load("ideal_coherent_layer_peel", &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    print_head();
    if (trace_count == 0)
        status = bench_scenes(program, &machine, options, turns);
    for (int i = 0; status == STATUS_OK && i < trace_count; i++)
        status = bench_trace(traces[i], traces[i], program, &machine, options, turns);
    program_destroy(program);
    if (status == STATUS_OK)
        printf("\nratio: native time / replay time for the same image; memory: time to read the bins once / replay time.\n"
               "The native loop skips visits of tiles that have ended; the replay counts them without making them.\n");
    return status;
}

int command_bench(int argc, char **argv)
{
    const char *traces[TRACES_MAX];
    int trace_count = 0;
    uint64_t turns = 5, bytes = 0;
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == ROW_TURNS && !command_uint("turns", line.value, 1, 1000, &turns))
            return STATUS_USAGE;
        if (option == ROW_VECTORS && !command_uint("vector-bytes", line.value, 0, 64, &bytes))
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND && trace_count == TRACES_MAX)
            return (int)command_usage("bench", "too many traces");
        if (option == COMMAND_OPERAND)
            traces[trace_count++] = line.value;
    }
    const run_options options = {.vector_bytes = (int)bytes};
    return (int)bench(traces, trace_count, &options, (int)turns);
}
