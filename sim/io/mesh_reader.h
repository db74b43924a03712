// The seam between the mesh loader (C) and the shim over OpenMesh (C++), and the loader's own steps.
#ifndef ROPSIM_MESH_READER_H
#define ROPSIM_MESH_READER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// A polygon soup as the file has it, nothing checked but the counts. Arrays are malloc'ed.
typedef struct polygon_soup {
    float (*positions)[3];
    float (*normals)[3];        // NULL if the file has none
    float (*vertex_colors)[4];  // NULL if the file has none; straight, in [0, 1]
    float (*face_colors)[4];    // NULL if the file has none
    uint32_t *corners;          // vertex numbers of all faces one after the other; may be out of range
    uint64_t *face_ends;        // where each face's corners end
    uint32_t vertex_count, face_count;
} polygon_soup;

// Reads a mesh file with OpenMesh's reader of its ending. Thread-safe. At most `limit` vertices, faces and corners
// are taken before it gives up. False: `reason` says why and the soup is empty.
bool mesh_read_polygons(const char *path, uint64_t limit, polygon_soup *soup, char *reason, size_t reason_size);
void polygon_soup_clear(polygon_soup *soup);

#ifdef __cplusplus
}
#endif
#endif
