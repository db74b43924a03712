// `ropsim run`: replays a trace with a program on a machine; prints the counts, writes image and JSON.
#include "command.h"

#include <string.h>

enum {
    ROW_MACHINE,
    ROW_SET,
    ROW_DETAIL,
    ROW_THREADS,
    ROW_IMAGE,
    ROW_JSON,
    ROW_ITERATIONS,
    ROW_RATIO,
    ROW_NO_REFERENCE,
    ROW_MEMORY,
    ROW_VECTORS
};
static const command_option option_rows[] = {
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine; may be repeated"},
    [ROW_DETAIL] = {"detail", 0, "LEVEL", "function: counts and image; the one level of this version, and the default"},
    [ROW_THREADS] = {"threads", 0, "N", "threads over tiles; default 0: one a processor; results do not depend on it"},
    [ROW_IMAGE] = {"image", 0, "FILE", "write the image: .exr and .pfm linear float RGB, .png 8-bit sRGB"},
    [ROW_JSON] = {"json", 0, "FILE", "write the result as JSON"},
    [ROW_ITERATIONS] = {"max-iterations", 0, "N",
                        "of each repeat; default 0: the program's limit, else 2 x deepest sample + 16"},
    [ROW_RATIO] = {"occlusion-ratio", 0, "R",
                   "a repeat ends when a query counts at most R x samples; 0 to 1; default: the program's"},
    [ROW_NO_REFERENCE] = {"no-reference", 0, NULL, "do not compute the exact result and the error"},
    [ROW_MEMORY] = {"memory", 0, "MIB", "budget of the bins in MiB; default 4096; a trace that needs more goes in bands"},
    [ROW_VECTORS] = {"vector-bytes", 0, "N", "vectors of 16, 32 or 64 bytes; default 0: the widest; results do not depend on it"},
    {0},
};

typedef struct run_words {
    const char *program, *trace, *machine, *detail, *image, *json;
    run_options options;
} run_words;

// Takes one option; false after saying what is wrong with it.
static bool take_option(int option, const char *value, run_words *words)
{
    uint64_t number = 0;
    switch (option) {
    case ROW_MACHINE: words->machine = value; return true;
    case ROW_DETAIL: words->detail = value; return true;
    case ROW_IMAGE: words->image = value; return true;
    case ROW_JSON: words->json = value; return true;
    case ROW_NO_REFERENCE: words->options.reference = false; return true;
    case ROW_THREADS: return command_threads(value, &words->options.threads);
    case ROW_ITERATIONS: return command_uint("max-iterations", value, 0, UINT64_MAX, &words->options.max_iterations);
    case ROW_MEMORY: return command_memory(value, &words->options.memory_bytes);
    case ROW_VECTORS:
        if (!command_uint("vector-bytes", value, 0, 64, &number))
            return false;
        words->options.vector_bytes = (int)number;
        return true;
    case ROW_RATIO: return command_double("occlusion-ratio", value, 0, 1, &words->options.occlusion_ratio);
    default: return true;  // --set: taken when the machine is known
    }
}

static status run(const run_words *words, const machine *machine)
{
    trace *trace = NULL;
    run_result *result = NULL;
    status status = trace_open(words->trace, &command_report, &trace);
    if (status != STATUS_OK)
        return status;
    status = command_replay(words->program, machine, trace, &words->options, &result);
    trace_close(trace);
    if (status == STATUS_OK && result->iteration_limit_reached)
        report_warning(&command_report, "a repeat was stopped at the limit of iterations; the image is not finished");
    if (status == STATUS_OK && words->image)
        status = image_write_rgb(words->image, result->width, result->height, result->image, &command_report);
    if (status == STATUS_OK && words->json)
        status = result_write_json(result, words->trace, words->json, &command_report);
    if (status == STATUS_OK)
        status = result_print(result, stdout);
    result_destroy(result);
    return status;
}

int command_run(int argc, char **argv)
{
    run_words words = {.detail = "function", .options = {.occlusion_ratio = -1, .reference = true}};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND) {
            if (words.trace)
                return (int)command_usage("run", "one program and one trace at a time");
            *(words.program ? &words.trace : &words.program) = line.value;
        } else if (!take_option(option, line.value, &words)) {
            return STATUS_USAGE;
        }
    }
    if (!words.trace)
        return (int)command_usage("run", "a program and a trace are wanted");
    if (strcmp(words.detail, "function") != 0)
        return (int)report_error(&command_report, STATUS_USAGE,
                                 "--detail is `%s`, but this version has one level: function", words.detail);
    if (words.image && image_check_ending(words.image, &command_report) != STATUS_OK)
        return STATUS_USAGE;
    machine machine;
    status status = command_find_machine(words.machine, argc, argv, option_rows, ROW_SET, &machine);
    return status == STATUS_OK ? (int)run(&words, &machine) : (int)status;
}
