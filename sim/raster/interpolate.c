// Depth and colour of one tile's fragments of a triangle.
//
// Depth is affine over the screen through the snapped corners: d = d0 + (e1 (d1 - d0) + e2 (d2 - d0)) / area,
// with edge functions e1 and e2 that are exact integers (in double: exact below 2^53, and never off by more
// than one part in 2^52). The weights are not negative, so nothing cancels, a sliver is as accurate as
// any triangle, and a constant depth stays constant to the last bit. Colours are weighted by e / w.
#include "triangle.h"

typedef struct weight {
    double anchor, step_x, step_y;
} weight;

static weight weight_at(const edge *edge, int64_t anchor_x, int64_t anchor_y)
{
    return (weight){(double)edge_at(edge, anchor_x, anchor_y), (double)edge->step_x, (double)edge->step_y};
}

static double clamp_unit(double value)
{
    return value < 0 ? 0 : value > 1 ? 1 : value;
}

static void fill_depth(rasterizer *r, const triangle_setup *setup, const weight w[3], uint32_t first, uint32_t count)
{
    const double d0 = setup->depth, d1 = setup->depth_change[0], d2 = setup->depth_change[1], scale = 1 / setup->area;
    for (uint32_t i = 0; i < count; i++) {
        double e1 = w[1].anchor + (w[1].step_x * r->offset_x[i] + w[1].step_y * r->offset_y[i]);
        double e2 = w[2].anchor + (w[2].step_x * r->offset_x[i] + w[2].step_y * r->offset_y[i]);
        double device = d0 + (e1 * d1 + e2 * d2) * scale;
        r->depth[first + i] = clamp_unit(r->reversed ? 1 - device : device);
    }
}

static void fill_flat_color(rasterizer *r, const triangle_setup *setup, uint32_t first, uint32_t count)
{
    for (int c = 0; c < 4; c++) {
        float value = (float)clamp_unit(setup->rgba[c]);
        for (uint32_t i = 0; i < count; i++)
            r->rgba[c][first + i] = value;
    }
}

static void fill_color(rasterizer *r, const triangle_setup *setup, const weight w[3], uint32_t first, uint32_t count)
{
    const double q0 = setup->inverse_w[0], q1 = setup->inverse_w[1], q2 = setup->inverse_w[2];
    for (uint32_t i = 0; i < count; i++) {
        double e0 = w[0].anchor + (w[0].step_x * r->offset_x[i] + w[0].step_y * r->offset_y[i]);
        double e1 = w[1].anchor + (w[1].step_x * r->offset_x[i] + w[1].step_y * r->offset_y[i]);
        double e2 = w[2].anchor + (w[2].step_x * r->offset_x[i] + w[2].step_y * r->offset_y[i]);
        double u1 = setup->perspective ? e1 * q1 : e1, u2 = setup->perspective ? e2 * q2 : e2;
        double scale = 1 / (setup->perspective ? e0 * q0 + u1 + u2 : setup->area);
        u1 *= scale;
        u2 *= scale;
        for (int c = 0; c < 4; c++)
            r->rgba[c][first + i] =
                (float)clamp_unit(setup->rgba[c] + (u1 * setup->rgba_change[0][c] + u2 * setup->rgba_change[1][c]));
    }
}

void interpolate_tile(rasterizer *r, const triangle_setup *setup, int64_t anchor_x, int64_t anchor_y, uint32_t count)
{
    const uint32_t first = r->count;
    weight weights[3];
    for (int i = 0; i < 3; i++)
        weights[i] = weight_at(&setup->edges[i], anchor_x, anchor_y);
    fill_depth(r, setup, weights, first, count);
    if (setup->flat)
        fill_flat_color(r, setup, first, count);
    else
        fill_color(r, setup, weights, first, count);
    for (uint32_t i = 0; i < count; i++)
        r->primitive[first + i] = setup->primitive;
    r->count += count;
}
