// A look at a mesh file before OpenMesh reads it: its readers loop, or allocate, without bound on hostile
// counts, and take truncated files for shorter ones.
#ifndef ROPSIM_MESH_CHECK_H
#define ROPSIM_MESH_CHECK_H

#include "../sim.h"

// What the file says it holds. STL does not say how many vertices: UINT64_MAX.
typedef struct mesh_promise {
    uint64_t vertices, faces;
    bool skips_faces;     // OpenMesh's reader leaves out faces that repeat a corner
    uint64_t file_bytes;  // more vertices, faces or corners than this cannot be
} mesh_promise;

// Refuses, with file, place and reason, a file that is not whole or cannot be what its ending says.
status mesh_check(const char *path, const report *report, mesh_promise *promise);

// The file's bytes, for the checks of one format each.
typedef struct mesh_bytes {
    const char *path;
    const report *report;
    const unsigned char *data;
    size_t size;
} mesh_bytes;

status mesh_check_ply(const mesh_bytes *file, mesh_promise *promise);
status mesh_check_obj(const mesh_bytes *file, mesh_promise *promise);
status mesh_check_off(const mesh_bytes *file, mesh_promise *promise);
status mesh_check_stl(const mesh_bytes *file, mesh_promise *promise);
status mesh_check_om(const mesh_bytes *file, mesh_promise *promise);

#endif
