// `ropsim record`: meshes and built-in scenes to a fragment trace.
#include "command.h"

#include <stdlib.h>
#include <string.h>

enum {
    ROW_OUTPUT,
    ROW_SIZE,
    ROW_SAMPLES,
    ROW_ORTHO,
    ROW_ORTHO_HEIGHT,
    ROW_FOV,
    ROW_EYE,
    ROW_TARGET,
    ROW_UP,
    ROW_NEAR,
    ROW_FAR,
    ROW_REVERSE_Z,
    ROW_ALPHA,
    ROW_BACKGROUND,
    ROW_ORDER,
    ROW_SCENES,
};
static const command_option option_rows[] = {
    [ROW_OUTPUT] = {"output", 'o', "TRACE", "the trace to write: .ropt binary, .rtxt text"},
    [ROW_SIZE] = {"size", 0, "WxH", "pixels; default 512x512"},
    [ROW_SAMPLES] = {"samples", 0, "N", "samples a pixel at D3D's standard positions: 1, 2, 4, 8 or 16; default 1"},
    [ROW_ORTHO] = {"ortho", 0, NULL, "orthographic camera; default: perspective"},
    [ROW_ORTHO_HEIGHT] = {"ortho-height", 0, "H",
                          "orthographic, with a view of H world units from bottom to top; default: fitted"},
    [ROW_FOV] = {"fov", 0, "DEG", "perspective, with this vertical field of view in degrees; default 30"},
    [ROW_EYE] = {"eye", 0, "X,Y,Z",
                 "where the camera is; default: before the scene on the +z side, as near as it sees all"},
    [ROW_TARGET] = {"target", 0, "X,Y,Z", "what it looks at; default: the middle of the scene"},
    [ROW_UP] = {"up", 0, "X,Y,Z", "what is up in the picture; default 0,1,0"},
    [ROW_NEAR] = {"near", 0, "N", "distance of the near plane in world units; default 0: fitted"},
    [ROW_FAR] = {"far", 0, "F", "distance of the far plane in world units; default 0: fitted"},
    [ROW_REVERSE_Z] = {"reverse-z", 0, NULL, "the device's depth is 1 at the near plane (the trace's stays 0 there)"},
    [ROW_ALPHA] = {"alpha", 0, "A", "alpha of surfaces without one of their own, 0 to 1; default 0.5"},
    [ROW_BACKGROUND] = {"background", 0, "R,G,B,A", "linear straight RGBA; default 0,0,0,0"},
    [ROW_ORDER] = {"order", 0, "ORDER",
                   "none|front|back|bucket:N|shuffle:SEED: triangles of each draw by centroid; default none"},
    [ROW_SCENES] = {"scenes", 0, NULL, "list the built-in scenes and their keys"},
    {0},
};

// Reads exactly `count` numbers with commas between; false after saying what is accepted.
static bool read_numbers(int row, const char *text, int count, double *numbers)
{
    const char *at = text;
    for (int i = 0; i < count; i++) {
        char *end;
        numbers[i] = strtod(at, &end);
        if (end == at || *end != (i + 1 < count ? ',' : 0)) {
            report_error(&command_report, STATUS_USAGE, "--%s: `%s` is not %d numbers as %s", option_rows[row].name,
                         text, count, option_rows[row].argument);
            return false;
        }
        at = end + 1;
    }
    return true;
}

static bool read_size(const char *text, record_options *options)
{
    int used = 0;
    unsigned width, height;
    if (strspn(text, "0123456789x") != strlen(text) || strlen(text) > 15 ||
        sscanf(text, "%ux%u%n", &width, &height, &used) != 2 || text[used]) {
        report_error(&command_report, STATUS_USAGE, "--size: `%s` is not WxH in pixels, such as 512x512", text);
        return false;
    }
    options->width = width;
    options->height = height;
    return true;
}

