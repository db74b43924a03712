// What a run says, kept for `expect error` and for failures. Places in the temporary file of an inline trace are told
// as places in the test file.
#include "rtest.h"

#include <stdlib.h>
#include <string.h>

// "TEMPORARY:12:5: text" to "TEST:40:5: text" if it begins so.
static bool translate(const rtest_messages *messages, const char *text, FILE *out)
{
    const size_t length = messages->temporary_path ? strlen(messages->temporary_path) : 0;
    if (length == 0 || strncmp(text, messages->temporary_path, length) != 0 || text[length] != ':')
        return false;
    char *end;
    const long line = strtol(text + length + 1, &end, 10);
    const bool known = *end == ':' && line >= 1 && line <= messages->source_line_count;
    if (known)
        fprintf(out, "%s:%d%s", messages->test_path, messages->source_lines[line - 1], end);
    else
        fprintf(out, "%s%s", messages->test_path, text + length);
    return true;
}

static void keep(void *user, severity severity, const char *text)
{
    static const char *const titles[] = {"error: ", "warning: ", "note: "};
    rtest_messages *messages = user;
    const size_t used = strlen(messages->text);
    FILE *out =
        used + 1 < sizeof messages->text ? fmemopen(messages->text + used, sizeof messages->text - used, "w") : NULL;
    messages->warned |= severity == SEVERITY_WARNING;
    if (!out)
        return;
    fputs(titles[severity], out);
    if (!translate(messages, text, out))
        fputs(text, out);
    fputc('\n', out);
    fclose(out);
    messages->text[sizeof messages->text - 1] = 0;
}

void rtest_messages_start(rtest_messages *messages, const char *test_path)
{
    *messages = (rtest_messages){.test_path = test_path};
    messages->report = (report){.say = keep, .user = messages};
}
