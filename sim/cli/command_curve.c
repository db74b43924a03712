// `ropsim curve`: what programs take in passes against what they keep in bits a sample, trace by trace.
#include "command.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { ROW_OUT, ROW_CSV, ROW_PROGRAM, ROW_SIZE, ROW_THREADS, ROW_MACHINE, ROW_SET };
static const command_option option_rows[] = {
    [ROW_OUT] = {"out", 'o', "FILE.svg", "draw the plot"},
    [ROW_CSV] = {"csv", 0, "FILE", "write a line a point"},
    [ROW_PROGRAM] = {"program", 0, "PROGRAM[,PARAMETER=INTEGER]...",
                     "measure this one in place of the list; may be repeated"},
    [ROW_SIZE] = {"size", 0, "N", "width and height of knot and soup in pixels; default 256"},
    [ROW_THREADS] = {"threads", 0, "N", "threads of the replay; default 0: one a processor"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine; may be repeated"},
    {0},
};

static const char *const listed_programs[] = {
    "back_layer_peel",
    "layer_peel",
    "coherent_back_peel,spans=1",
    "ideal_coherent_layer_peel",
    "coherent_back_peel,spans=2",
    "fused_coherent_layer_peel",
    "coherent_back_peel,spans=4,float_bits=16",
    "two_ended_lean_peel",
    "coherent_back_peel,spans=3",
    "dual_depth_peel",
    "two_ended_lean_peel,closed=1",
    "two_ended_lean_peel,spans=2",
    "two_ended_opposed_peel",
    "coherent_back_peel,spans=4",
    "two_ended_coherent_layer_peel",
    "two_ended_lean_peel,spans=2,closed=1",
    "two_ended_opposed_peel,spans=2",
    "coherent_back_peel,spans=5",
};
// Without traces: these, recorded to a folder that is removed again. All samples of sheets are alike, so few do.
static const struct {
    const char *label, *scene;
    uint32_t size;  // 0: --size
} listed_scenes[] = {
    {"sheets_sorted", "scene:sheets,count=64,order=sorted", 8},
    {"sheets_reversed", "scene:sheets,count=64,order=reversed", 8},
    {"sheets_shuffled", "scene:sheets,count=64,order=shuffled", 8},
    {"sheets_block_8", "scene:sheets,count=64,order=block:8", 8},
    {"knot", "scene:knot", 0},
    {"soup", "scene:soup,count=300", 0},
};
enum {
    PATH_SIZE = 4096,
    PROGRAMS_MAX = 64,
    TRACES_MAX = 16,
    LISTED_PROGRAMS = sizeof listed_programs / sizeof *listed_programs,
    LISTED_SCENES = sizeof listed_scenes / sizeof *listed_scenes,
};

typedef struct measuring {
    const char *programs[PROGRAMS_MAX], *traces[TRACES_MAX];
    int program_count, trace_count;
    const char *svg, *csv, *machine_name;
    uint64_t size;
    run_options run;
    machine machine;
    curve_program rows[PROGRAMS_MAX];
    curve_trace columns[TRACES_MAX];
    uint64_t passes[PROGRAMS_MAX * TRACES_MAX];
    trade_curve curve;
} measuring;

static int by_bits(const void *left, const void *right)
{
    const curve_program *a = left, *b = right;
    return a->bits != b->bits ? (a->bits < b->bits ? -1 : 1) : strcmp(a->name, b->name);
}

static status fill_programs(measuring *m)
{
    rop_limits limits;
    machine_limits(&m->machine, &limits);
    for (int i = 0; i < m->program_count; i++) {
        char path[PATH_SIZE];
        program *program = NULL;
        curve_program *row = &m->rows[i];
        if (snprintf(row->name, sizeof row->name, "%s", m->programs[i]) >= (int)sizeof row->name)
            return report_error(&command_report, STATUS_USAGE, "%s: the name is too long", m->programs[i]);
        const status status = program_load(m->programs[i], &command_report, path, sizeof path, &program);
        if (status != STATUS_OK)
            return status;
        for (int k = 0; k < program->plane_count; k++)
            row->bits += (uint32_t)plane_bits(&program->planes[k], &limits);
        row->runs = verify_program(program, path, &limits, NULL) == STATUS_OK;
        row->exact = true;
        program_destroy(program);
    }
    qsort(m->rows, (size_t)m->program_count, sizeof *m->rows, by_bits);
    return STATUS_OK;
}

static status measure_trace(measuring *m, const char *path, const char *label, int column)
{
    trace *trace;
    curve_trace *t = &m->columns[column];
    status status = trace_open(path, &command_report, &trace);
    if (status != STATUS_OK)
        return status;
    const trace_info *info = trace_get_info(trace);
    *t = (curve_trace){
        .width = info->width, .height = info->height, .samples = info->samples, .fragments = info->fragment_count};
    snprintf(t->label, sizeof t->label, "%s", label);
    for (int i = 0; status == STATUS_OK && i < m->program_count; i++) {
        run_result *result;
        if (!m->rows[i].runs)
            continue;
        status = trace_rewind(trace);
        if (status == STATUS_OK)
            status = command_replay(m->rows[i].name, &m->machine, trace, &m->run, &result);
        if (status != STATUS_OK)
            break;
        m->passes[i * m->trace_count + column] = result->geometry_passes;
        m->rows[i].exact &= result->error.exact;
        m->rows[i].error = result->error.max_abs > m->rows[i].error ? result->error.max_abs : m->rows[i].error;
        t->deepest = result->deepest_sample;
        result_destroy(result);
    }
    trace_close(trace);
    return status;
}

static status measure_files(measuring *m)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < m->trace_count; i++) {
        char label[NAME_SIZE];
        const char *slash = strrchr(m->traces[i], '/');
        snprintf(label, sizeof label, "%s", slash ? slash + 1 : m->traces[i]);
        char *dot = strrchr(label, '.');
        if (dot && dot != label)
            *dot = 0;
        status = measure_trace(m, m->traces[i], label, i);
    }
    return status;
}

