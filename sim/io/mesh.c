// A mesh file to triangles: checked, read, triangulated in fan order, with normals for shading.
#include "../sim.h"
#include "mesh_check.h"
#include "mesh_reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void polygon_soup_clear(polygon_soup *soup)
{
    free(soup->positions);
    free(soup->normals);
    free(soup->vertex_colors);
    free(soup->face_colors);
    free(soup->corners);
    free(soup->face_ends);
    *soup = (polygon_soup){0};
}

void mesh_destroy(mesh *mesh)
{
    if (!mesh)
        return;
    free(mesh->positions);
    free(mesh->triangles);
    free(mesh->face_of_triangle);
    free(mesh->vertex_normals);
    free(mesh->vertex_colors);
    free(mesh->face_colors);
    free(mesh);
}

static bool finite_position(const float position[3])
{
    return isfinite(position[0]) && isfinite(position[1]) && isfinite(position[2]);
}

// Three corners or more, all of them there.
static bool usable_face(const polygon_soup *soup, uint64_t first, uint64_t end)
{
    for (uint64_t i = first; i < end; i++)
        if (soup->corners[i] >= soup->vertex_count || !finite_position(soup->positions[soup->corners[i]]))
            return false;
    return end - first >= 3;
}

static status triangulate(const char *path, const polygon_soup *soup, const report *report, mesh *mesh)
{
    uint64_t first = 0, triangles = 0;
    for (uint32_t f = 0; f < soup->face_count; first = soup->face_ends[f++]) {
        if (usable_face(soup, first, soup->face_ends[f]))
            triangles += soup->face_ends[f] - first - 2;
        else
            mesh->dropped_faces++;
    }
    if (triangles >= UINT32_MAX)
        return report_error(report, STATUS_REFUSED, "%s: more than 2^32 triangles", path);
    mesh->triangles = calloc(triangles + 1, sizeof *mesh->triangles);
    mesh->face_of_triangle = calloc(triangles + 1, sizeof *mesh->face_of_triangle);
    if (soup->face_colors)
        mesh->face_colors = calloc(triangles + 1, sizeof *mesh->face_colors);
    if (!mesh->triangles || !mesh->face_of_triangle || (soup->face_colors && !mesh->face_colors))
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    first = 0;
    for (uint32_t f = 0; f < soup->face_count; first = soup->face_ends[f++]) {
        if (!usable_face(soup, first, soup->face_ends[f]))
            continue;
        for (uint64_t i = first + 2; i < soup->face_ends[f]; i++) {
            uint32_t t = mesh->triangle_count++;
            mesh->triangles[t][0] = soup->corners[first];
            mesh->triangles[t][1] = soup->corners[i - 1];
            mesh->triangles[t][2] = soup->corners[i];
            mesh->face_of_triangle[t] = f;
            if (soup->face_colors)
                memcpy(mesh->face_colors[t], soup->face_colors[f], sizeof *mesh->face_colors);
        }
    }
    return STATUS_OK;
}

// The sum of the adjacent triangles' normals weighted by area, of unit length; zero where there is none.
static void compute_normals(mesh *mesh)
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *corners = mesh->triangles[t];
        double edges[2][3];
        for (int i = 0; i < 3; i++) {
            edges[0][i] = (double)mesh->positions[corners[1]][i] - (double)mesh->positions[corners[0]][i];
            edges[1][i] = (double)mesh->positions[corners[2]][i] - (double)mesh->positions[corners[0]][i];
        }
        for (int i = 0; i < 3; i++) {
            int j = (i + 1) % 3, k = (i + 2) % 3;
            double component = edges[0][j] * edges[1][k] - edges[0][k] * edges[1][j];
            for (int corner = 0; corner < 3; corner++)
                mesh->vertex_normals[corners[corner]][i] += (float)component;
        }
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        float *normal = mesh->vertex_normals[v];
        double length = sqrt((double)normal[0] * (double)normal[0] + (double)normal[1] * (double)normal[1] +
                             (double)normal[2] * (double)normal[2]);
        for (int i = 0; i < 3; i++)
            normal[i] = length > 0 && isfinite(length) ? (float)((double)normal[i] / length) : 0;
    }
}

