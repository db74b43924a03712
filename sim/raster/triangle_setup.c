// Three snapped corners to edge functions, bounds and interpolation terms.
//
// Corners are first put into a canonical order: clockwise on the screen, from the one with the smallest
// (x, y). So two faces with the same corners, whatever their winding and start, get the same depth to
// the last bit, and coplanar duplicates are ties.
#include "triangle.h"

static bool before(const screen_vertex *a, const screen_vertex *b)
{
    return a->x < b->x || (a->x == b->x && a->y < b->y);
}

static int32_t clamp_pixel(int64_t pixel, int64_t limit)
{
    return (int32_t)(pixel < 0 ? 0 : pixel > limit ? limit : pixel);
}

static int64_t smallest(int64_t a, int64_t b, int64_t c)
{
    int64_t ab = a < b ? a : b;
    return ab < c ? ab : c;
}

static int64_t largest(int64_t a, int64_t b, int64_t c)
{
    return -smallest(-a, -b, -c);
}

// y grows downwards: clockwise, a top edge runs to the right and a left edge runs upwards.
static edge edge_between(const screen_vertex *from, const screen_vertex *to)
{
    int64_t dx = to->x - from->x, dy = to->y - from->y;
    bool top_left = dy < 0 || (dy == 0 && dx > 0);
    return (edge){.x = from->x, .y = from->y, .step_x = -dy, .step_y = dx, .bias = top_left ? 0 : 1};
}

int128 edge_at(const edge *edge, int64_t x, int64_t y)
{
    return (int128)edge->step_x * (x - edge->x) + (int128)edge->step_y * (y - edge->y);
}

bool triangle_set_up(const screen_vertex corners[3], uint32_t width, uint32_t height, triangle_setup *setup)
{
    const screen_vertex *v[3] = {&corners[0], &corners[1], &corners[2]};
    // Sample positions lie in [0, 256) of their pixel, so a pixel left of the smallest x has none inside.
    int64_t left = smallest(v[0]->x, v[1]->x, v[2]->x) >> SUBPIXEL_BITS,
            right = largest(v[0]->x, v[1]->x, v[2]->x) >> SUBPIXEL_BITS;
    int64_t top = smallest(v[0]->y, v[1]->y, v[2]->y) >> SUBPIXEL_BITS,
            bottom = largest(v[0]->y, v[1]->y, v[2]->y) >> SUBPIXEL_BITS;
    if (right < 0 || bottom < 0 || left >= width || top >= height)
        return false;
    setup->x0 = clamp_pixel(left, width - 1);
    setup->x1 = clamp_pixel(right, width - 1);
    setup->y0 = clamp_pixel(top, height - 1);
    setup->y1 = clamp_pixel(bottom, height - 1);

    int first = before(v[1], v[0]) ? (before(v[2], v[1]) ? 2 : 1) : before(v[2], v[0]) ? 2 : 0;
    const screen_vertex *a = v[first], *b = v[(first + 1) % 3], *c = v[(first + 2) % 3];
    int128 area = (int128)(b->x - a->x) * (c->y - a->y) - (int128)(b->y - a->y) * (c->x - a->x);
    if (area == 0)
        return false;
    if (area < 0) {
        const screen_vertex *swapped = b;
        b = c;
        c = swapped;
        area = -area;
    }
    setup->area = (double)area;
    setup->edges[0] = edge_between(b, c);
    setup->edges[1] = edge_between(c, a);
    setup->edges[2] = edge_between(a, b);
    setup->depth = a->depth;
    setup->depth_change[0] = b->depth - a->depth;
    setup->depth_change[1] = c->depth - a->depth;
    setup->inverse_w[0] = a->inverse_w;
    setup->inverse_w[1] = b->inverse_w;
    setup->inverse_w[2] = c->inverse_w;
    setup->perspective = a->inverse_w != b->inverse_w || a->inverse_w != c->inverse_w;
    setup->flat = true;
    for (int i = 0; i < 4; i++) {
        setup->rgba[i] = a->rgba[i];
        setup->rgba_change[0][i] = b->rgba[i] - a->rgba[i];
        setup->rgba_change[1][i] = c->rgba[i] - a->rgba[i];
        setup->flat = setup->flat && setup->rgba_change[0][i] == 0 && setup->rgba_change[1][i] == 0;
    }
    return true;
}
