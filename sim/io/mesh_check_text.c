// OBJ and OFF: lines are counted, since a file cut short still reads as a smaller mesh.
#include "mesh_check.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct text {
    const mesh_bytes *file;
    const char *at, *end;
    unsigned long long line;
} text;

static text text_of(const mesh_bytes *file)
{
    const char *start = (const char *)file->data;
    return (text){file, start, start + file->size, 0};
}

// The next line without its comment and line end; false at the end of the file.
static bool next_line(text *text, const char **line, size_t *size)
{
    if (text->at >= text->end)
        return false;
    const char *end = memchr(text->at, '\n', (size_t)(text->end - text->at));
    end = end ? end : text->end;
    const char *comment = memchr(text->at, '#', (size_t)(end - text->at));
    *line = text->at;
    *size = (size_t)((comment ? comment : end) - text->at);
    text->at = end + 1;
    text->line++;
    return true;
}

static int count_words(const char *line, size_t size)
{
    int count = 0;
    for (size_t i = 0; i < size; i++)
        count += !isspace((unsigned char)line[i]) && (i == 0 || isspace((unsigned char)line[i - 1]));
    return count;
}

// Whether the first `count` words are finite numbers. The line ends with the file or in a space of some kind.
static bool are_numbers(const char *line, size_t size, int count)
{
    const char *at = line, *end = line + size;
    for (int i = 0; i < count; i++) {
        char word[64];
        while (at < end && isspace((unsigned char)*at))
            at++;
        size_t length = 0;
        for (; at < end && !isspace((unsigned char)*at) && length < sizeof word - 1; at++)
            word[length++] = *at;
        word[length] = 0;
        char *rest;
        if (!length || !isfinite(strtod(word, &rest)) || *rest)
            return false;
    }
    return true;
}

static status refuse(const text *text, const char *reason)
{
    return report_error(text->file->report, STATUS_REFUSED, "%s:%llu: %s", text->file->path, text->line, reason);
}

status mesh_check_obj(const mesh_bytes *file, mesh_promise *promise)
{
    text text = text_of(file);
    const char *line;
    size_t size;
    promise->vertices = promise->faces = 0;
    promise->skips_faces = true;
    if (memchr(file->data, 0, file->size))
        return refuse(&text, "an OBJ file is text; this one has bytes of zero");
    while (next_line(&text, &line, &size)) {
        while (size && isspace((unsigned char)*line)) {
            line++;
            size--;
        }
        if (size < 2 || !isspace((unsigned char)line[1]))
            continue;
        int words = count_words(line, size);
        if (line[0] == 'v') {
            promise->vertices++;
            if (words < 4 || !are_numbers(line + 1, size - 1, 3))
                return refuse(&text, "a vertex has three coordinates, finite numbers");
        } else if (line[0] == 'f') {
            promise->faces++;
            if (words < 4)
                return refuse(&text, "a face has at least three corners");
        }
    }
    return promise->faces ? STATUS_OK : refuse(&text, "there is no face");
}

// An unsigned number at *at, which moves behind it; UINT64_MAX if there is none.
static uint64_t take_number(const char **at, const char *end)
{
    while (*at < end && isspace((unsigned char)**at))
        ++*at;
    if (*at >= end || !isdigit((unsigned char)**at))
        return UINT64_MAX;
    uint64_t number = 0;
    for (; *at < end && isdigit((unsigned char)**at); ++*at)
        if (number < UINT64_C(1) << 40)
            number = number * 10 + (uint64_t)(**at - '0');
    return number;
}

// The next line that holds something.
static bool next_content(text *text, const char **line, size_t *size)
{
    while (next_line(text, line, size))
        if (count_words(*line, *size))
            return true;
    return false;
}

// [ST][C][N]OFF, counts, a line a vertex, a line a face.
status mesh_check_off(const mesh_bytes *file, mesh_promise *promise)
{
    enum { OFF_VERTEX_WORDS_MAX = 3 + 3 + 4 + 2 };
    text text = text_of(file);
    const char *line;
    size_t size;
    if (!next_content(&text, &line, &size))
        return refuse(&text, "the file is empty");
    size_t name = 0;
    while (name < size && isalnum((unsigned char)line[name]))
        name++;
    if (name < 3 || memcmp(line + name - 3, "OFF", 3) != 0 || strspn(line, "STCNOF") < name)
        return refuse(&text, "an OFF file begins with OFF, COFF, NOFF or CNOFF");
    if (memchr(file->data, 0, file->size) || count_words(line + name, size - name) == 1)
        return refuse(&text, "binary OFF files are not read; write it as text or as PLY");
    const char *at = line + name, *end = line + size;
    if (!count_words(at, (size_t)(end - at))) {
        if (!next_content(&text, &line, &size))
            return refuse(&text, "the counts are missing");
        at = line;
        end = line + size;
    }
    promise->vertices = take_number(&at, end);
    promise->faces = take_number(&at, end);
    if (promise->vertices > file->size || promise->faces > file->size || !promise->vertices || !promise->faces)
        return refuse(&text, "the counts are no numbers, are 0, or are more than the file can hold");
    for (uint64_t i = 0; i < promise->vertices; i++) {
        if (!next_content(&text, &line, &size))
            return refuse(&text, "the file ends within its vertices");
        int words = count_words(line, size);
        if (words > OFF_VERTEX_WORDS_MAX || !are_numbers(line, size, words > 3 ? words : 3))
            return refuse(
                &text,
                "a vertex has three coordinates, a normal, a colour and a texture coordinate at most, finite numbers");
    }
    for (uint64_t i = 0; i < promise->faces; i++) {
        if (!next_content(&text, &line, &size))
            return refuse(&text, "the file ends within its faces");
        at = line;
        uint64_t corners = take_number(&at, line + size);
        int words = count_words(at, (size_t)(line + size - at));
        if (corners > file->size || (uint64_t)words < corners || (uint64_t)words > corners + 4 ||
            !are_numbers(at, (size_t)(line + size - at), words))
            return refuse(&text, "a face names fewer corners than it announces, or has what is no number or no colour");
    }
    return STATUS_OK;
}
