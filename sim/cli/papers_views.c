// Cameras from a mesh's bounding box: the papers name their views and give no camera.
#include "papers.h"

#include <math.h>
#include <stdlib.h>

static const double FILL = 0.96;  // of the picture's height or width, whichever binds
static const double FOV_DEGREES = 30;

status paper_box_of(const char *path, paper_box *box)
{
    mesh *mesh = NULL;
    status status = mesh_load(path, &command_report, &mesh);
    if (status != STATUS_OK)
        return status;
    bool any = false;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        for (int corner = 0; corner < 3; corner++) {
            const float *position = mesh->positions[mesh->triangles[t][corner]];
            for (int i = 0; i < 3; i++) {
                double at = (double)position[i];
                box->low[i] = any && box->low[i] < at ? box->low[i] : at;
                box->high[i] = any && box->high[i] > at ? box->high[i] : at;
            }
            any = true;
        }
    }
    box->faces = mesh->face_count;
    mesh_destroy(mesh);
    return any ? STATUS_OK : report_error(&command_report, STATUS_REFUSED, "%s: has no triangle to look at", path);
}

int paper_view_axis(paper_view view, const paper_box *box)
{
    int axis = paper_views[view].axis;
    if (axis >= 0)
        return axis;
    axis = 0;
    for (int i = 1; i < 3; i++) {
        if (box->high[i] - box->low[i] > box->high[axis] - box->low[axis])
            axis = i;
    }
    return axis;
}

// To what a page prints of it, so that the camera can be given again.
static double round_to_print(double value)
{
    char text[32];
    snprintf(text, sizeof text, "%.6g", value);
    return strtod(text, NULL);
}

void paper_view_camera(paper_view view, const paper_box *box, double aspect, camera *camera)
{
    int axis = paper_view_axis(view, box);
    int up = axis == 1 ? 2 : 1, across = 3 - axis - up;
    double half[3];
    camera->eye_set = camera->target_set = camera->up_set = true;
    for (int i = 0; i < 3; i++) {
        half[i] = (box->high[i] - box->low[i]) / 2;
        camera->eye[i] = camera->target[i] = box->low[i] + half[i];
        camera->up[i] = i == up;
    }
    // The box's near side fills the picture.
    double tangent = tan(FOV_DEGREES / 360 * acos(-1.0));
    double high = half[up] > half[across] / aspect ? half[up] : half[across] / aspect;
    double flat = half[axis] > 0 ? half[axis] : 1;  // a mesh without any extent
    camera->fov_degrees = FOV_DEGREES;
    camera->eye[axis] += half[axis] + (high > 0 ? high : flat) / (tangent * FILL);
    for (int i = 0; i < 3; i++) {
        camera->eye[i] = round_to_print(camera->eye[i]);
        camera->target[i] = round_to_print(camera->target[i]);
    }
}
