// The volume of figure 1 in "Coherent Layer Peeling": slices across the view in the cube [-1, 1]^3, nearest (z = 1)
// first, with alpha from a procedural density, crossed by an open cone around the y axis.
#include "raster.h"

#include <math.h>

// 1 at 0, falling smoothly to 0 at +-1.
static double bump(double t)
{
    double rest = 1 - t * t;
    return rest > 0 ? rest * rest : 0;
}

// Straight colour and density in [0, 1]: a thin skin around folded sheets (a gyroid) around a bright core.
static void sample_volume(const double p[3], double rgba[4])
{
    double s[3], c[3];
    for (int i = 0; i < 3; i++)
        angle_sin_cos(p[i] * 1.1, &s[i], &c[i]);
    double radius = sqrt(p[0] * p[0] * 1.2 + p[1] * p[1] * 1.05 + p[2] * p[2] * 1.2);
    double gyroid = s[0] * c[1] + s[1] * c[2] + s[2] * c[0];
    double skin = 0.16 * bump((radius - 0.94) / 0.07);
    double folds = radius < 0.88 ? bump(gyroid / 0.6) * (radius < 0.7 ? 1 : (0.88 - radius) / 0.18) : 0;
    double core = 1.5 * bump(radius / 0.30);
    double sum = skin + folds + core;
    static const double skin_color[3] = {0.60, 0.52, 0.50}, core_color[3] = {0.98, 0.62, 0.12};
    static const double fold_colors[2][3] = {{0.04, 0.26, 0.50}, {0.52, 0.06, 0.16}};
    static const double EMPTY = 0.01;  // weight of the folds' colour where there is nothing: colours stay smooth
    double side = 0.5 + 0.5 * p[1];
    for (int i = 0; i < 3; i++) {
        double fold = fold_colors[0][i] * side + fold_colors[1][i] * (1 - side);
        rgba[i] = (skin * skin_color[i] + (folds + EMPTY) * fold + core * core_color[i]) / (sum + EMPTY);
    }
    rgba[3] = sum < 1 ? sum : 1;
}

static status add_slices(const scene_request *request, const report *report, model_list *list)
{
    uint32_t slices = (uint32_t)request->values[KEY_slices_cone_slices].number;
    uint32_t grid = (uint32_t)request->values[KEY_slices_cone_grid].number;
    double density = request->values[KEY_slices_cone_density].number;
    uint32_t side = grid + 1;
    mesh *mesh = mesh_allocate(slices * side * side, slices * grid * grid * 2);
    uint32_t vertex = 0, triangle = 0;
    for (uint32_t slice = 0; mesh && slice < slices; slice++) {
        for (uint32_t row = 0; row < side; row++) {
            for (uint32_t column = 0; column < side; column++, vertex++) {
                double rgba[4], p[3] = {2.0 * column / grid - 1, 1 - 2.0 * row / grid, 1 - (2.0 * slice + 1) / slices};
                sample_volume(p, rgba);
                rgba[3] = rgba[3] * density / slices < 0.95 ? rgba[3] * density / slices : 0.95;
                for (int i = 0; i < 3; i++)
                    mesh->positions[vertex][i] = (float)p[i];
                for (int i = 0; i < 4; i++)
                    mesh->vertex_colors[vertex][i] = (float)rgba[i];
                if (row == grid || column == grid)
                    continue;
                const uint32_t corners[2][3] = {{vertex, vertex + side, vertex + 1},
                                                {vertex + 1, vertex + side, vertex + side + 1}};
                for (int half = 0; half < 2; half++, triangle++)
                    for (int i = 0; i < 3; i++)
                        mesh->triangles[triangle][i] = corners[half][i];
            }
        }
    }
    model *model;
    status result = model_add(list, "slices", request->has_class ? request->class : CLASS_SORTED, mesh, report, &model);
    if (!result)
        model->unlit = true;
    return result;
}

static status add_cone(const scene_request *request, const report *report, model_list *list)
{
    static const double APEX = 0.8, BASE = -0.8, RADIUS = 0.72;
    uint32_t segments = (uint32_t)request->values[KEY_slices_cone_segments].number;
    double alpha = request->values[KEY_slices_cone_alpha].number;
    // Each triangle has an apex of its own, so that it can have the normal of its middle.
    mesh *mesh = mesh_allocate(segments * 2, segments);
    for (uint32_t i = 0; mesh && i < 2 * segments; i++) {
        bool apex = i >= segments;
        double sine, cosine, rise = RADIUS / (APEX - BASE);
        angle_sin_cos((apex ? i - segments + 0.5 : i) / segments, &sine, &cosine);
        const double p[3] = {apex ? 0 : RADIUS * cosine, apex ? APEX : BASE, apex ? 0 : RADIUS * sine};
        const double normal[3] = {cosine, rise, sine}, rgba[4] = {0.92, 0.48, 0.10, alpha};
        for (int c = 0; c < 3; c++) {
            mesh->positions[i][c] = (float)p[c];
            mesh->vertex_normals[i][c] = (float)normal[c];
        }
        for (int c = 0; c < 4; c++)
            mesh->vertex_colors[i][c] = (float)rgba[c];
        if (apex)
            continue;
        mesh->triangles[i][0] = segments + i;
        mesh->triangles[i][1] = i;
        mesh->triangles[i][2] = (i + 1) % segments;
    }
    if (mesh)
        mesh->colors_have_alpha = true;
    return model_add(list, "cone", request->has_class ? request->class : CLASS_TRANSPARENT, mesh, report, NULL);
}

status scene_slices_cone(const scene_request *request, const report *report, model_list *list)
{
    status result = add_slices(request, report, list);
    return result ? result : add_cone(request, report, list);
}
