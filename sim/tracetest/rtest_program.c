// The program of a case: a stem of programs/, a file beside the test, or lines of the test; with `replace` done.
#include "rtest.h"

#include <stdlib.h>
#include <string.h>

enum { PROGRAM_BYTES_MAX = 1 << 20 };

static char *read_program(const char *path, const report *report)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        report_error(report, STATUS_IO, "%s: cannot be opened", path);
        return NULL;
    }
    char *text = malloc(PROGRAM_BYTES_MAX + 2);
    const size_t size = text ? fread(text, 1, PROGRAM_BYTES_MAX + 1, file) : 0;
    const bool failed = !text || ferror(file) || size > PROGRAM_BYTES_MAX;
    fclose(file);
    if (failed) {
        report_error(report, STATUS_IO, "%s: could not be read, or has more than %d bytes", path, PROGRAM_BYTES_MAX);
        free(text);
        return NULL;
    }
    text[size] = 0;
    return text;
}

// Empty lines in front keep the numbers of lines in messages those of the test file.
static char *copy_section(const rtest_file *file, const rtest_source *source)
{
    const size_t above = (size_t)source->line, size = source->end - source->begin;
    char *text = malloc(above + size + 1);
    if (!text)
        return NULL;
    memset(text, '\n', above);
    memcpy(text + above, file->text.bytes + source->begin, size);
    text[above + size] = 0;
    return text;
}

// Puts `with` for every `what`, of which there must be one. Frees `text`.
static char *replace(char *text, const char *what, const char *with, const report *report)
{
    char *out = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&out, &size);
    const char *from = text, *at = strstr(text, what);
    if (!stream || !at) {
        report_error(report, stream ? STATUS_REFUSED : STATUS_IO,
                     stream ? "the program has no `%s` to replace" : "out of memory: %s", what);
        if (stream)
            fclose(stream);
        free(out);
        free(text);
        return NULL;
    }
    for (; at; from = at + strlen(what), at = strstr(from, what)) {
        fwrite(from, 1, (size_t)(at - from), stream);
        fputs(with, stream);
    }
    fputs(from, stream);
    fclose(stream);
    free(text);
    return out;
}

// A path is seen from the test; a stem of programs/ stands for itself. `path`: where its text is.
static status load_named(const rtest_file *file, const char *name, const report *report, char path[RTEST_PATH_SIZE],
                         program **program)
{
    char words[RTEST_PATH_SIZE];
    const bool is_path = strpbrk(name, "/.") != NULL;  // no shipped program has a dot in its name
    const status status = rtest_beside(is_path ? file->text.path : "", name, report, words, sizeof words);
    return status == STATUS_OK ? program_load(words, report, path, RTEST_PATH_SIZE, program) : status;
}

status rtest_program_load(const rtest_file *file, const rtest_case *test, const rtest_source *source,
                          rtest_messages *messages, char path[RTEST_PATH_SIZE], program **program)
{
    const report *report = &messages->report;
    char *text;
    *program = NULL;
    if (source->name) {
        status status = load_named(file, source->name, report, path, program);
        if (status != STATUS_OK || test->replace_count == 0)
            return status;
        program_destroy(*program);
        *program = NULL;
        if (strchr(source->name, ','))
            return report_error(report, STATUS_REFUSED, "`%s`: `replace` and values of parameters do not go together",
                                source->name);
        text = read_program(path, report);
    } else {
        snprintf(path, RTEST_PATH_SIZE, "%s", file->text.path);
        text = copy_section(file, source);
    }
    for (int i = 0; text && i < test->replace_count; i++)
        text = replace(text, test->replace[i].what, test->replace[i].with, report);
    if (!text)
        return STATUS_REFUSED;
    const status status = assemble_text(path, text, strlen(text), report, program);
    free(text);
    return status;
}
