// World space to homogeneous clip space, in double.
#include "raster.h"

#include <math.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void view_project(const view *view, const float position[3], clip_vertex *vertex)
{
    double from_eye[3];
    for (int i = 0; i < 3; i++)
        from_eye[i] = (double)position[i] - view->eye[i];
    double distance = dot(view->forward, from_eye);
    vertex->x = view->scale[0] * dot(view->right, from_eye);
    vertex->y = view->scale[1] * dot(view->up, from_eye);
    vertex->w = view->ortho ? 1 : distance;
    vertex->past_near = distance - view->near;
    vertex->before_far = view->far - distance;
}

void view_direction(const view *view, const float position[3], double direction[3])
{
    for (int i = 0; i < 3; i++)
        direction[i] = view->ortho ? -view->forward[i] : view->eye[i] - (double)position[i];
    double length = sqrt(dot(direction, direction));
    for (int i = 0; i < 3; i++)
        direction[i] = length > 0 ? direction[i] / length : -view->forward[i];
}
