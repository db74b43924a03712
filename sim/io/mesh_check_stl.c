// STL: the size against the count that a binary file opens with, or the words of a text.
#include "mesh_check.h"

#include <ctype.h>
#include <string.h>

static uint32_t word_at(const unsigned char *data)
{
    return data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 | (uint32_t)data[3] << 24;
}

static uint64_t count_text(const mesh_bytes *file, const char *word)
{
    const unsigned char *at = file->data, *end = at + file->size;
    size_t size = strlen(word);
    uint64_t count = 0;
    while ((at = memmem(at, (size_t)(end - at), word, size)) != NULL) {
        count++;
        at += size;
    }
    return count;
}

// The last line of a whole text file; names may follow.
static bool ends_with_endsolid(const mesh_bytes *file)
{
    const char *text = (const char *)file->data;
    size_t end = file->size;
    while (end && isspace((unsigned char)text[end - 1]))
        end--;
    const char *line = end ? memrchr(text, '\n', end) : NULL;
    line = line ? line + 1 : text;
    while (line < text + end && isspace((unsigned char)*line))
        line++;
    return (size_t)(text + end - line) >= 8 && memcmp(line, "endsolid", 8) == 0;
}

// Text opens with "solid", but so do some binary files: what has the size of a binary file is one.
status mesh_check_stl(const mesh_bytes *file, mesh_promise *promise)
{
    enum { HEADER_BYTES = 84, TRIANGLE_BYTES = 50 };
    uint64_t triangles = file->size >= HEADER_BYTES ? word_at(file->data + 80) : 0;
    bool solid = file->size > 5 && memcmp(file->data, "solid", 5) == 0;
    bool binary = file->size >= HEADER_BYTES && file->size == HEADER_BYTES + triangles * TRIANGLE_BYTES;
    if (!binary && !solid)
        return report_error(
            file->report, STATUS_REFUSED, "%s: %zu bytes, but a binary STL file of %llu triangles has %llu", file->path,
            file->size, (unsigned long long)triangles, (unsigned long long)(HEADER_BYTES + triangles * TRIANGLE_BYTES));
    promise->faces = triangles;
    if (!binary) {
        promise->faces = count_text(file, "endfacet");
        if (!ends_with_endsolid(file) || count_text(file, "endloop") != promise->faces ||
            count_text(file, "vertex") < 3 * promise->faces)
            return report_error(file->report, STATUS_REFUSED,
                                "%s: cut short or damaged: each facet needs three vertices, endloop and endfacet, and "
                                "endsolid must follow",
                                file->path);
    }
    promise->skips_faces = true;
    if (!promise->faces)
        return report_error(file->report, STATUS_REFUSED, "%s: has no face to draw", file->path);
    return STATUS_OK;
}
