// `ropsim run`: replays a trace with a program on a machine; prints the counts, writes image and JSON; at deeper levels
// of detail also what it costs in bytes and in cycles.
//
// The function level always runs first: it makes the image and settles how often loops run; deeper levels take nothing
// of theirs back to it.
#include "sampling_words.h"

#include <limits.h>
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
    ROW_VECTORS,
    ROW_CSV,
    ROW_TIMELINE,
    ROW_REQUESTS,
    ROW_REQUESTS_FORMAT,
    ROW_REQUESTS_CHANNEL,
    ROW_SAMPLE_EVERY,
    ROW_SAMPLE_WINDOW,
    ROW_SEED
};
static const command_option option_rows[] = {
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine; may be repeated"},
    [ROW_DETAIL] = {"detail", 0, "LEVEL",
                    "function: counts and image, the default; traffic: also caches and bytes; cycle: also time; sampled: estimates of both"},
    [ROW_THREADS] = {"threads", 0, "N", "threads over tiles; default 0: one a processor; results do not depend on it"},
    [ROW_IMAGE] = {"image", 0, "FILE", "write the image: .exr and .pfm linear float RGB, .png 8-bit sRGB"},
    [ROW_JSON] = {"json", 0, "FILE", "write the result as JSON"},
    [ROW_ITERATIONS] = {"max-iterations", 0, "N",
                        "of each repeat; default 0: the program's limit, else 2 x deepest sample + 16"},
    [ROW_RATIO] = {"occlusion-ratio", 0, "R",
                   "a repeat ends when a query counts at most R x samples; 0 to 1; default: the program's"},
    [ROW_NO_REFERENCE] = {"no-reference", 0, NULL, "do not compute the exact result and the error"},
    [ROW_MEMORY] = {"memory", 0, "MIB",
                    "budget of fragments in memory in MiB; default 4096; a trace that needs more goes in bands"},
    [ROW_VECTORS] = {"vector-bytes", 0, "N",
                     "vectors of 16, 32 or 64 bytes; default 0: the widest; results do not depend on it"},
    [ROW_CSV] = {"csv", 0, "FILE", "from traffic on: write statistics in total and by pass, draw and iteration as CSV"},
    [ROW_TIMELINE] = {"timeline", 0, "FILE", "cycle: write a timeline that Perfetto and chrome://tracing open"},
    [ROW_REQUESTS] = {"requests", 0, "FILE", "cycle: write each request to memory as it is issued"},
    [ROW_REQUESTS_FORMAT] = {"requests-format", 0, "FORMAT",
                             "of --requests: dramsim3, ramulator, ramulator2 or csv; default csv"},
    [ROW_REQUESTS_CHANNEL] = {"requests-channel", 0, "N", "of --requests: only those of channel N, from 0; default: of all channels"},
    [ROW_SAMPLE_EVERY] = SAMPLE_EVERY_ROW,
    [ROW_SAMPLE_WINDOW] = SAMPLE_WINDOW_ROW,
    [ROW_SEED] = SEED_ROW,
    {0},
};

typedef struct run_words {
    const char *program, *trace, *machine, *detail, *image, *json, *csv, *timeline, *requests, *requests_format;
    bool one_channel;
    int channel;
    detail_level level;
    run_options options;
    sampling_words sampling;
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
    case ROW_CSV: words->csv = value; return true;
    case ROW_TIMELINE: words->timeline = value; return true;
    case ROW_REQUESTS: words->requests = value; return true;
    case ROW_REQUESTS_FORMAT: words->requests_format = value; return true;
    case ROW_REQUESTS_CHANNEL:
        words->one_channel = command_uint("requests-channel", value, 0, INT_MAX, &number);
        words->channel = (int)number;
        return words->one_channel;
    case ROW_NO_REFERENCE: words->options.reference = false; return true;
    case ROW_THREADS: return command_threads(value, &words->options.threads);
    case ROW_ITERATIONS: return command_uint("max-iterations", value, 0, UINT64_MAX, &words->options.max_iterations);
    case ROW_MEMORY: return command_memory(value, &words->options.memory_bytes);
    case ROW_VECTORS:
        if (!command_uint("vector-bytes", value, 0, 64, &number))
            return false;
        words->options.vector_bytes = (int)number;
        return true;
    case ROW_SAMPLE_EVERY:
    case ROW_SAMPLE_WINDOW:
    case ROW_SEED: return sampling_words_take(option_rows[option].name, value, &words->sampling);
    case ROW_RATIO: return command_double("occlusion-ratio", value, 0, 1, &words->options.occlusion_ratio);
    default: return true;  // --set: taken when the machine is known
    }
}

// The index of `word` in a list of words; -1 after saying which there are.
static int find_choice(const char *option, const char *word, const char *const *choices, int count)
{
    char list[NAME_SIZE * 2] = "";
    for (int i = 0; i < count; i++) {
        const size_t length = strlen(list);
        if (strcmp(word, choices[i]) == 0)
            return i;
        snprintf(list + length, sizeof list - length, "%s%s", i == 0 ? "" : i + 1 < count ? ", " : " or ", choices[i]);
    }
    report_error(&command_report, STATUS_USAGE, "--%s is `%s`, but must be %s", option, word, list);
    return -1;
}

