// What the user said of the camera, and the scene's bounds, to a view.
//
// Left open, it looks along -z (from +z, y up, x to the right) at the middle of the bounding box, from where
// everything just fits; near and far enclose everything with a little room, so that no fragment lies at
// depth 0 or 1.
#include "raster.h"

#include <math.h>
#include <string.h>

static const double FILL = 0.96;            // of the view's width or height, whichever binds
static const double DEPTH_ROOM = 1.0 / 64;  // of the depth range, before and behind
static const double NEAR_OVER_FAR_MIN = 1e-4;

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double result[3])
{
    result[0] = a[1] * b[2] - a[2] * b[1];
    result[1] = a[2] * b[0] - a[0] * b[2];
    result[2] = a[0] * b[1] - a[1] * b[0];
}

static bool normalize(double v[3])
{
    double length = sqrt(dot(v, v));
    if (!(length > 1e-12) || !isfinite(length))
        return false;
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return true;
}

// Calls `see` with each point that the camera must show.
static void each_point(const model_list *models, void (*see)(void *user, const double point[3]), void *user)
{
    for (uint32_t m = 0; m < models->count; m++) {
        const model *model = &models->models[m];
        if (model->has_frame) {
            for (int corner = 0; corner < 8; corner++)
                see(user, (double[3]){model->frame[corner & 1][0], model->frame[corner >> 1 & 1][1],
                                      model->frame[corner >> 2][2]});
            continue;
        }
        for (uint32_t t = 0; t < model->mesh->triangle_count; t++) {
            for (int corner = 0; corner < 3; corner++) {
                const float *p = model->mesh->positions[model->mesh->triangles[t][corner]];
                see(user, (double[3]){(double)p[0], (double)p[1], (double)p[2]});
            }
        }
    }
}

typedef struct box {
    double low[3], high[3];
    bool any;
} box;

static void see_box(void *user, const double point[3])
{
    box *box = user;
    for (int i = 0; i < 3; i++) {
        box->low[i] = box->any && box->low[i] < point[i] ? box->low[i] : point[i];
        box->high[i] = box->any && box->high[i] > point[i] ? box->high[i] : point[i];
    }
    box->any = true;
}

// Extents along the view's axes, from an origin; and how far back the eye must go to see everything.
typedef struct extent {
    const view *view;
    double origin[3], half_angle_tangent[2];
    double low, high;  // along forward
    double across[2];  // largest |x|, |y|
    double step_back;
    bool any;
} extent;

static void see_extent(void *user, const double point[3])
{
    extent *extent = user;
    double from[3] = {point[0] - extent->origin[0], point[1] - extent->origin[1], point[2] - extent->origin[2]};
    double along = dot(extent->view->forward, from);
    double across[2] = {fabs(dot(extent->view->right, from)), fabs(dot(extent->view->up, from))};
    extent->low = extent->any && extent->low < along ? extent->low : along;
    extent->high = extent->any && extent->high > along ? extent->high : along;
    for (int i = 0; i < 2; i++) {
        extent->across[i] = extent->across[i] > across[i] ? extent->across[i] : across[i];
        double back = across[i] / (extent->half_angle_tangent[i] * FILL) - along;
        extent->step_back = extent->step_back > back ? extent->step_back : back;
    }
    extent->any = true;
}

static status fit_axes(const camera *camera, const double towards_target[3], const report *report, view *view)
{
    memcpy(view->forward, towards_target, sizeof view->forward);
    if (!normalize(view->forward))
        return report_error(report, STATUS_USAGE, "camera: eye and target are the same point");
    double up[3] = {0, 1, 0};
    if (camera->up_set)
        memcpy(up, camera->up, sizeof up);
    if (!normalize(up))
        return report_error(report, STATUS_USAGE, "camera: up has no direction");
    cross(view->forward, up, view->right);
    if (!normalize(view->right) || fabs(dot(view->forward, up)) > 1 - 1e-12) {
        if (camera->up_set)
            return report_error(report, STATUS_USAGE, "camera: up points along the view");
        cross(view->forward, (double[3]){0, 0, -1}, view->right);
        normalize(view->right);
    }
    cross(view->right, view->forward, view->up);
    return STATUS_OK;
}

