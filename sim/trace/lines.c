// Lines end with LF or CR LF; words are parted by blanks and tabs; `#` starts a comment. Other control bytes are
// refused, also in comments, and lines above 4096 bytes: a trace has none, and memory stays bounded.
#include "lines.h"

#include <errno.h>
#include <inttypes.h>
#include <stdarg.h>
#include <string.h>
#include <unistd.h>

void lines_begin(lines *lines, const char *path, int descriptor, const report *report)
{
    lines->path = path;
    lines->descriptor = descriptor;
    lines->report = report;
    lines->offset = lines->line = 0;
    lines->begin = lines->end = 0;
    lines->word_count = 0;
}

status lines_refuse(const lines *lines, int column, const char *format, ...)
{
    char message[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return report_error(lines->report, STATUS_REFUSED, "%s:%" PRIu64 ":%d: %s", lines->path, lines->line, column,
                        message);
}

int lines_end_column(const lines *lines)
{
    const word *last = &lines->words[lines->word_count - 1];
    return lines->word_count > 0 ? last->column + last->length : 1;
}

static status refill(lines *lines)
{
    ssize_t got;
    do
        got = pread(lines->descriptor, lines->buffer, sizeof lines->buffer, (off_t)lines->offset);
    while (got < 0 && errno == EINTR);
    if (got < 0)
        return report_error(lines->report, STATUS_IO, "%s: cannot be read: %s", lines->path, strerror(errno));
    lines->begin = 0;
    lines->end = (size_t)got;
    lines->offset += (uint64_t)got;
    return STATUS_OK;
}

// Copies the next line without its end to lines->text; *length is -1 at the end of the file.
static status take_line(lines *lines, int *length)
{
    size_t taken = 0;
    for (lines->line++;;) {
        if (lines->begin == lines->end) {
            status result = refill(lines);
            if (result != STATUS_OK)
                return result;
            if (lines->end == 0) {
                *length = taken > 0 ? (int)taken : -1;
                return STATUS_OK;
            }
        }
        const char *start = lines->buffer + lines->begin;
        const char *newline = memchr(start, '\n', lines->end - lines->begin);
        size_t size = newline ? (size_t)(newline - start) : lines->end - lines->begin;
        if (taken + size > LINE_MAX_BYTES)
            return lines_refuse(lines, LINE_MAX_BYTES + 1, "line of more than %d bytes", LINE_MAX_BYTES);
        memcpy(lines->text + taken, start, size);
        taken += size;
        lines->begin += size;
        if (newline) {
            lines->begin++;
            *length = (int)taken;
            return STATUS_OK;
        }
    }
}

static status split_words(lines *lines, int length)
{
    char *text = lines->text;
    if (length > 0 && text[length - 1] == '\r')
        length--;
    for (int i = 0; i < length; i++)
        if ((unsigned char)text[i] < ' ' && text[i] != '\t')
            return lines_refuse(lines, i + 1, "control byte 0x%02x, expected text", (unsigned char)text[i]);
    char *comment = memchr(text, '#', (size_t)length);
    if (comment)
        length = (int)(comment - text);
    text[length] = 0;
    lines->word_count = 0;
    for (int i = 0; i < length;) {
        if (text[i] == ' ' || text[i] == '\t') {
            text[i++] = 0;
            continue;
        }
        if (lines->word_count == WORDS_MAX)
            return lines_refuse(lines, i + 1, "more than %d words in a line", WORDS_MAX);
        word *word = &lines->words[lines->word_count++];
        *word = (struct word){text + i, 0, i + 1};
        while (i < length && text[i] != ' ' && text[i] != '\t')
            i++;
        word->length = i + 1 - word->column;
    }
    return STATUS_OK;
}

status lines_next(lines *lines)
{
    for (;;) {
        int length = -1;
        lines->word_count = 0;
        status result = take_line(lines, &length);
        if (result != STATUS_OK || length < 0)
            return result;
        result = split_words(lines, length);
        if (result != STATUS_OK || lines->word_count > 0)
            return result;
    }
}