static status measure_scenes(measuring *m)
{
    char folder[] = "/tmp/ropsim-curve-XXXXXX", path[64];
    if (!mkdtemp(folder))
        return report_error(&command_report, STATUS_IO, "%s: cannot be made", folder);
    snprintf(path, sizeof path, "%s/trace.ropt", folder);
    m->trace_count = LISTED_SCENES;
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < LISTED_SCENES; i++) {
        record_options record;
        record_defaults(&record);
        record.width = record.height = listed_scenes[i].size ? listed_scenes[i].size : (uint32_t)m->size;
        status = record_scenes(&listed_scenes[i].scene, 1, &record, path, &command_report);
        if (status == STATUS_OK)
            status = measure_trace(m, path, listed_scenes[i].label, i);
    }
    unlink(path);
    rmdir(folder);
    return status;
}

static status measure(measuring *m)
{
    if (m->program_count == 0) {
        memcpy(m->programs, listed_programs, sizeof listed_programs);
        m->program_count = LISTED_PROGRAMS;
    }
    status status = fill_programs(m);
    if (status == STATUS_OK)
        status = m->trace_count > 0 ? measure_files(m) : measure_scenes(m);
    m->curve = (trade_curve){m->rows, m->program_count, m->columns, m->trace_count, m->passes};
    if (status == STATUS_OK)
        status = curve_print(&m->curve, stdout);
    if (status == STATUS_OK && m->csv)
        status = curve_write_csv(&m->curve, m->csv, &command_report);
    if (status == STATUS_OK && m->svg)
        status = curve_write_svg(&m->curve, m->svg, &command_report);
    return status;
}

// Takes one word; false after saying what is wrong with it.
static bool take_word(int option, const char *value, measuring *m)
{
    switch (option) {
    case ROW_OUT: m->svg = value; return true;
    case ROW_CSV: m->csv = value; return true;
    case ROW_MACHINE: m->machine_name = value; return true;
    case ROW_SIZE: return command_uint("size", value, 1, 4096, &m->size);
    case ROW_THREADS: return command_threads(value, &m->run.threads);
    case ROW_PROGRAM:
        if (m->program_count == PROGRAMS_MAX)
            return command_usage("curve", "too many programs") == STATUS_OK;
        m->programs[m->program_count++] = value;
        return true;
    case COMMAND_OPERAND:
        if (m->trace_count == TRACES_MAX)
            return command_usage("curve", "too many traces") == STATUS_OK;
        m->traces[m->trace_count++] = value;
        return true;
    default: return true;  // --set: taken when the machine is known
    }
}

int command_curve(int argc, char **argv)
{
    measuring *m = calloc(1, sizeof *m);
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    if (!m)
        return (int)report_error(&command_report, STATUS_IO, "out of memory");
    m->size = 256;
    m->run = (run_options){.occlusion_ratio = -1, .reference = true};
    status status = STATUS_OK;
    bool help = false;
    for (int option; status == STATUS_OK && !help && (option = command_next(&line)) != COMMAND_END;) {
        help = option == COMMAND_HELP;
        if (!help && (option == COMMAND_ERROR || !take_word(option, line.value, m)))
            status = STATUS_USAGE;
    }
    if (status == STATUS_OK && !help)
        status = command_find_machine(m->machine_name, argc, argv, option_rows, ROW_SET, &m->machine);
    if (status == STATUS_OK && !help)
        status = measure(m);
    free(m);
    return (int)status;
}
