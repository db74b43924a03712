// `ropsim demo`: scenes to traces, traces through the peeling programs, and the table that compares them.
//
// All programs run on one machine, so that their formats are the same and the bytes compare; whether the
// fixed-function card takes a program at all is a column of its own.
#include "command.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <sys/stat.h>

enum { PATH_SIZE = 4096, SCENES_MAX = 32, LABEL_SIZE = 48, DEMO_SIZE_MAX = 8192 };
static const char *const demo_programs[] = {"layer_peel", "coherent_layer_peel_a", "ideal_coherent_layer_peel"};
enum { DEMO_PROGRAM_COUNT = sizeof demo_programs / sizeof *demo_programs };

enum { ROW_OUT, ROW_SIZE, ROW_SAMPLES, ROW_THREADS, ROW_MACHINE, ROW_SET };
static const command_option option_rows[] = {
    [ROW_OUT] = {"out", 'o', "FOLDER", "where traces, pictures and JSON go; default out"},
    [ROW_SIZE] = {"size", 0, "N", "width and height in pixels; default 512"},
    [ROW_SAMPLES] = {"samples", 0, "N", "samples a pixel: 1, 2, 4 or 8; default 1"},
    [ROW_THREADS] = {"threads", 0, "N", "threads of the replay; default 0: one a processor"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine; may be repeated"},
    {0},
};

typedef struct demo {
    const char *scenes[SCENES_MAX];
    int scene_count;
    const char *out, *machine_name;
    record_options record;
    run_options run;
    machine machine;
} demo;

// "models/bunny.obj" to "bunny", "scene:slices_cone,slices=64" to "slices_cone_slices_64".
static void label_scene(const char *scene, char label[LABEL_SIZE])
{
    const char *slash = strrchr(scene, '/');
    const char *from = slash ? slash + 1 : strncmp(scene, "scene:", 6) == 0 ? scene + 6 : scene;
    snprintf(label, LABEL_SIZE, "%s", from);
    char *dot = slash ? strrchr(label, '.') : NULL;
    if (dot && dot != label)
        *dot = 0;
    for (char *at = label; *at; at++) {
        if (!isalnum((unsigned char)*at))
            *at = '_';
    }
}

static uint64_t plane_bytes(const run_result *result)
{
    uint64_t bytes = 0;
    for (int i = 0; i < result->plane_count; i++)
        bytes += result->planes[i].bytes_read + result->planes[i].bytes_written + result->planes[i].texture_bytes_read;
    return bytes;
}

// Whether the fixed-function card would take the program, whatever machine the demo runs on.
static bool runs_on_card(const char *name)
{
    char path[PATH_SIZE];
    program *program = NULL;
    machine card;
    rop_limits limits;
    if (machine_load("g80", NULL, &card) != STATUS_OK ||
        program_load(name, NULL, path, sizeof path, &program) != STATUS_OK)
        return false;
    machine_limits(&card, &limits);
    bool runs = verify_program(program, path, &limits, NULL) == STATUS_OK;
    program_destroy(program);
    return runs;
}

static void print_row(const char *name, const run_result *result)
{
    printf("| %-25s | %-11s | %15" PRIu64 " | %18" PRIu64 " | %9.1f | %13.2g | %-5s | %7.1f |\n", name,
           runs_on_card(name) ? "yes" : "no", result->geometry_passes, result->fragments_replayed,
           (double)plane_bytes(result) / 1e6, result->error.max_abs, result->error.exact ? "yes" : "no",
           result->fragments_per_second / 1e6);
    fflush(stdout);
}

static void print_heading(const char *scene, const trace_info *info)
{
    printf("%s: %" PRIu64 " fragments, %u x %u pixels, %u %s a pixel\n\n", scene, info->fragment_count, info->width,
           info->height, info->samples, info->samples == 1 ? "sample" : "samples");
    // A Markdown table: it can be pasted into a page.
    puts("| program                   | runs on g80 | geometry passes | fragments replayed |  plane MB | largest error "
         "| exact | Mfrag/s |\n"
         "|---------------------------|-------------|----------------:|-------------------:|----------:|--------------:"
         "|-------|--------:|");
}

static status run_program(const demo *demo, const char *name, const char *label, const char *trace_path, trace *trace)
{
    run_result *result = NULL;
    char path[PATH_SIZE];
    status status = trace_rewind(trace);
    if (status == STATUS_OK)
        status = command_replay(name, &demo->machine, trace, &demo->run, &result);
    if (status != STATUS_OK)
        return status;
    snprintf(path, sizeof path, "%s/%s.%s.png", demo->out, label, name);
    status = image_write_rgb(path, result->width, result->height, result->image, &command_report);
    snprintf(path, sizeof path, "%s/%s.%s.json", demo->out, label, name);
    if (status == STATUS_OK)
        status = result_write_json(result, &demo->machine, trace_path, path, &command_report);
    if (status == STATUS_OK)
        print_row(name, result);
    result_destroy(result);
    return status;
}

static status run_scene(const demo *demo, const char *scene)
{
    char label[LABEL_SIZE], trace_path[PATH_SIZE];
    trace *trace = NULL;
    label_scene(scene, label);
    snprintf(trace_path, sizeof trace_path, "%s/%s.ropt", demo->out, label);
    status status = record_scenes(&scene, 1, &demo->record, trace_path, &command_report);
    if (status == STATUS_OK)
        status = trace_open(trace_path, &command_report, &trace);
    if (status != STATUS_OK)
        return status;
    print_heading(scene, trace_get_info(trace));
    for (int i = 0; status == STATUS_OK && i < DEMO_PROGRAM_COUNT; i++)
        status = run_program(demo, demo_programs[i], label, trace_path, trace);
    trace_close(trace);
    if (status == STATUS_OK)
        printf("\npictures: %s/%s.PROGRAM.png   results: %s/%s.PROGRAM.json   trace: %s\n\n", demo->out, label,
               demo->out, label, trace_path);
    return status;
}

// Takes one word; false after saying what is wrong with it.
static bool take_word(int option, const char *value, demo *demo)
{
    uint64_t number = 0;
    switch (option) {
    case ROW_OUT: demo->out = value; return true;
    case ROW_MACHINE: demo->machine_name = value; return true;
    case ROW_SIZE:
        if (!command_uint("size", value, 1, DEMO_SIZE_MAX, &number))
            return false;
        demo->record.width = demo->record.height = (uint32_t)number;
        return true;
    case ROW_SAMPLES:
        if (!command_uint("samples", value, 1, 8, &number))
            return false;
        demo->record.samples = (uint32_t)number;
        return true;
    case ROW_THREADS: return command_threads(value, &demo->run.threads);
    case COMMAND_OPERAND:
        if (demo->scene_count == SCENES_MAX) {
            report_error(&command_report, STATUS_USAGE, "at most %d scenes at a time", SCENES_MAX);
            return false;
        }
        demo->scenes[demo->scene_count++] = value;
        return true;
    default: return true;  // --set: taken when the machine is known
    }
}

int command_demo(int argc, char **argv)
{
    demo demo = {.out = "out", .run = {.occlusion_ratio = -1, .reference = true}};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    record_defaults(&demo.record);
    demo.record.width = demo.record.height = 512;
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR || !take_word(option, line.value, &demo))
            return STATUS_USAGE;
    }
    if (demo.scene_count == 0)
        demo.scenes[demo.scene_count++] = "scene:knot";
    status status = command_find_machine(demo.machine_name, argc, argv, option_rows, ROW_SET, &demo.machine);
    if (status != STATUS_OK)
        return (int)status;
    if (mkdir(demo.out, 0777) != 0 && errno != EEXIST)
        return (int)report_error(&command_report, STATUS_IO, "%s: cannot be made: %s", demo.out, strerror(errno));
    for (int i = 0; status == STATUS_OK && i < demo.scene_count; i++)
        status = run_scene(&demo, demo.scenes[i]);
    return (int)status;
}
