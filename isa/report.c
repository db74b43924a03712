// Messages go in as printf formats and out through the caller's callback.
#include "isa.h"

#include <stdarg.h>

enum { MESSAGE_SIZE = 4096 };

static void say(const report *report, severity severity, const char *format, va_list arguments)
{
    if (!report || !report->say)
        return;
    char text[MESSAGE_SIZE];
    vsnprintf(text, sizeof text, format, arguments);
    report->say(report->user, severity, text);
}

status report_error(const report *report, status result, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(report, SEVERITY_ERROR, format, arguments);
    va_end(arguments);
    return result;
}

void report_warning(const report *report, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say(report, SEVERITY_WARNING, format, arguments);
    va_end(arguments);
}

void report_progress(const report *report, const char *what, uint64_t done, uint64_t total)
{
    if (report && report->progress)
        report->progress(report->user, what, done, total);
}
