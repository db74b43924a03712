// A test file as lines of words. Words end at blanks; "..." is one word; # starts a comment outside quotes.
// Inline traces and programs are taken as they stand, since their own readers judge them.
#include "rtest.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

static status read_all(FILE *file, const char *path, const report *report, char **bytes, size_t *size)
{
    size_t room = 4096;
    *size = 0;
    *bytes = malloc(room + 1);
    while (*bytes) {
        *size += fread(*bytes + *size, 1, room - *size, file);
        if (ferror(file))
            return report_error(report, STATUS_IO, "%s: could not be read: %s", path, strerror(errno));
        if (*size < room)
            return STATUS_OK;
        if (room == RTEST_BYTES_MAX)
            return report_error(report, STATUS_REFUSED, "%s: more than %d bytes", path, RTEST_BYTES_MAX);
        room *= 4;
        char *grown = realloc(*bytes, room + 1);
        if (!grown)
            break;
        *bytes = grown;
    }
    return report_error(report, STATUS_IO, "%s: out of memory", path);
}

status rtest_load(const char *path, const report *report, rtest_text *text)
{
    *text = (rtest_text){.path = path, .report = report};
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    status status = read_all(file, path, report, &text->bytes, &text->size);
    fclose(file);
    if (status != STATUS_OK)
        return status;
    text->bytes[text->size] = 0;
    text->scratch = malloc(text->size + 1);
    if (!text->scratch)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    memcpy(text->scratch, text->bytes, text->size + 1);
    const char *nul = memchr(text->bytes, 0, text->size);
    return nul ? report_error(report, STATUS_REFUSED, "%s: byte %zu is 0, expected text", path,
                              (size_t)(nul - text->bytes))
               : STATUS_OK;
}

void rtest_unload(rtest_text *text)
{
    free(text->bytes);
    free(text->scratch);
    text->bytes = text->scratch = NULL;
}

status rtest_refuse(const rtest_text *text, int column, const char *format, ...)
{
    char message[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    if (column == 0 && text->word_count > 0)
        column = text->words[text->word_count - 1].column + text->words[text->word_count - 1].length;
    return report_error(text->report, STATUS_REFUSED, "%s:%d:%d: %s", text->path, text->line ? text->line : 1,
                        column ? column : 1, message);
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

// The word at `at`; moves `at` behind it.
static status take_word(rtest_text *text, size_t begin, size_t end, size_t *at)
{
    char *scratch = text->scratch;
    size_t first = *at, last = first;
    const bool quoted = scratch[first] == '"';
    if (text->word_count == RTEST_WORDS_MAX)
        return rtest_refuse(text, (int)(first - begin) + 1, "more than %d words in a line", RTEST_WORDS_MAX);
    if (quoted) {
        for (last++; last < end && scratch[last] != '"'; last++)
            ;
        if (last == end)
            return rtest_refuse(text, (int)(first - begin) + 1, "the quote is not closed in this line");
        *at = last + 1;
    } else {
        while (last < end && !is_blank(scratch[last]) && scratch[last] != '#' && scratch[last] != '"')
            last++;
        *at = last;
    }
    text->words[text->word_count++] =
        (rtest_word){scratch + first + quoted, first, (int)(*at - first), (int)(first - begin) + 1};
    return STATUS_OK;
}

static status split_words(rtest_text *text, size_t begin, size_t end)
{
    text->word_count = 0;
    for (size_t at = begin; at < end;) {
        if (is_blank(text->scratch[at])) {
            at++;
            continue;
        }
        if (text->scratch[at] == '#')
            break;
        const status status = take_word(text, begin, end, &at);
        if (status != STATUS_OK)
            return status;
    }
    // Only now: an end may be the next word's beginning.
    for (int i = 0; i < text->word_count; i++) {
        const rtest_word *word = &text->words[i];
        const bool quoted = text->bytes[word->at] == '"';
        text->scratch[word->at + (size_t)word->length - quoted] = 0;
    }
    return STATUS_OK;
}

status rtest_next_line(rtest_text *text)
{
    text->word_count = 0;
    while (text->next < text->size && text->word_count == 0) {
        const char *newline = memchr(text->bytes + text->next, '\n', text->size - text->next);
        const size_t begin = text->next, end = newline ? (size_t)(newline - text->bytes) : text->size;
        text->next = newline ? end + 1 : end;
        text->line++;
        const status status = split_words(text, begin, end);
        if (status != STATUS_OK)
            return status;
    }
    return STATUS_OK;
}

status rtest_take_section(rtest_text *text, const char *word, size_t *begin, size_t *end)
{
    const rtest_text start = *text;
    *begin = text->next;
    for (;;) {
        *end = text->next;
        // Lines of the section may have anything in them, so words are looked at by hand.
        if (text->next >= text->size)
            return rtest_refuse(&start, 1, "`%s` without its `end %s`", word, word);
        const char *newline = memchr(text->bytes + text->next, '\n', text->size - text->next);
        const char *at = text->bytes + text->next, *stop = newline ? newline : text->bytes + text->size;
        text->next = (size_t)(stop - text->bytes) + (newline != NULL);
        text->line++;
        while (at < stop && is_blank(*at))
            at++;
        if (stop - at < 4 || strncmp(at, "end", 3) != 0 || !is_blank(at[3]))
            continue;
        at += 4;
        while (at < stop && is_blank(*at))
            at++;
        const size_t length = strlen(word);
        if ((size_t)(stop - at) < length || strncmp(at, word, length) != 0)
            continue;
        at += length;
        if (at == stop || is_blank(*at) || *at == '#')
            return STATUS_OK;
    }
}

status rtest_read_uint(const rtest_text *text, int word, uint64_t max, uint64_t *value)
{
    if (word >= text->word_count)
        return rtest_refuse(text, 0, "an integer is missing");
    const char *digits = text->words[word].text;
    errno = 0;
    char *end;
    const unsigned long long number = strtoull(digits, &end, 10);
    if (digits[0] < '0' || digits[0] > '9' || *end || errno || number > max)
        return rtest_refuse(text, text->words[word].column, "`%.40s`, expected an integer from 0 to %llu", digits,
                            (unsigned long long)max);
    *value = number;
    return STATUS_OK;
}

status rtest_read_double(const rtest_text *text, int word, double *value)
{
    if (word >= text->word_count)
        return rtest_refuse(text, 0, "a number is missing");
    const char *digits = text->words[word].text;
    char *end;
    *value = strtod(digits, &end);
    if (end == digits || *end)
        return rtest_refuse(text, text->words[word].column, "`%.40s`, expected a number", digits);
    return STATUS_OK;
}

void rtest_unescape(rtest_text *text, int word)
{
    char *from = text->scratch + (text->words[word].text - text->scratch), *to = from;
    for (; *from; from++) {
        const bool newline = from[0] == '\\' && from[1] == 'n';
        *to++ = newline ? '\n' : *from;
        from += newline;
    }
    *to = 0;
}

void *rtest_add(void *array, int *count, size_t size)
{
    const size_t used = (size_t)*count;
    char *elements;
    memcpy(&elements, array, sizeof elements);
    // Room doubles: it is full where the count is a power of two.
    if ((used & (used - 1)) == 0) {
        elements = realloc(elements, (used ? 2 * used : 1) * size);
        if (!elements)
            return NULL;
        memcpy(array, &elements, sizeof elements);
    }
    ++*count;
    return memset(elements + used * size, 0, size);
}