// Colours outside [0, 1] or not finite are brought into it; true if some alpha is below 1.
static bool tidy_colors(float (*colors)[4], uint32_t count)
{
    bool alpha = false;
    for (uint32_t i = 0; colors && i < count; i++) {
        for (int c = 0; c < 4; c++)
            colors[i][c] = colors[i][c] > 0 ? (colors[i][c] < 1 ? colors[i][c] : 1) : 0;
        alpha = alpha || colors[i][3] < 1;
    }
    return alpha;
}

static status build(const char *path, const mesh_promise *promise, polygon_soup *soup, const report *report, mesh *mesh)
{
    status result = triangulate(path, soup, report, mesh);
    if (result)
        return result;
    mesh->face_count = (uint32_t)promise->faces;
    mesh->dropped_faces += mesh->face_count - soup->face_count;
    mesh->vertex_count = soup->vertex_count;
    mesh->positions = soup->positions;
    mesh->vertex_normals = soup->normals;
    mesh->vertex_colors = soup->vertex_colors;
    soup->positions = soup->normals = NULL;
    soup->vertex_colors = NULL;
    if (!mesh->vertex_normals) {
        mesh->vertex_normals = calloc((size_t)mesh->vertex_count + 1, sizeof *mesh->vertex_normals);
        if (!mesh->vertex_normals)
            return report_error(report, STATUS_IO, "%s: out of memory", path);
        compute_normals(mesh);
    }
    bool vertex_alpha = tidy_colors(mesh->vertex_colors, mesh->vertex_count),
         face_alpha = tidy_colors(mesh->face_colors, mesh->triangle_count);
    mesh->colors_have_alpha = vertex_alpha || face_alpha;
    if (mesh->dropped_faces)
        report_warning(report,
                       "%s: left out %u of %u faces: fewer than three corners (in OBJ and STL: that differ), or a "
                       "corner that is not there or not finite",
                       path, mesh->dropped_faces, mesh->face_count);
    if (mesh->vertex_colors && mesh->face_colors)
        report_warning(report, "%s: has colours of faces and of vertices; those of the faces are shown", path);
    if (!mesh->triangle_count)
        return report_error(report, STATUS_REFUSED, "%s: has no face to draw", path);
    return STATUS_OK;
}

status mesh_load(const char *path, const report *report, mesh **loaded)
{
    *loaded = NULL;
    mesh_promise promise;
    status result = mesh_check(path, report, &promise);
    if (result)
        return result;
    polygon_soup soup;
    char reason[256];
    if (!mesh_read_polygons(path, promise.file_bytes, &soup, reason, sizeof reason))
        return report_error(report, STATUS_REFUSED, "%s: %s", path, reason);
    if (promise.vertices != UINT64_MAX && soup.vertex_count != promise.vertices)
        result = report_error(report, STATUS_REFUSED, "%s: damaged: %llu vertices are announced, %u can be read", path,
                              (unsigned long long)promise.vertices, soup.vertex_count);
    else if (promise.skips_faces ? soup.face_count > promise.faces : soup.face_count != promise.faces)
        result = report_error(report, STATUS_REFUSED, "%s: damaged: %llu faces are announced, %u can be read", path,
                              (unsigned long long)promise.faces, soup.face_count);
    mesh *mesh = result ? NULL : calloc(1, sizeof *mesh);
    if (!mesh && !result)
        result = report_error(report, STATUS_IO, "%s: out of memory", path);
    if (!result)
        result = build(path, &promise, &soup, report, mesh);
    polygon_soup_clear(&soup);
    if (result)
        mesh_destroy(mesh);
    else
        *loaded = mesh;
    return result;
}
