// A triangle in clip space to the convex polygon that is left of it (Sutherland and Hodgman).
//
// Near and far always cut. The sides of the view do not: the rasterizer takes corners far outside as they
// are, so that snapping moves only the triangle's own corners; only beyond 2^31 pixels (GUARD_PIXELS) does
// a guard band cut. A crossing is computed from its inside end to its outside end whichever way the edge
// runs, so neighbours get the same point and stay watertight.
#include "raster.h"

#include <math.h>
#include <string.h>

static const double GUARD_PIXELS = 2147483648.0;

typedef enum clip_plane { PLANE_NEAR, PLANE_FAR, PLANE_LEFT, PLANE_RIGHT, PLANE_BOTTOM, PLANE_TOP } clip_plane;

// >= 0 inside. `guard`: half width and half height of the guard band over those of the view.
static double plane_distance(const clip_vertex *vertex, clip_plane plane, const double guard[2])
{
    switch (plane) {
    case PLANE_NEAR: return vertex->past_near;
    case PLANE_FAR: return vertex->before_far;
    case PLANE_LEFT: return guard[0] * vertex->w + vertex->x;
    case PLANE_RIGHT: return guard[0] * vertex->w - vertex->x;
    case PLANE_BOTTOM: return guard[1] * vertex->w + vertex->y;
    default: return guard[1] * vertex->w - vertex->y;
    }
}

static double between(double a, double b, double t)
{
    return a + (b - a) * t;
}

static void cross_plane(const clip_vertex *inside, const clip_vertex *outside, double t, clip_plane plane,
                        clip_vertex *crossing)
{
    crossing->x = between(inside->x, outside->x, t);
    crossing->y = between(inside->y, outside->y, t);
    crossing->w = between(inside->w, outside->w, t);
    crossing->past_near = plane == PLANE_NEAR ? 0 : between(inside->past_near, outside->past_near, t);
    crossing->before_far = plane == PLANE_FAR ? 0 : between(inside->before_far, outside->before_far, t);
    for (int i = 0; i < 4; i++)
        crossing->rgba[i] = between(inside->rgba[i], outside->rgba[i], t);
}

static int cut(clip_vertex *polygon, int count, clip_plane plane, const double guard[2])
{
    clip_vertex kept[CLIP_VERTEX_MAX + 1];
    int kept_count = 0, outside_count = 0;
    for (int i = 0; i < count; i++) {
        const clip_vertex *a = &polygon[i], *b = &polygon[(i + 1) % count];
        double da = plane_distance(a, plane, guard), db = plane_distance(b, plane, guard);
        outside_count += !(da >= 0);
        if (da >= 0 && kept_count < CLIP_VERTEX_MAX)
            kept[kept_count++] = *a;
        if ((da >= 0) != (db >= 0) && kept_count < CLIP_VERTEX_MAX) {
            if (da >= 0)
                cross_plane(a, b, da / (da - db), plane, &kept[kept_count++]);
            else
                cross_plane(b, a, db / (db - da), plane, &kept[kept_count++]);
        }
    }
    if (!outside_count)
        return count;
    memcpy(polygon, kept, (size_t)kept_count * sizeof *kept);
    return kept_count >= 3 ? kept_count : 0;
}

// All corners beyond one side of the view: nothing to draw.
static bool beyond_a_side(const clip_vertex *polygon, int count)
{
    int out[4] = {0};
    for (int i = 0; i < count; i++) {
        out[0] += polygon[i].x < -polygon[i].w;
        out[1] += polygon[i].x > polygon[i].w;
        out[2] += polygon[i].y < -polygon[i].w;
        out[3] += polygon[i].y > polygon[i].w;
    }
    return out[0] == count || out[1] == count || out[2] == count || out[3] == count;
}

int clip_triangle(const view *view, const clip_vertex triangle[3], clip_vertex polygon[CLIP_VERTEX_MAX])
{
    const double guard[2] = {GUARD_PIXELS / view->width, GUARD_PIXELS / view->height};
    memcpy(polygon, triangle, 3 * sizeof *polygon);
    int count = cut(polygon, 3, PLANE_NEAR, guard);
    if (count)
        count = cut(polygon, count, PLANE_FAR, guard);
    if (!count || beyond_a_side(polygon, count))
        return 0;
    for (clip_plane plane = PLANE_LEFT; plane <= PLANE_TOP && count; plane++)
        count = cut(polygon, count, plane, guard);
    return count;
}

// Depth is that of the exact position; the plane through the corners then goes through the snapped ones.
void snap_vertex(const view *view, const clip_vertex *vertex, screen_vertex *screen)
{
    double inverse_w = 1 / vertex->w, range = view->far - view->near;
    double x = (vertex->x * inverse_w + 1) * 0.5 * view->width;
    double y = (1 - vertex->y * inverse_w) * 0.5 * view->height;
    screen->x = llrint(x * SUBPIXELS);
    screen->y = llrint(y * SUBPIXELS);
    screen->inverse_w = inverse_w;
    double distance = view->reverse_z ? vertex->before_far : vertex->past_near;
    double scale = view->ortho ? 1 : view->reverse_z ? view->near : view->far;
    double depth = scale * (distance * inverse_w) / range;
    screen->depth = depth < 0 ? 0 : depth > 1 ? 1 : depth;
    memcpy(screen->rgba, vertex->rgba, sizeof screen->rgba);
}
