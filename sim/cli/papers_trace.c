// A scene to an open trace that has no name: no way of ending leaves one behind.
#include "papers.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void say_errors(void *user, severity severity, const char *text)
{
    (void)user;
    if (severity == SEVERITY_ERROR)
        command_report.say(command_report.user, severity, text);
}
const report paper_errors = {.say = say_errors};

status paper_folder_make(char folder[PAPER_FOLDER_SIZE])
{
    const char *parent = getenv("TMPDIR");
    snprintf(folder, PAPER_FOLDER_SIZE, "%s/ropsim-papers-XXXXXX", parent && *parent ? parent : "/tmp");
    if (mkdtemp(folder))
        return STATUS_OK;
    status status = report_error(&command_report, STATUS_IO, "%s: cannot be made: %s", folder, strerror(errno));
    folder[0] = 0;
    return status;
}

status paper_trace_record(const char *folder, const char *scene, const record_options *options, trace **trace)
{
    char path[PAPER_FOLDER_SIZE + 16];
    *trace = NULL;
    snprintf(path, sizeof path, "%s/trace.ropt", folder);
    status status = record_scenes(&scene, 1, options, path, &paper_errors);
    if (status == STATUS_OK)
        status = trace_open(path, &command_report, trace);
    unlink(path);
    return status;
}
