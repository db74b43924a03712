// `ropsim papers`: figure 1 and table 1 of the coherent layer peeling paper, on meshes that the user has: counts, or
// with
// --time and --gain times.
#include "papers_time.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// What stands in when no mesh is given: the Stanford bunny of Debian's glmark2-data where that is installed.
static const char STAND_IN_MESH[] = "/usr/share/glmark2/models/bunny.obj";
static const char STAND_IN_SCENE[] = "scene:knot";

enum {
    ROW_OUT,
    ROW_SIZE,
    ROW_FIGURE_SIZE,
    ROW_SLICES,
    ROW_BUCKETS,
    ROW_THREADS,
    ROW_SET,
    ROW_TIME,
    ROW_GAIN,
    ROW_GRID,
    ROW_SVG
};
static const command_option option_rows[] = {
    [ROW_TIME] = {"time", 0, NULL, "times and frame rates on the paper's card beside the paper's, instead of counts"},
    [ROW_GAIN] = {"gain", 0, NULL, "what a programmable ROP would gain, over the slots a clock of its kernel unit"},
    [ROW_OUT] = {"out", 'o', "FOLDER", "where a JSON a run and papers.csv, time.csv or gain.csv go; default: nowhere"},
    [ROW_SIZE] = {"size", 0, "WxH", "of the meshes' pictures in pixels; default 512x512"},
    [ROW_FIGURE_SIZE] = {"figure-size", 0, "WxH", "of figure 1 in pixels; default 128x128"},
    [ROW_SLICES] = {"slices", 0, "N", "slices of figure 1; default 256"},
    [ROW_BUCKETS] = {"buckets", 0, "N", "buckets of the sort by centroid; default 1024"},
    [ROW_THREADS] = {"threads", 0, "N", "threads of the replay; default 0: one a processor"},
    [ROW_SET] = {"set", 0, "KEY=VALUE",
                 "change one key of the machine " COMMAND_DEFAULT_MACHINE
                 "; with --time and --gain of all machines; may be repeated"},
    [ROW_GRID] = {"grid", 0, "N", "with --time and --gain: quads a side of a slice; default 1"},
    [ROW_SVG] = {"svg", 0, "FILE", "with --gain: write a plot"},
    {0},
};

typedef struct papers {
    const char *words[PAPER_MESHES_MAX];
    int word_count;
    const char *out, *svg;
    bool time, gain;
    run_options run;
    machine machine;
    paper_setup setup;
} papers;

static bool read_size(const char *option, const char *text, record_options *options)
{
    int used = 0;
    unsigned width, height;
    if (strspn(text, "0123456789x") != strlen(text) || strlen(text) > 15 ||
        sscanf(text, "%ux%u%n", &width, &height, &used) != 2 || text[used] || width == 0 || height == 0) {
        report_error(&command_report, STATUS_USAGE, "--%s: `%s` is not WxH in pixels, such as 512x512", option, text);
        return false;
    }
    options->width = width;
    options->height = height;
    return true;
}

// Takes one word; false after saying what is wrong with it.
static bool take_word(int option, const char *value, papers *papers)
{
    enum { SLICES_MAX = 4096, GRID_MAX = 128 };  // as the scene has them
    uint64_t number = 0;
    switch (option) {
    case ROW_OUT: papers->out = value; return true;
    case ROW_SVG: papers->svg = value; return true;
    case ROW_TIME: papers->time = true; return true;
    case ROW_GAIN: papers->gain = true; return true;
    case ROW_GRID:
        if (!command_uint("grid", value, 1, GRID_MAX, &number))
            return false;
        papers->setup.grid = (uint32_t)number;
        return true;
    case ROW_SIZE: return read_size("size", value, &papers->setup.mesh);
    case ROW_FIGURE_SIZE: return read_size("figure-size", value, &papers->setup.figure);
    case ROW_SLICES:
        if (!command_uint("slices", value, 1, SLICES_MAX, &number))
            return false;
        papers->setup.slices = (uint32_t)number;
        return true;
    case ROW_BUCKETS: return command_uint("buckets", value, 1, UINT32_MAX, &papers->setup.mesh.order_parameter);
    case ROW_THREADS: return command_threads(value, &papers->run.threads);
    case COMMAND_OPERAND:
        if (papers->word_count == PAPER_MESHES_MAX) {
            report_error(&command_report, STATUS_USAGE, "at most %d meshes at a time", PAPER_MESHES_MAX);
            return false;
        }
        papers->words[papers->word_count++] = value;
        return true;
    default: return true;  // --set: taken when the machine is known
    }
}