static bool read_order(const char *text, record_options *options)
{
    static const struct {
        const char *word;
        triangle_order order;
        bool has_number;
    } orders[] = {
        {"none", ORDER_NONE, false},     {"front", ORDER_FRONT, false},     {"back", ORDER_BACK, false},
        {"bucket:", ORDER_BUCKET, true}, {"shuffle:", ORDER_SHUFFLE, true},
    };
    for (size_t i = 0; i < sizeof orders / sizeof *orders; i++) {
        size_t length = strlen(orders[i].word);
        options->order = orders[i].order;
        if (orders[i].has_number && strncmp(text, orders[i].word, length) == 0)
            return command_uint("order", text + length, options->order == ORDER_BUCKET,
                                options->order == ORDER_BUCKET ? UINT32_MAX : UINT64_MAX, &options->order_parameter);
        if (!orders[i].has_number && strcmp(text, orders[i].word) == 0)
            return true;
    }
    report_error(&command_report, STATUS_USAGE, "--order: `%s` is none of none, front, back, bucket:N, shuffle:SEED",
                 text);
    return false;
}

static bool take_option(int row, const char *value, record_options *options)
{
    camera *camera = &options->camera;
    uint64_t number = 0;
    double numbers[4];
    switch (row) {
    case ROW_SIZE: return read_size(value, options);
    case ROW_SAMPLES:
        if (!command_uint("samples", value, 1, TRACE_SAMPLES_MAX, &number))
            return false;
        options->samples = (uint32_t)number;
        return true;
    case ROW_ORTHO: camera->ortho = true; return true;
    case ROW_ORTHO_HEIGHT:
        camera->ortho = true;
        return command_double("ortho-height", value, 1e-30, 1e30, &camera->ortho_height);
    case ROW_FOV: return command_double("fov", value, 0.001, 179.9, &camera->fov_degrees);
    case ROW_EYE: camera->eye_set = true; return read_numbers(row, value, 3, camera->eye);
    case ROW_TARGET: camera->target_set = true; return read_numbers(row, value, 3, camera->target);
    case ROW_UP: camera->up_set = true; return read_numbers(row, value, 3, camera->up);
    case ROW_NEAR: return command_double("near", value, -1e30, 1e30, &camera->near);
    case ROW_FAR: return command_double("far", value, -1e30, 1e30, &camera->far);
    case ROW_REVERSE_Z: camera->reverse_z = true; return true;
    case ROW_ALPHA: return command_double("alpha", value, 0, 1, &options->alpha);
    case ROW_BACKGROUND:
        if (!read_numbers(row, value, 4, numbers))
            return false;
        for (int i = 0; i < 4; i++)
            options->background[i] = (float)numbers[i];
        return true;
    default: return read_order(value, options);
    }
}

static void print_scenes(void)
{
    printf("\nBuilt-in scenes, as scene:NAME[,key=value...]; see docs/record.md:\n\n");
    record_print_scenes(stdout);
}

static status record(char **scenes, int scene_count, const record_options *options, const char *output)
{
    if (!scene_count)
        return command_usage("record", "give a mesh file or scene:NAME");
    if (!output)
        return command_usage("record", "give the trace to write: -o TRACE");
    return record_scenes((const char *const *)scenes, scene_count, options, output, &command_report);
}

int command_record(int argc, char **argv)
{
    record_options options;
    record_defaults(&options);
    const char *output = NULL;
    bool fov = false;
    int scene_count = 0, option;
    char **scenes = calloc((size_t)argc, sizeof *scenes);
    if (!scenes)
        return report_error(&command_report, STATUS_IO, "out of memory");
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    status result = STATUS_OK;
    while (!result && (option = command_next(&line)) != COMMAND_END) {
        fov = fov || option == ROW_FOV;
        if (option == COMMAND_HELP || option == ROW_SCENES) {
            print_scenes();
            free(scenes);
            return STATUS_OK;
        }
        if (option == COMMAND_OPERAND)
            scenes[scene_count++] = argv[line.index];
        else if (option == ROW_OUTPUT)
            output = line.value;
        else if (option == COMMAND_ERROR || !take_option(option, line.value, &options))
            result = STATUS_USAGE;
    }
    if (!result && fov && options.camera.ortho)
        result = command_usage("record", "--fov and --ortho exclude each other");
    if (!result)
        result = record(scenes, scene_count, &options, output);
    free(scenes);
    return (int)result;
}
