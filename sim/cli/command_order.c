// `ropsim order`: layers of a trace's primitives, front to back, into a file; what it took to stdout and JSON.
#include "command.h"

enum { ROW_OUTPUT, ROW_JSON, ROW_BLOCKS, ROW_PRINTED, ROW_MACHINE, ROW_SET, ROW_THREADS, ROW_MEMORY };
static const command_option option_rows[] = {
    [ROW_OUTPUT] = {"output", 'o', "FILE",
                    "write a line for each primitive in order: its number and its layer, 0 the nearest"},
    [ROW_JSON] = {"json", 0, "FILE", "write counts, and who is cyclic or without a fragment, as JSON"},
    [ROW_BLOCKS] = {"blocks", 0, "N",
                    "read back and scan N x N pixels at a time, active ones only; default 64; 0: whole images"},
    [ROW_PRINTED] = {"printed", 0, NULL,
                     "the paper's own rule of what goes back; it can put a hidden primitive too early"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine, such as depth_format; may be repeated"},
    [ROW_THREADS] = {"threads", 0, "N", "threads over tiles; default 0: one a processor; results do not depend on it"},
    [ROW_MEMORY] = {"memory", 0, "MIB",
                    "budget in MiB of what is held in memory; default 4096; a trace that needs more is refused"},
    {0},
};

enum { BLOCK_DEFAULT = 64 };

typedef struct order_words {
    const char *trace, *output, *json, *machine;
    order_options options;
} order_words;

// Takes one option; false after saying what is wrong with it.
static bool take_option(int option, const char *value, order_words *words)
{
    uint64_t number = 0;
    switch (option) {
    case ROW_OUTPUT: words->output = value; return true;
    case ROW_JSON: words->json = value; return true;
    case ROW_MACHINE: words->machine = value; return true;
    case ROW_PRINTED: words->options.printed = true; return true;
    case ROW_BLOCKS:
        if (!command_uint("blocks", value, 0, TRACE_SIZE_MAX, &number))
            return false;
        words->options.block_pixels = (uint32_t)number;
        return true;
    case ROW_THREADS: return command_threads(value, &words->options.threads);
    case ROW_MEMORY: return command_memory(value, &words->options.memory_bytes);
    default: return true;  // --set: taken when the machine is known
    }
}

static void warn(const order_words *words, const order_result *result)
{
    const uint64_t cyclic = result->place_counts[PLACE_CYCLE], behind = result->place_counts[PLACE_BEHIND];
    if (cyclic)
        report_warning(&command_report, "%s: %llu primitives lie on cycles and %llu behind them: they have no layer%s",
                       words->trace, (unsigned long long)cyclic, (unsigned long long)behind,
                       words->json ? "" : "; --json names all");
    if (result->pairs_wrong)
        report_warning(&command_report, "%s: %llu neighbours are out of order by the trace's own depths%s",
                       words->trace, (unsigned long long)result->pairs_wrong,
                       result->printed ? ", as the printed rule allows"
                                       : ", which are equal in the machine's depth format");
}

static status run(const order_words *words, const machine *machine)
{
    trace *trace = NULL;
    order_result *result = NULL;
    status status = trace_open(words->trace, &command_report, &trace);
    if (status != STATUS_OK)
        return status;
    status = order_run(trace, machine, &words->options, &command_report, &result);
    trace_close(trace);
    if (status == STATUS_OK)
        status = order_write(result, words->output, &command_report);
    if (status == STATUS_OK && words->json)
        status = order_write_json(result, words->trace, words->json, &command_report);
    if (status == STATUS_OK) {
        warn(words, result);
        status = order_print(result, stdout);
    }
    order_destroy(result);
    return status;
}

int command_order(int argc, char **argv)
{
    order_words words = {.options = {.block_pixels = BLOCK_DEFAULT}};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND) {
            if (words.trace)
                return (int)command_usage("order", "one trace at a time");
            words.trace = line.value;
        } else if (!take_option(option, line.value, &words)) {
            return STATUS_USAGE;
        }
    }
    if (!words.trace)
        return (int)command_usage("order", "no trace was named");
    if (!words.output)
        return (int)command_usage("order", "give the file to write: -o FILE");
    machine machine;
    const status status = command_find_machine(words.machine, argc, argv, option_rows, ROW_SET, &machine);
    return status == STATUS_OK ? (int)run(&words, &machine) : (int)status;
}