// "MODEL=FILE" of table 1, or a mesh or scene of the user's own: *model is NULL then.
static status split_word(const char *word, const char **model, const char **scene)
{
    char name[PAPER_LABEL_SIZE];
    size_t length = strspn(word, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-");
    *model = NULL;
    *scene = word;
    if (word[length] != '=')
        return STATUS_OK;
    snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), word);
    *scene = word + length + 1;
    *model = paper_model(name);
    return *model ? STATUS_OK : STATUS_USAGE;
}

// "models/bunny.obj" to "bunny", "scene:knot,p=3" to "knot_p_3".
static void name_scene(const char *scene, char name[PAPER_LABEL_SIZE])
{
    bool built_in = strncmp(scene, "scene:", 6) == 0;
    const char *slash = strrchr(scene, '/'), *from = built_in ? scene + 6 : slash ? slash + 1 : scene;
    snprintf(name, PAPER_LABEL_SIZE, "%s", from);
    char *dot = built_in ? NULL : strrchr(name, '.');
    if (dot && dot != name)
        *dot = 0;
    for (char *at = name; *at; at++) {
        if (!isalnum((unsigned char)*at))
            *at = '_';
    }
}

static void add_subject(papers *papers, const char *scene, const char *model, const paper_row *row, paper_view view,
                        const paper_box *box)
{
    paper_setup *setup = &papers->setup;
    paper_subject *subject = &setup->subjects[setup->subject_count++];
    *subject = (paper_subject){.scene = scene, .row = row, .view = view, .camera = setup->mesh.camera};
    snprintf(subject->model, sizeof subject->model, "%s", model);
    snprintf(subject->label, sizeof subject->label, "%.*s_%s", PAPER_LABEL_SIZE - 8, model, paper_views[view].name);
    if (!box)
        return;
    subject->box = *box;
    paper_view_camera(view, box, (double)setup->mesh.width / setup->mesh.height, &subject->camera);
}

// Files of results and rows of tables are told apart by this name.
static status check_name(const paper_setup *setup, const char *name)
{
    for (int i = 0; i < setup->subject_count; i++) {
        if (strcmp(setup->subjects[i].model, name) == 0)
            return report_error(&command_report, STATUS_USAGE, "two meshes are called `%s`; give one at a time", name);
    }
    return STATUS_OK;
}

// Those that table 1 has of its model.
static void add_paper_views(papers *papers, const char *scene, const char *model, const paper_box *box)
{
    for (int i = 0; i < PAPER_ROW_COUNT; i++) {
        if (strcmp(paper_rows[i].model, model) == 0)
            add_subject(papers, scene, model, &paper_rows[i], paper_rows[i].view, box);
    }
}

// Each that looks along an axis of its own.
static void add_own_views(papers *papers, const char *scene, const char *name, const paper_box *box)
{
    unsigned axes = 0;
    for (int view = 0; view < PAPER_VIEW_COUNT; view++) {
        unsigned axis = 1u << paper_view_axis((paper_view)view, box);
        if (!(axes & axis))
            add_subject(papers, scene, name, NULL, (paper_view)view, box);
        axes |= axis;
    }
}

static status add_word(papers *papers, const char *word)
{
    const char *model, *scene;
    paper_box box = {.faces = 0};
    char name[PAPER_LABEL_SIZE];
    status status = split_word(word, &model, &scene);
    if (status != STATUS_OK)
        return status;
    bool built_in = strncmp(scene, "scene:", 6) == 0;
    if (model && built_in)
        return report_error(&command_report, STATUS_USAGE, "%s: table 1 wants a mesh file", word);
    if (model)
        snprintf(name, sizeof name, "%s", model);
    else
        name_scene(scene, name);
    status = check_name(&papers->setup, name);
    if (status == STATUS_OK && !built_in)
        status = paper_box_of(scene, &box);
    if (status != STATUS_OK)
        return status;
    if (built_in)
        add_subject(papers, scene, name, NULL, PAPER_VIEW_front, NULL);
    else if (model)
        add_paper_views(papers, scene, model, &box);
    else
        add_own_views(papers, scene, name, &box);
    return STATUS_OK;
}

// All words are looked at before the first trace is recorded: a wrong path must not be found after minutes.
static status add_subjects(papers *papers)
{
    enum { VIEWS_MAX = 3 };  // of a word
    if (papers->word_count == 0)
        papers->words[papers->word_count++] = access(STAND_IN_MESH, R_OK) == 0 ? STAND_IN_MESH : STAND_IN_SCENE;
    papers->setup.subjects = calloc((size_t)papers->word_count * VIEWS_MAX, sizeof *papers->setup.subjects);
    if (!papers->setup.subjects)
        return report_error(&command_report, STATUS_IO, "out of memory");
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < papers->word_count; i++)
        status = add_word(papers, papers->words[i]);
    return status;
}

