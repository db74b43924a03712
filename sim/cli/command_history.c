// `ropsim history`: what each pass did to one sample, fragment by fragment, as text or JSON.
#include "command.h"

enum {
    ROW_SAMPLE,
    ROW_JSON,
    ROW_OUTPUT,
    ROW_PASS,
    ROW_ITERATION,
    ROW_MACHINE,
    ROW_SET,
    ROW_ITERATIONS,
    ROW_RATIO,
    ROW_THREADS
};
static const command_option option_rows[] = {
    [ROW_SAMPLE] = {"sample", 0, "X,Y[,S]",
                    "the pixel, 0,0 is the top left one, and the sample in it; default sample 0"},
    [ROW_JSON] = {"json", 0, NULL, "print one JSON object instead of text"},
    [ROW_OUTPUT] = {"output", 'o', "FILE", "write to a file; default and -: standard output"},
    [ROW_PASS] = {"pass", 0, "N", "show pass N only, from 1; with --iteration, counted within it; default 0: all"},
    [ROW_ITERATION] = {"iteration", 0, "N", "show iteration N of the outermost repeats only, from 1; default 0: all"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine; may be repeated"},
    [ROW_ITERATIONS] = {"max-iterations", 0, "N",
                        "of each repeat; default 0: the program's limit, else 2 x deepest sample + 16"},
    [ROW_RATIO] = {"occlusion-ratio", 0, "R",
                   "a repeat ends when a query counts at most R x samples; 0 to 1; default: the program's"},
    [ROW_THREADS] = {"threads", 0, "N", "threads of the replay that settles the loops; default 0: one a processor"},
    {0},
};

typedef struct history_words {
    const char *program, *trace, *sample, *machine, *output;
    bool json;
    uint32_t place[3];  // x, y, sample
    history_options options;
} history_words;

// Reads X,Y or X,Y,S; false after saying what is accepted.
static bool take_sample(const char *text, uint32_t place[3])
{
    enum { LARGEST = 999999 };
    int part = 0, digits = 0;
    uint32_t number = 0;
    bool good = true;
    place[2] = 0;
    for (const char *at = text; good; at++) {
        if (*at >= '0' && *at <= '9') {
            number = 10 * number + (uint32_t)(*at - '0');
            good = ++digits > 0 && number <= LARGEST;
            continue;
        }
        good = digits > 0 && part < 3 && (*at == ',' || *at == 0);
        if (good)
            place[part++] = number;
        number = 0;
        digits = 0;
        if (*at == 0)
            break;
    }
    if (!good || part < 2)
        report_error(&command_report, STATUS_USAGE,
                     "--sample is `%s`, but must be X,Y or X,Y,S: a pixel and a sample of it, from 0", text);
    return good && part >= 2;
}

// Takes one option; false after saying what is wrong with it.
static bool take_option(int option, const char *value, history_words *words)
{
    run_options *run = &words->options.run;
    switch (option) {
    case ROW_SAMPLE: words->sample = value; return take_sample(value, words->place);
    case ROW_JSON: words->json = true; return true;
    case ROW_OUTPUT: words->output = value; return true;
    case ROW_PASS: return command_uint("pass", value, 0, UINT64_MAX, &words->options.pass);
    case ROW_ITERATION: return command_uint("iteration", value, 0, UINT64_MAX, &words->options.iteration);
    case ROW_MACHINE: words->machine = value; return true;
    case ROW_ITERATIONS: return command_uint("max-iterations", value, 0, UINT64_MAX, &run->max_iterations);
    case ROW_RATIO: return command_double("occlusion-ratio", value, 0, 1, &run->occlusion_ratio);
    case ROW_THREADS: return command_threads(value, &run->threads);
    default: return true;  // --set: taken when the machine is known
    }
}

static status print(const history_words *words, const program *program, const machine *machine, trace *trace, FILE *out)
{
    return (words->json ? history_print_json : history_print)(program, machine, trace, words->place[0], words->place[1],
                                                              words->place[2], &words->options, &command_report, out);
}

static status print_to(const history_words *words, const program *program, const machine *machine, trace *trace)
{
    if (!words->output || (words->output[0] == '-' && !words->output[1]))
        return print(words, program, machine, trace, stdout);
    aside *aside = NULL;
    FILE *file = NULL;
    status status = aside_open(words->output, &command_report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    status = print(words, program, machine, trace, file);
    if (status == STATUS_OK)
        return aside_finish(aside);
    aside_discard(aside);
    return status;
}

static status show_history(const history_words *words, const machine *machine)
{
    enum { PATH_SIZE = 4096 };
    char path[PATH_SIZE];
    program *program = NULL;
    trace *trace = NULL;
    rop_limits limits;
    status status = program_load(words->program, &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    machine_limits(machine, &limits);
    status = verify_program(program, path, &limits, &command_report);
    if (status == STATUS_OK)
        status = trace_open(words->trace, &command_report, &trace);
    if (status == STATUS_OK)
        status = print_to(words, program, machine, trace);
    trace_close(trace);
    program_destroy(program);
    return status;
}

int command_history(int argc, char **argv)
{
    history_words words = {.options.run.occlusion_ratio = -1};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND) {
            if (words.trace)
                return (int)command_usage("history", "one program and one trace at a time");
            *(words.program ? &words.trace : &words.program) = line.value;
        } else if (!take_option(option, line.value, &words)) {
            return STATUS_USAGE;
        }
    }
    if (!words.trace)
        return (int)command_usage("history", "a program and a trace are wanted");
    if (!words.sample)
        return (int)command_usage("history", "--sample X,Y[,S] is wanted: the pixel and the sample to tell of");
    words.options.trace_name = words.trace;
    machine machine;
    status status = command_find_machine(words.machine, argc, argv, option_rows, ROW_SET, &machine);
    return status == STATUS_OK ? (int)show_history(&words, &machine) : (int)status;
}
