// A torus knot: a tube of radius `radius` around the curve that winds p times around the z axis and q times
// around the core of a torus of radii 1 and 0.45. Normals point out of the tube; no colours.
#include "raster.h"

#include <math.h>
#include <stdlib.h>

static const double SMALL_RADIUS = 0.45;

static void cross(const double a[3], const double b[3], double result[3])
{
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalize(double v[3])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

// The curve at `turns` of its parameter, its tangent, and the direction away from the torus's core circle.
static void curve(double p, double q, double turns, double point[3], double tangent[3], double out[3])
{
    double sp, cp, sq, cq;
    angle_sin_cos(p * turns, &sp, &cp);
    angle_sin_cos(q * turns, &sq, &cq);
    double r = 1 + SMALL_RADIUS * cq;
    const double at[3] = {r * cp, r * sp, SMALL_RADIUS * sq};
    const double along[3] = {-p * r * sp - q * SMALL_RADIUS * sq * cp, p * r * cp - q * SMALL_RADIUS * sq * sp,
                             q * SMALL_RADIUS * cq};
    const double away[3] = {cq * cp, cq * sp, sq};
    for (int i = 0; i < 3; i++) {
        point[i] = at[i];
        tangent[i] = along[i];
        out[i] = away[i];
    }
}

status scene_knot(const scene_request *request, const report *report, model_list *list)
{
    double p = request->values[KEY_knot_p].number, q = request->values[KEY_knot_q].number,
           radius = request->values[KEY_knot_radius].number;
    uint32_t rings = (uint32_t)request->values[KEY_knot_rings].number,
             sides = (uint32_t)request->values[KEY_knot_sides].number;
    mesh *mesh = mesh_allocate(rings * sides, rings * sides * 2);
    for (uint32_t ring = 0; mesh && ring < rings; ring++) {
        double point[3], tangent[3], normal[3], binormal[3];
        curve(p, q, (double)ring / rings, point, tangent, normal);
        cross(tangent, normal, binormal);
        normalize(binormal);
        cross(binormal, tangent, normal);  // square to the tangent
        normalize(normal);
        for (uint32_t side = 0; side < sides; side++) {
            double sine, cosine;
            angle_sin_cos((double)side / sides, &sine, &cosine);
            uint32_t vertex = ring * sides + side, next = ring * sides + (side + 1) % sides;
            uint32_t ahead = (vertex + sides) % (rings * sides), next_ahead = (next + sides) % (rings * sides);
            for (int i = 0; i < 3; i++) {
                double out = cosine * normal[i] + sine * binormal[i];
                mesh->vertex_normals[vertex][i] = (float)out;
                mesh->positions[vertex][i] = (float)(point[i] + radius * out);
            }
            const uint32_t corners[2][3] = {{vertex, ahead, next}, {next, ahead, next_ahead}};
            for (int half = 0; half < 2; half++)
                for (int i = 0; i < 3; i++)
                    mesh->triangles[2 * vertex + (uint32_t)half][i] = corners[half][i];
        }
    }
    if (mesh) {
        free(mesh->vertex_colors);
        mesh->vertex_colors = NULL;
    }
    return model_add(list, "knot", request->class, mesh, report, NULL);
}