static status fit_depth(const camera *camera, const extent *seen, const report *report, view *view)
{
    double range = seen->high - seen->low;
    double room = range > 0 ? range * DEPTH_ROOM : seen->high != 0 ? fabs(seen->high) * DEPTH_ROOM : 1;
    view->near = seen->low - room;
    view->far = seen->high + room;
    if (camera->far != 0)
        view->far = camera->far;
    if (!view->ortho && view->far <= 0 && camera->far == 0)
        view->far = 1;  // everything is behind the eye
    if (camera->near != 0)
        view->near = camera->near;
    else if (!view->ortho && view->near < view->far * NEAR_OVER_FAR_MIN)
        view->near = view->far * NEAR_OVER_FAR_MIN;
    if (camera->far == 0 && camera->near != 0 && view->far <= view->near)
        view->far = view->near + fabs(view->near);
    if (!(view->near < view->far) || (!view->ortho && !(view->near > 0)) || !isfinite(view->far - view->near))
        return report_error(report, STATUS_USAGE, "camera: near is %.9g and far is %.9g; near must be below far%s",
                            view->near, view->far, view->ortho ? "" : ", and above 0 in perspective");
    return STATUS_OK;
}

status view_fit(const camera *camera, const model_list *models, uint32_t width, uint32_t height, const report *report,
                view *view)
{
    *view = (struct view){.ortho = camera->ortho, .reverse_z = camera->reverse_z, .width = width, .height = height};
    if (!camera->ortho && !(camera->fov_degrees > 0 && camera->fov_degrees < 180))
        return report_error(report, STATUS_USAGE,
                            "camera: a field of view of %.9g degrees; it must be above 0 and below 180",
                            camera->fov_degrees);
    box bounds = {.any = false};
    each_point(models, see_box, &bounds);
    double target[3], towards[3] = {0, 0, -1};
    for (int i = 0; i < 3; i++) {
        target[i] = camera->target_set ? camera->target[i] : (bounds.low[i] + bounds.high[i]) / 2;
        if (camera->eye_set)
            towards[i] = target[i] - camera->eye[i];
    }
    status result = fit_axes(camera, towards, report, view);
    if (result)
        return result;

    double aspect = (double)width / height, tangent = camera->ortho ? 1 : angle_tangent(camera->fov_degrees / 720);
    extent seen = {.view = view, .half_angle_tangent = {tangent * aspect, tangent}};
    memcpy(seen.origin, camera->eye_set ? camera->eye : target, sizeof seen.origin);
    each_point(models, see_extent, &seen);
    double back = 0;
    if (!camera->eye_set) {
        double size = seen.high - seen.low + seen.across[0] + seen.across[1];
        if (!(size > 0))
            size = 1;
        back = camera->ortho ? size - seen.low : seen.step_back;
        if (back < size * 1e-3 - seen.low)
            back = size * 1e-3 - seen.low;
    }
    for (int i = 0; i < 3; i++)
        view->eye[i] = seen.origin[i] - view->forward[i] * back;
    seen.low += back;
    seen.high += back;

    double half_height = tangent;
    if (camera->ortho) {
        half_height = camera->ortho_height / 2;
        if (!(half_height > 0))
            half_height = (seen.across[1] > seen.across[0] / aspect ? seen.across[1] : seen.across[0] / aspect) / FILL;
        if (!(half_height > 0))
            half_height = 1;
    }
    view->scale[0] = 1 / (half_height * aspect);
    view->scale[1] = 1 / half_height;
    return fit_depth(camera, &seen, report, view);
}
