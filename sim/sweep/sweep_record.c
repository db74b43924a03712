// A line `record SCENE... [size=WxH] [samples=N] [alpha=A]` of a sweep file, recorded to a trace.
#include "sweep.h"

#include <stdlib.h>
#include <string.h>

enum { SCENES_MAX = 32 };

static bool read_size(const char *text, record_options *options)
{
    unsigned width, height;
    char end;
    if (strspn(text, "0123456789x") != strlen(text) || sscanf(text, "%5ux%5u%c", &width, &height, &end) != 2 ||
        width < 1 || height < 1 || width > TRACE_SIZE_MAX || height > TRACE_SIZE_MAX)
        return false;
    options->width = width;
    options->height = height;
    return true;
}

static bool read_samples(const char *text, record_options *options)
{
    for (uint32_t samples = 1; samples <= TRACE_SAMPLES_MAX; samples *= 2) {
        char word[16];
        snprintf(word, sizeof word, "%u", samples);
        if (strcmp(text, word) == 0) {
            options->samples = samples;
            return true;
        }
    }
    return false;
}

static bool read_alpha(const char *text, record_options *options)
{
    char *end;
    options->alpha = strtod(text, &end);
    return end != text && !*end && options->alpha >= 0 && options->alpha <= 1;
}

static const struct {
    const char *key, *accepted;
    bool (*read)(const char *text, record_options *options);
} option_rows[] = {
    {"size=", "size=WxH in pixels, each from 1 to 32768", read_size},
    {"samples=", "samples=1, 2, 4, 8 or 16", read_samples},
    {"alpha=", "alpha=A from 0 to 1", read_alpha},
};
enum { OPTION_COUNT = sizeof option_rows / sizeof *option_rows };

// A mesh's path is relative to the sweep file, behind its class.
static char *scene_path(const sweep_file *file, const char *word)
{
    size_t prefix = 0;
    for (int i = 0; i < CLASS_COUNT; i++) {
        const size_t length = strlen(draw_class_names[i]);
        if (strncmp(word, draw_class_names[i], length) == 0 && word[length] == ':')
            prefix = length + 1;
    }
    if (strncmp(word + prefix, "scene:", 6) == 0)
        return strdup(word);
    char *path = sweep_path(file, word + prefix);
    char *whole = path ? malloc(prefix + strlen(path) + 1) : NULL;
    if (whole) {
        memcpy(whole, word, prefix);
        strcpy(whole + prefix, path);
    }
    free(path);
    return whole;
}

status sweep_record(const sweep_file *file, const sweep_word *line, const char *path, const report *report)
{
    sweep_place place;
    record_options options;
    char *scenes[SCENES_MAX], *rest = NULL, *text = strdup(line->text);
    int count = 0;
    status status = text ? STATUS_OK : report_error(report, STATUS_IO, "out of memory");
    sweep_place_start(&place, report, file->path, line);
    record_defaults(&options);
    for (char *word = text ? strtok_r(text, " ", &rest) : NULL;
         status == STATUS_OK && (word = strtok_r(NULL, " ", &rest));) {
        int row = 0;
        while (row < OPTION_COUNT && strncmp(word, option_rows[row].key, strlen(option_rows[row].key)) != 0)
            row++;
        if (row < OPTION_COUNT) {
            if (!option_rows[row].read(word + strlen(option_rows[row].key), &options))
                status =
                    report_error(&place.report, STATUS_REFUSED, "`%s` must be %s", word, option_rows[row].accepted);
        } else if (count == SCENES_MAX) {
            status = report_error(&place.report, STATUS_REFUSED, "at most %d scenes in a trace", SCENES_MAX);
        } else if (!(scenes[count++] = scene_path(file, word))) {
            status = report_error(report, STATUS_IO, "out of memory");
        }
    }
    if (status == STATUS_OK && count == 0)
        status = report_error(&place.report, STATUS_REFUSED,
                              "no scene to record: record SCENE... [size=WxH] [samples=N] [alpha=A]");
    if (status == STATUS_OK)
        status = record_scenes((const char *const *)scenes, count, &options, path, &place.report);
    for (int i = 0; i < count; i++)
        free(scenes[i]);
    free(text);
    return status;
}
