// STL and OM: sizes against the counts that they open with.
#include "mesh_check.h"

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

// Text opens with "solid", but so do some binary files: what has the size of a binary file is one.
status mesh_check_stl(const mesh_bytes *file, mesh_promise *promise)
{
    enum { HEADER_BYTES = 84, TRIANGLE_BYTES = 50 };
    uint64_t triangles = file->size >= HEADER_BYTES ? word_at(file->data + 80) : 0;
    bool solid = file->size > 5 && memcmp(file->data, "solid", 5) == 0;
    bool binary = file->size >= HEADER_BYTES && file->size == HEADER_BYTES + triangles * TRIANGLE_BYTES;
    if (!binary && !solid)
        return report_error(file->report, STATUS_REFUSED, "%s: %zu bytes, but a binary STL file of %llu triangles has %llu", file->path, file->size,
            (unsigned long long)triangles, (unsigned long long)(HEADER_BYTES + triangles * TRIANGLE_BYTES));
    promise->faces = triangles;
    if (!binary) {
        uint64_t facets = count_text(file, "facet normal");
        uint64_t ends = count_text(file, "endfacet");
        if (facets != ends || facets == 0 || count_text(file, "endsolid") == 0 || count_text(file, "vertex") != 3 * facets)
            return report_error(file->report, STATUS_REFUSED, "%s: cut short: %llu facets begin, %llu end, and endsolid must follow", file->path,
                (unsigned long long)facets, (unsigned long long)ends);
        promise->faces = facets;
    }
    if (!promise->faces)
        return report_error(file->report, STATUS_REFUSED, "%s: has no face to draw", file->path);
    return STATUS_OK;
}

// "OM", kind of mesh, version, then three little-endian counts.
status mesh_check_om(const mesh_bytes *file, mesh_promise *promise)
{
    enum { HEADER_BYTES = 16, VERTEX_BYTES = 12 };
    if (file->size < HEADER_BYTES || memcmp(file->data, "OM", 2) != 0)
        return report_error(file->report, STATUS_REFUSED, "%s: does not begin as an OM file does", file->path);
    promise->vertices = word_at(file->data + 4);
    promise->faces = word_at(file->data + 8);
    uint64_t edges = word_at(file->data + 12);
    if (!promise->vertices || !promise->faces || promise->vertices * VERTEX_BYTES + promise->faces + edges > file->size)
        return report_error(file->report, STATUS_REFUSED, "%s: byte 4: announces %llu vertices, %llu faces and %llu edges in %zu bytes", file->path,
            (unsigned long long)promise->vertices, (unsigned long long)promise->faces, (unsigned long long)edges, file->size);
    return STATUS_OK;
}
