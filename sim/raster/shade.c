// The colour of a triangle's corner: what the file says, or a muted tint by the direction of the normal; lit by
// a lamp at the eye, the same from both sides. Only + - * / and square roots: the same bits everywhere.
#include "raster.h"

#include <math.h>

// Tints of surfaces that face along x, y and z; between them by the squares of the normal's components.
static const double TINTS[3][3] = {
    {0.76, 0.34, 0.26},  // clay
    {0.24, 0.54, 0.62},  // lagoon
    {0.84, 0.66, 0.38},  // sand
};
static const double AMBIENT = 0.22;

static void tint_normal(const double normal[3], double rgba[4])
{
    for (int c = 0; c < 3; c++) {
        rgba[c] = 0;
        for (int axis = 0; axis < 3; axis++)
            rgba[c] += normal[axis] * normal[axis] * TINTS[axis][c];
    }
    rgba[3] = 1;
}

void shade_corner(const model *model, const view *view, double alpha, uint32_t triangle, int corner, double rgba[4])
{
    const mesh *mesh = model->mesh;
    uint32_t vertex = mesh->triangles[triangle][corner];
    const float *color = mesh->face_colors     ? mesh->face_colors[triangle]
                         : mesh->vertex_colors ? mesh->vertex_colors[vertex]
                                               : NULL;
    for (int c = 0; c < 4 && color; c++)
        rgba[c] = (double)color[c];
    if (model->unlit && color)
        return;

    const float *file_normal = mesh->vertex_normals[vertex];
    double normal[3] = {(double)file_normal[0], (double)file_normal[1], (double)file_normal[2]}, to_eye[3];
    double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    view_direction(view, mesh->positions[vertex], to_eye);
    // A corner without a normal is lit and tinted as if it faced the eye.
    for (int i = 0; i < 3; i++)
        normal[i] = length > 0 ? normal[i] / length : to_eye[i];
    double facing = fabs(normal[0] * to_eye[0] + normal[1] * to_eye[1] + normal[2] * to_eye[2]);
    double light = AMBIENT + (1 - AMBIENT) * (facing < 1 ? facing : 1);
    if (!color)
        tint_normal(normal, rgba);
    for (int c = 0; c < 3; c++)
        rgba[c] *= light;
    if (model->class == CLASS_OPAQUE)
        rgba[3] = 1;
    else if (!color || !mesh->colors_have_alpha)
        rgba[3] = alpha;
}