static bool refuse(const char *why)
{
    command_usage("run", why);
    return false;
}

// What is asked for and what the level gives; false after saying what does not go together.
static bool check_words(run_words *words)
{
    const int level = find_choice("detail", words->detail, detail_level_names, DETAIL_COUNT);
    if (level < 0)
        return false;
    words->level = (detail_level)level;
    if (words->sampling.given && words->level != DETAIL_SAMPLED)
        return refuse("--sample-every, --sample-window and --seed want --detail sampled");
    if (words->csv && words->level == DETAIL_FUNCTION)
        return refuse("--csv wants --detail traffic, cycle or sampled");
    if (words->timeline && words->level != DETAIL_CYCLE)
        return refuse("--timeline wants --detail cycle");
    if (words->requests && words->level != DETAIL_CYCLE)
        return refuse("--requests wants --detail cycle");
    if (words->one_channel && !words->requests)
        return refuse("--requests-channel wants --requests FILE");
    if (words->requests_format && !words->requests)
        return refuse("--requests-format wants --requests FILE");
    if (!words->requests_format)
        words->requests_format = "csv";
    if (find_choice("requests-format", words->requests_format, request_formats, REQUEST_FORMATS) < 0)
        return false;
    return !words->image || image_check_ending(words->image, &command_report) == STATUS_OK;
}

static status run_detail(const run_words *words, const program *program, const machine *machine, trace *trace,
                         const run_result *function, const detail_options *without_files, detail_result **detail)
{
    timeline *timeline = NULL;
    status status = STATUS_OK;
    if (words->timeline)
        status = timeline_open(words->timeline, machine, &command_report, &timeline);
    if (status != STATUS_OK)
        return status;
    const clock_config files = {
        .requests_path = words->requests,
        .requests_format = words->requests ? words->requests_format : NULL,
        .requests_channel = words->one_channel ? &words->channel : NULL,
        .timeline = timeline,
    };
    detail_options options = *without_files;
    options.clock = &files;
    status = detail_run(program, machine, trace, function, &options, &command_report, detail);
    if (status != STATUS_OK)
        timeline_discard(timeline);
    else if (timeline)
        status = timeline_finish(timeline);
    return status;
}

static status write_results(const run_words *words, const machine *machine, const run_result *result,
                            const detail_result *detail)
{
    status status = STATUS_OK;
    if (words->image)
        status = image_write_rgb(words->image, result->width, result->height, result->image, &command_report);
    if (status == STATUS_OK && words->json && detail)
        status = detail_write_json(result, detail, words->trace, words->json, &command_report);
    else if (status == STATUS_OK && words->json)
        status = result_write_json(result, machine, words->trace, words->json, &command_report);
    if (status == STATUS_OK && words->csv)
        status = detail_write_csv(detail, words->csv, &command_report);
    if (status == STATUS_OK)
        status = result_print(result, stdout);
    if (status == STATUS_OK && detail)
        status = detail_print(detail, stdout);
    return status;
}

static status run(const run_words *words, const machine *machine)
{
    program *program = NULL;
    trace *trace = NULL;
    run_result *result = NULL;
    detail_result *detail = NULL;
    run_options options = words->options;
    options.keep_planes = options.log_conditions = words->level != DETAIL_FUNCTION;
    const sampling sampling = sampling_words_get(&words->sampling);
    detail_options detail_options = {.level = words->level, .sampling = &sampling, .memory_bytes = options.memory_bytes};
    status status = trace_open(words->trace, &command_report, &trace);
    if (status == STATUS_OK)
        status = command_load_program(words->program, machine, &program);
    if (status == STATUS_OK && detail_reads_first(machine, &detail_options))
        status = detail_read(program, machine, trace, &detail_options, &command_report, &detail_options.stamps);
    if (status == STATUS_OK)
        status = replay_run_on(program, machine, trace, detail_options.stamps, &options, &command_report, &result);
    if (status == STATUS_OK && result->iteration_limit_reached)
        report_warning(&command_report, "a repeat was stopped at the limit of iterations; the image is not finished");
    if (status == STATUS_OK && words->level != DETAIL_FUNCTION)
        status = run_detail(words, program, machine, trace, result, &detail_options, &detail);
    if (status == STATUS_OK)
        status = write_results(words, machine, result, detail);
    detail_destroy(detail);
    result_destroy(result);
    stamps_destroy(detail_options.stamps);
    program_destroy(program);
    trace_close(trace);
    return status;
}

int command_run(int argc, char **argv)
{
    run_words words = {.detail = "function", .options = {.occlusion_ratio = -1, .reference = true}, .sampling = sampling_words_default()};
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
    if (!check_words(&words))
        return STATUS_USAGE;
    machine machine;
    status status = command_find_machine(words.machine, argc, argv, option_rows, ROW_SET, &machine);
    return status == STATUS_OK ? (int)run(&words, &machine) : (int)status;
}