static status measure_figure(paper_setup *setup, paper_bench *bench)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < PAPER_FIGURE_COUNT; i++) {
        char scene[64];
        record_options options = setup->figure;
        options.order = paper_figures[i].kind;
        options.order_parameter = paper_figures[i].parameter;
        snprintf(scene, sizeof scene, "%sscene:slices_cone,slices=%u", paper_figures[i].class, setup->slices);
        status = paper_measure(bench, scene, &options, false, "figure1", paper_figures[i].name, &setup->figures[i]);
    }
    return status;
}

static status measure_subject(const paper_setup *setup, paper_subject *subject, paper_bench *bench)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < PAPER_ORDER_COUNT; i++) {
        record_options options = setup->mesh;
        options.camera = subject->camera;
        options.order = paper_orders[i].kind;
        if (options.order != ORDER_BUCKET)
            options.order_parameter = paper_orders[i].parameter;
        status = paper_measure(bench, subject->scene, &options, true, subject->label, paper_orders[i].name,
                               &subject->cases[i]);
    }
    return status;
}

// Pages come as they are done.
static status measure(papers *papers, paper_bench *bench)
{
    paper_setup *setup = &papers->setup;
    paper_print_intro(setup, &papers->machine);
    status status = measure_figure(setup, bench);
    if (status != STATUS_OK)
        return status;
    paper_print_figure(setup);
    paper_print_orders();
    for (int i = 0; i < setup->subject_count; i++) {
        status = measure_subject(setup, &setup->subjects[i], bench);
        if (status != STATUS_OK)
            return status;
        paper_print_subject(&setup->subjects[i]);
    }
    paper_print_table(setup);
    paper_print_differences(setup);
    return paper_bench_finish(bench);
}

static status measure_counts(papers *papers, int argc, char **argv)
{
    paper_bench *bench = NULL;
    status status = command_find_machine(NULL, argc, argv, option_rows, ROW_SET, &papers->machine);
    const uint64_t cases = PAPER_FIGURE_COUNT + (uint64_t)papers->setup.subject_count * PAPER_ORDER_COUNT;
    if (status == STATUS_OK)
        status = paper_bench_create(&papers->machine, &papers->run, papers->out, cases, &bench);
    if (status == STATUS_OK)
        status = measure(papers, bench);
    paper_bench_destroy(bench);
    return status;
}

// The user's --set, then what makes each machine what it is.
static status find_machines(int argc, char **argv, paper_machine_set *set)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < PAPER_MACHINE_COUNT; i++) {
        const paper_machine_row *row = &paper_machines[i];
        status = command_find_machine(row->file, argc, argv, option_rows, ROW_SET, &set->machines[i]);
        for (int k = 0; status == STATUS_OK && k < 2 && row->settings[k][0]; k++) {
            char assignment[2 * NAME_SIZE];
            snprintf(assignment, sizeof assignment, "%s=%s", row->settings[k][0], row->settings[k][1]);
            status = machine_set(&set->machines[i], assignment, &command_report);
        }
    }
    return status;
}

static status measure_times(papers *papers, int argc, char **argv)
{
    paper_machine_set *set = malloc(sizeof *set);
    if (!set)
        return report_error(&command_report, STATUS_IO, "out of memory");
    status status = find_machines(argc, argv, set);
    if (status == STATUS_OK && papers->time)
        status = paper_time_all(&papers->setup, set, &papers->run, papers->out);
    if (status == STATUS_OK && papers->gain)
        status = paper_gain_all(&papers->setup, set, &papers->run, papers->out, papers->svg);
    free(set);
    return status;
}

int command_papers(int argc, char **argv)
{
    papers papers = {.run = {.occlusion_ratio = -1, .reference = true}, .setup = {.slices = 256, .grid = 1}};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    record_defaults(&papers.setup.mesh);
    record_defaults(&papers.setup.figure);
    papers.setup.mesh.order_parameter = 1024;
    papers.setup.figure.width = papers.setup.figure.height = 128;
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR || !take_word(option, line.value, &papers))
            return STATUS_USAGE;
    }
    if (papers.svg && !papers.gain)
        return (int)command_usage("papers", "--svg wants --gain");
    const bool times = papers.time || papers.gain;
    status status = add_subjects(&papers);
    if (status == STATUS_OK)
        status = times ? measure_times(&papers, argc, argv) : measure_counts(&papers, argc, argv);
    free(papers.setup.subjects);
    return (int)status;
}
