// The list of draws that a recording consists of.
#include "raster.h"

#include <ctype.h>
#include <stdlib.h>

mesh *mesh_allocate(uint32_t vertices, uint32_t triangles)
{
    mesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh)
        return NULL;
    mesh->vertex_count = vertices;
    mesh->triangle_count = mesh->face_count = triangles;
    mesh->positions = calloc(vertices, sizeof *mesh->positions);
    mesh->vertex_normals = calloc(vertices, sizeof *mesh->vertex_normals);
    mesh->vertex_colors = calloc(vertices, sizeof *mesh->vertex_colors);
    mesh->triangles = calloc(triangles, sizeof *mesh->triangles);
    if (mesh->positions && mesh->vertex_normals && mesh->vertex_colors && mesh->triangles)
        return mesh;
    mesh_destroy(mesh);
    return NULL;
}

status model_add(model_list *list, const char *name, draw_class class, mesh *mesh, const report *report, model **added)
{
    model *grown = mesh ? realloc(list->models, (list->count + 1) * sizeof *grown) : NULL;
    if (!grown) {
        mesh_destroy(mesh);
        return report_error(report, STATUS_IO, "%s: out of memory", name);
    }
    list->models = grown;
    model *model = &grown[list->count++];
    *model = (struct model){.class = class, .mesh = mesh};
    for (size_t i = 0; name[i] && i < NAME_SIZE - 1; i++)
        model->name[i] = isalnum((unsigned char)name[i]) || name[i] == '.' || name[i] == '-' ? name[i] : '_';
    if (!model->name[0])
        model->name[0] = '_';
    if (added)
        *added = model;
    return STATUS_OK;
}

void model_list_clear(model_list *list)
{
    for (uint32_t i = 0; i < list->count; i++)
        mesh_destroy(list->models[i].mesh);
    free(list->models);
    *list = (model_list){0};
}
