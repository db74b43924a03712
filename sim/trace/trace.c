// The public reader: tells the forms apart by their first bytes and keeps a failed trace failed.
#include "form.h"
#include "records.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct trace {
    char *path;
    const report *report;
    trace_info info;
    opened opened;
    status failed;
};

static const char text_mark[] = "ropsim-trace";

static status open_form(trace *trace, int descriptor)
{
    struct stat file;
    if (fstat(descriptor, &file) != 0 || !S_ISREG(file.st_mode)) {
        close(descriptor);
        return report_error(trace->report, STATUS_IO, "%s: is not a regular file; a trace is read more than once",
                            trace->path);
    }
    char start[sizeof text_mark - 1] = {0};
    ssize_t got = pread(descriptor, start, sizeof start, 0);
    if (got >= (ssize_t)sizeof header_magic && memcmp(start, header_magic, sizeof header_magic) == 0)
        return binary_open(trace->path, descriptor, trace->report, &trace->info, &trace->opened);
    if (got == (ssize_t)sizeof start && memcmp(start, text_mark, sizeof start) == 0)
        return text_open(trace->path, descriptor, trace->report, &trace->info, &trace->opened);
    int error = errno;
    close(descriptor);
    if (got < 0)
        return report_error(trace->report, STATUS_IO, "%s: cannot be read: %s", trace->path, strerror(error));
    return report_error(trace->report, STATUS_REFUSED,
                        "%s: byte 0: is no trace: neither the mark of the binary form (.ropt) nor a first line "
                        "`ropsim-trace 1` (.rtxt)",
                        trace->path);
}

status trace_open(const char *path, const report *report, trace **result)
{
    *result = NULL;
    int descriptor = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe without a writer must not hang
    if (descriptor < 0)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    trace *trace = calloc(1, sizeof *trace);
    char *name = strdup(path);
    if (!trace || !name) {
        close(descriptor);
        free(trace);
        free(name);
        return report_error(report, STATUS_IO, "%s: no memory", path);
    }
    *trace = (struct trace){.path = name, .report = report};
    status status = open_form(trace, descriptor);
    if (status != STATUS_OK) {
        trace_close(trace);
        return status;
    }
    *result = trace;
    return STATUS_OK;
}

status trace_from_source(const trace_info *info, const trace_source *source, const report *report, trace **result)
{
    *result = NULL;
    trace *trace = calloc(1, sizeof *trace);
    trace_draw *draws = malloc((info->draw_count ? info->draw_count : 1) * sizeof *draws);
    opened opened;
    if (!trace || !draws || !source_open(source, &opened)) {
        free(trace);
        free(draws);
        return report_error(report, STATUS_IO, "no memory for a trace");
    }
    if (info->draw_count)
        memcpy(draws, info->draws, info->draw_count * sizeof *draws);
    *trace = (struct trace){.report = report, .info = *info, .opened = opened};
    trace->info.draws = draws;
    *result = trace;
    return STATUS_OK;
}

void trace_close(trace *trace)
{
    if (!trace)
        return;
    if (trace->opened.form)
        trace->opened.form->close(trace->opened.self);
    free(trace->info.draws);
    free(trace->path);
    free(trace);
}

const trace_info *trace_get_info(const trace *trace)
{
    return &trace->info;
}

status trace_next(trace *trace, fragments *fragments)
{
    memset(fragments, 0, sizeof *fragments);
    if (trace->failed == STATUS_OK)
        trace->failed = trace->opened.form->next(trace->opened.self, fragments);
    return trace->failed;
}

status trace_rewind(trace *trace)
{
    trace->failed = trace->opened.form->rewind(trace->opened.self);
    return trace->failed;
}

static uint16_t at_most_size(uint32_t value)
{
    return (uint16_t)(value < TRACE_SIZE_MAX ? value : TRACE_SIZE_MAX);
}

void trace_select(trace *trace, uint32_t x0, uint32_t y0, uint32_t x1, uint32_t y1)
{
    bounds region = {at_most_size(x0), at_most_size(y0), at_most_size(x1), at_most_size(y1)};
    trace->opened.form->select(trace->opened.self, &region);
}

void trace_places_only(trace *trace, bool only)
{
    if (trace->opened.form->places)
        trace->opened.form->places(trace->opened.self, only);
}

status trace_check(const char *path, const report *report)
{
    trace *trace;
    status result = trace_open(path, report, &trace);
    uint64_t done = 0;
    while (result == STATUS_OK) {
        fragments run;
        result = trace_next(trace, &run);
        if (result != STATUS_OK || run.count == 0)
            break;
        done += run.count;
        report_progress(report, "checking", done, trace->info.fragment_count);
    }
    // The forms check this themselves, each in its way; a difference here would be our own bug.
    if (result == STATUS_OK && done != trace->info.fragment_count)
        result = report_error(report, STATUS_REFUSED, "%s: %" PRIu64 " fragments instead of %" PRIu64, path, done,
                              trace->info.fragment_count);
    trace_close(trace);
    return result;
}
