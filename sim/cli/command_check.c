// `ropsim check`: reads every byte of a trace and checks every rule. Says what it found in one line.
#include "command.h"

#include <inttypes.h>

static const command_option options[] = {{0}};

int command_check(int argc, char **argv)
{
    const char *path = NULL;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (path)
            return (int)command_usage("check", "one trace at a time");
        path = line.value;
    }
    if (!path)
        return (int)command_usage("check", "no trace was named");
    trace *trace = NULL;
    trace_summary summary;
    status result = trace_check(path, &command_report);
    if (result == STATUS_OK)
        result = trace_open(path, &command_report, &trace);
    if (result == STATUS_OK)
        result = trace_summarize(trace, &command_report, &summary);
    if (result == STATUS_OK) {
        const trace_info *info = trace_get_info(trace);
        if (summary.depth_outside > 0)
            report_warning(&command_report,
                           "%s: %" PRIu64 " fragments have a depth outside 0 to 1; the ROP clamps them", path,
                           summary.depth_outside);
        printf("%s: holds, %u x %u pixels, %u draws, %" PRIu64 " fragments, hash %s\n", path, info->width, info->height,
               info->draw_count, info->fragment_count, info->hash);
    }
    trace_close(trace);
    return (int)result;
}
