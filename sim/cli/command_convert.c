// `ropsim convert`: text, binary, deep image and CSV by the files' endings. CSV is written only: it has no header
// to say the picture's size, and the text form is as easy to make.
#include "command.h"

#include <inttypes.h>
#include <string.h>

static const command_option options[] = {{0}};

typedef enum file_kind { KIND_TEXT, KIND_BINARY, KIND_DEEP, KIND_CSV, KIND_COUNT } file_kind;
static const char *const endings[KIND_COUNT] = {".rtxt", ".ropt", ".exr", ".csv"};

static file_kind kind_of(const char *path)
{
    size_t length = strlen(path);
    for (int kind = 0; kind < KIND_COUNT; kind++) {
        size_t tail = strlen(endings[kind]);
        if (length > tail && strcmp(path + length - tail, endings[kind]) == 0)
            return (file_kind)kind;
    }
    return KIND_COUNT;
}

// A draw's runs from `run` on; `run` is then the first of another draw, or empty.
static status copy_draw(trace *trace, trace_writer *writer, uint32_t draw, fragments *run, uint64_t *done)
{
    const trace_info *info = trace_get_info(trace);
    status result = trace_begin_draw(writer, info->draws[draw].name, info->draws[draw].class);
    while (result == STATUS_OK && run->count > 0 && run->draw == draw) {
        result = trace_append(writer, run);
        *done += run->count;
        report_progress(&command_report, "converting", *done, info->fragment_count);
        if (result == STATUS_OK)
            result = trace_next(trace, run);
    }
    return result == STATUS_OK ? trace_end_draw(writer, info->draws[draw].triangles, info->draws[draw].vertices)
                               : result;
}

static status convert_to_trace(trace *trace, const char *path)
{
    const trace_info *info = trace_get_info(trace);
    trace_writer *writer;
    fragments run;
    uint64_t done = 0;
    char hash[33];
    status result = trace_create(path, info, &command_report, &writer);
    if (result != STATUS_OK)
        return result;
    result = trace_next(trace, &run);
    for (uint32_t draw = 0; result == STATUS_OK && draw < info->draw_count; draw++)
        result = copy_draw(trace, writer, draw, &run, &done);
    if (result != STATUS_OK) {
        trace_abandon(writer);
        return result;
    }
    return trace_finish(writer, hash);
}

static status convert_to_csv(trace *trace, const char *path)
{
    const trace_info *info = trace_get_info(trace);
    aside *aside;
    FILE *file;
    fragments run = {0};
    status result = aside_open(path, &command_report, &aside, &file);
    if (result != STATUS_OK)
        return result;
    fprintf(file, "draw,class,x,y,sample,depth,r,g,b,a,primitive\n");
    while ((result = trace_next(trace, &run)) == STATUS_OK && run.count > 0) {
        const trace_draw *draw = &info->draws[run.draw];
        for (uint32_t i = 0; i < run.count; i++)
            fprintf(file, "%u,%s,%u,%u,%u,%.17g,%.9g,%.9g,%.9g,%.9g,%u\n", run.draw, draw_class_names[draw->class],
                    run.x[i], run.y[i], run.sample[i], run.depth[i], (double)run.rgba[0][i], (double)run.rgba[1][i],
                    (double)run.rgba[2][i], (double)run.rgba[3][i], run.primitive[i]);
    }
    if (result != STATUS_OK) {
        aside_discard(aside);
        return result;
    }
    report_warning(&command_report, "%s: CSV keeps neither size, background, sample positions nor draw names", path);
    return aside_finish(aside);
}

static status convert(const char *from, const char *to)
{
    file_kind source = kind_of(from), target = kind_of(to);
    if (target == KIND_COUNT)
        return command_usage("convert", "the second file must end in .rtxt, .ropt, .exr or .csv");
    if (source == KIND_CSV)
        return command_usage("convert", "CSV can be written but not read");
    if (source == KIND_DEEP && target != KIND_TEXT && target != KIND_BINARY)
        return command_usage("convert", "a deep image converts to .rtxt or .ropt");
    if (source == KIND_DEEP)
        return deep_import(from, to, &command_report);
    trace *trace;
    status result = trace_open(from, &command_report, &trace);
    if (result != STATUS_OK)
        return result;
    if (target == KIND_DEEP)
        result = deep_export(trace, to, &command_report);
    else
        result = target == KIND_CSV ? convert_to_csv(trace, to) : convert_to_trace(trace, to);
    trace_close(trace);
    return result;
}

int command_convert(int argc, char **argv)
{
    const char *paths[2] = {NULL, NULL};
    int count = 0;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (count == 2)
            return (int)command_usage("convert", "two files: IN and OUT");
        paths[count++] = line.value;
    }
    if (count < 2)
        return (int)command_usage("convert", "two files: IN and OUT");
    return (int)convert(paths[0], paths[1]);
}
