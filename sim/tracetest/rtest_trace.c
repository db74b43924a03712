// The trace of a test: a file beside it, or lines of the test written to a temporary file, `layers` lines spelt out.
//
// A trace is read more than once, and its reader wants a file. The line that each line came from is kept, so that
// messages name the test file.
#include "rtest.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LINES_MAX = 1 << 22 };

typedef struct spelling {
    rtest_text text;  // the section, with words of its own
    FILE *out;
    int *lines;  // where each line of `out` came from
    int line_count;
} spelling;

static status note_lines(spelling *s, int count)
{
    if (count > LINES_MAX - s->line_count)
        return rtest_refuse(&s->text, 1, "the trace has more than %d lines; name a file instead", LINES_MAX);
    for (int i = 0; i < count; i++) {
        int *line = rtest_add(&s->lines, &s->line_count, sizeof *line);
        if (!line)
            return report_error(s->text.report, STATUS_IO, "%s: out of memory", s->text.path);
        *line = s->text.line;
    }
    return STATUS_OK;
}

static status spell_line(spelling *s)
{
    const size_t begin = s->text.next;
    const char *newline = memchr(s->text.bytes + begin, '\n', s->text.size - begin);
    const size_t end = newline ? (size_t)(newline - s->text.bytes) + 1 : s->text.size;
    const char *first = s->text.bytes + begin + strspn(s->text.bytes + begin, " \t");
    if (strncmp(first, "layers", 6) == 0 && strchr(" \t\r\n#", first[6])) {
        int count = 0;
        status status = rtest_next_line(&s->text);
        if (status == STATUS_OK)
            status = rtest_layers_write(&s->text, s->out, &count);
        return status == STATUS_OK ? note_lines(s, count) : status;
    }
    fwrite(s->text.bytes + begin, 1, end - begin, s->out);
    s->text.next = end;
    s->text.line++;
    return note_lines(s, 1);
}

static status spell(const rtest_file *file, const rtest_source *source, const report *report, spelling *s)
{
    s->text = file->text;
    s->text.report = report;
    s->text.next = source->begin;
    s->text.size = source->end;
    s->text.line = source->line;
    s->text.scratch = malloc(file->text.size + 1);
    if (!s->text.scratch)
        return report_error(report, STATUS_IO, "%s: out of memory", file->text.path);
    memcpy(s->text.scratch, file->text.bytes, file->text.size + 1);
    // The mark that begins a trace may be left out.
    const char *start = file->text.bytes + source->begin;
    start += strspn(start, " \t\r\n");
    status status = STATUS_OK;
    if (strncmp(start, "ropsim-trace", 12) != 0) {
        fputs("ropsim-trace 1\n", s->out);
        status = note_lines(s, 1);
    } else {
        // The mark must be the file's first bytes.
        for (; s->text.next < (size_t)(start - s->text.bytes); s->text.next++)
            s->text.line += s->text.bytes[s->text.next] == '\n';
    }
    while (status == STATUS_OK && s->text.next < s->text.size)
        status = spell_line(s);
    free(s->text.scratch);
    return status;
}

static status create_temporary(const report *report, char **path, FILE **file)
{
    const char *folder = getenv("TMPDIR");
    folder = folder && folder[0] ? folder : "/tmp";
    const size_t size = strlen(folder) + sizeof "/ropsim-test-XXXXXX.rtxt";
    *path = malloc(size);
    if (!*path)
        return report_error(report, STATUS_IO, "out of memory");
    snprintf(*path, size, "%s/ropsim-test-XXXXXX.rtxt", folder);
    const int descriptor = mkstemps(*path, 5);
    *file = descriptor < 0 ? NULL : fdopen(descriptor, "wb");
    if (*file)
        return STATUS_OK;
    const status status = report_error(report, STATUS_IO, "%s: cannot be written: %s", *path, strerror(errno));
    free(*path);
    *path = NULL;
    return status;
}

static status open_inline(const rtest_file *file, const rtest_source *source, rtest_messages *messages,
                          rtest_trace *trace)
{
    spelling s = {0};
    status status = create_temporary(&messages->report, &trace->temporary_path, &s.out);
    if (status != STATUS_OK)
        return status;
    status = spell(file, source, &messages->report, &s);
    const bool lost = ferror(s.out);
    if ((fclose(s.out) != 0 || lost) && status == STATUS_OK)
        status = report_error(&messages->report, STATUS_IO, "%s: cannot be written", trace->temporary_path);
    trace->source_lines = s.lines;
    messages->temporary_path = trace->temporary_path;
    messages->source_lines = s.lines;
    messages->source_line_count = s.line_count;
    return status == STATUS_OK ? trace_open(trace->temporary_path, &messages->report, &trace->trace) : status;
}

status rtest_trace_open(const rtest_file *file, const rtest_source *source, rtest_messages *messages,
                        rtest_trace *trace)
{
    char path[RTEST_PATH_SIZE];
    *trace = (rtest_trace){0};
    if (!source->name)
        return open_inline(file, source, messages, trace);
    const status status = rtest_beside(file->text.path, source->name, &messages->report, path, sizeof path);
    return status == STATUS_OK ? trace_open(path, &messages->report, &trace->trace) : status;
}

void rtest_trace_close(rtest_trace *trace)
{
    trace_close(trace->trace);
    if (trace->temporary_path)
        unlink(trace->temporary_path);
    free(trace->temporary_path);
    free(trace->source_lines);
    *trace = (rtest_trace){0};
}

status rtest_beside(const char *test_path, const char *name, const report *report, char *path, size_t size)
{
    const char *slash = strrchr(test_path, '/');
    const int folder = slash && name[0] != '/' ? (int)(slash + 1 - test_path) : 0;
    const int length = snprintf(path, size, "%.*s%s", folder, test_path, name);
    if (length < 0 || (size_t)length >= size)
        return report_error(report, STATUS_REFUSED, "%s: the path of `%.40s...` is too long", test_path, name);
    return STATUS_OK;
}
