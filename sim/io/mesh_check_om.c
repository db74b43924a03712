// OM, OpenMesh's own format, version 2: a header, then chunks that are walked to the last. OpenMesh stops the
// process at a chunk that it does not expect, so only those are let through whose shape it is known to take.
#include "mesh_check.h"

#include <string.h>

enum { HEADER_BYTES = 16, CHUNK_HEADER_BYTES = 2, BITS_SHIFT = 14 };

typedef enum per { PER_VERTEX, PER_FACE, PER_HALFEDGE, PER_COUNT } per;

// A chunk header without its two bits for the size of integers, and the bytes of an element. Topology's integers
// have 1, 2, 4 or 8 bytes by those bits.
static const struct {
    uint16_t code;
    per per;
    int bytes;
    bool integers;
} chunks[] = {
    // positions
    {0x1600, PER_VERTEX, 12, false},
    // normals
    {0x1620, PER_VERTEX, 12, false},
    {0x1628, PER_FACE, 12, false},
    // texture coordinates
    {0x0e40, PER_VERTEX, 8, false},
    // colours
    {0x1080, PER_VERTEX, 3, false},
    {0x1088, PER_FACE, 3, false},
    // topology: a half-edge; a half-edge; next, vertex and face
    {0x06e0, PER_VERTEX, 1, true},
    {0x06e8, PER_FACE, 1, true},
    {0x16f8, PER_HALFEDGE, 3, true},
};
enum { CODE_POSITIONS = 0x1600, CODE_END = 0x001c };

static uint32_t word_at(const unsigned char *data)
{
    return data[0] | (uint32_t)data[1] << 8 | (uint32_t)data[2] << 16 | (uint32_t)data[3] << 24;
}

// Bytes behind a chunk header; UINT64_MAX if it is none that is let through.
static uint64_t chunk_bytes(uint16_t header, const uint64_t counts[PER_COUNT])
{
    for (size_t i = 0; i < sizeof chunks / sizeof *chunks; i++) {
        uint16_t code = chunks[i].integers ? header & ((1 << BITS_SHIFT) - 1) : header;
        if (code == chunks[i].code)
            return counts[chunks[i].per] * (uint64_t)chunks[i].bytes << (chunks[i].integers ? header >> BITS_SHIFT : 0);
    }
    return UINT64_MAX;
}

static status walk_chunks(const mesh_bytes *file, const uint64_t counts[PER_COUNT])
{
    for (size_t at = HEADER_BYTES;;) {
        if (file->size - at < CHUNK_HEADER_BYTES)
            return report_error(file->report, STATUS_REFUSED, "%s: byte %zu: the file ends early", file->path, at);
        uint16_t header = (uint16_t)(file->data[at] | file->data[at + 1] << 8);
        if (header == CODE_END)
            return STATUS_OK;
        uint64_t bytes = chunk_bytes(header, counts);
        if (bytes == UINT64_MAX || (at == HEADER_BYTES && header != CODE_POSITIONS))
            return report_error(file->report, STATUS_REFUSED,
                                "%s: byte %zu: a chunk of kind %#x, which is not read here; write the mesh as PLY",
                                file->path, at, (unsigned)header);
        at += CHUNK_HEADER_BYTES;
        if (file->size - at < bytes)
            return report_error(file->report, STATUS_REFUSED, "%s: byte %zu: the file ends within this chunk",
                                file->path, at);
        at += bytes;
    }
}

// "OM", kind of mesh, version, then three little-endian counts.
status mesh_check_om(const mesh_bytes *file, mesh_promise *promise)
{
    if (file->size < HEADER_BYTES || memcmp(file->data, "OM", 2) != 0 || !strchr("TQP", file->data[2]) ||
        file->data[3] >> 5 != 2)
        return report_error(file->report, STATUS_REFUSED, "%s: does not begin as an OM file of version 2 does",
                            file->path);
    uint64_t vertices = word_at(file->data + 4), faces = word_at(file->data + 8), edges = word_at(file->data + 12);
    if (!vertices || !faces || vertices > file->size || faces > file->size || edges > file->size)
        return report_error(
            file->report, STATUS_REFUSED, "%s: byte 4: announces %llu vertices, %llu faces and %llu edges in %zu bytes",
            file->path, (unsigned long long)vertices, (unsigned long long)faces, (unsigned long long)edges, file->size);
    promise->vertices = vertices;
    promise->faces = faces;
    return walk_chunks(file, (const uint64_t[PER_COUNT]){vertices, faces, 2 * edges});
}
