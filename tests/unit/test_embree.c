// The recorder against a ray caster: the same primitives at the same depths at every sample that is farther from an
// edge than snapping can move it; what differs nearer than that is counted and bounded.
//
// How far is far: snapping moves a corner by at most half of 1/256 pixel along x and y, so an edge by at most
// sqrt(2)/512 = 0.00277 pixel; rays have single precision, which moves a hit by a few 2^-24 of the picture's
// 256 pixels = a few 1e-5 pixel. EDGE_PIXELS = 0.004 holds both.
// How equal is equal: the plane through snapped corners at a sample is the true plane at a point at most that far
// away, so depths differ by the plane's slope times EDGE_PIXELS, plus Embree's 2e-5 in distance.
#include "raster_fixture.h"
#include "raycast.h"
#include "../../sim/raster/record.h"

#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>
#include <cmocka.h>

static const double EDGE_PIXELS = 0.004;
static const double RAY_ERROR = 2e-5;  // of a distance, relative

typedef struct comparison {
    size_t samples, hits, near_edge, differences_near_edge;
} comparison;

// A triangle on the screen, not snapped, as far as it lies before the eye.
typedef struct projected {
    double x[3], y[3], depth[3];
} projected;

static double depth_at(const view *view, double distance)
{
    double range = view->far - view->near;
    return view->ortho ? (distance - view->near) / range : view->far * ((distance - view->near) / distance) / range;
}

// The scenes here lie between near and far, so no corner is behind the eye.
static projected project(const view *view, const mesh *mesh, uint32_t triangle)
{
    projected result;
    for (int i = 0; i < 3; i++) {
        clip_vertex corner;
        view_project(view, mesh->positions[mesh->triangles[triangle][i]], &corner);
        result.x[i] = (corner.x / corner.w + 1) / 2 * view->width;
        result.y[i] = (1 - corner.y / corner.w) / 2 * view->height;
        result.depth[i] = depth_at(view, corner.past_near + view->near);
    }
    return result;
}

static double edge_distance(const projected *p, double x, double y)
{
    double nearest = INFINITY;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        double dx = p->x[j] - p->x[i], dy = p->y[j] - p->y[i], length = dx * dx + dy * dy;
        double t = length > 0 ? ((x - p->x[i]) * dx + (y - p->y[i]) * dy) / length : 0;
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        nearest = fmin(nearest, hypot(x - p->x[i] - t * dx, y - p->y[i] - t * dy));
    }
    return nearest;
}

// How far depth may differ. Snapping moves each corner by 1/512 pixel in x and y on its own: at most the plane's slope
// there, and for a thin triangle the tilt that this makes, which is the corners' depth range over its height.
static double depth_tolerance(const view *view, const projected *p, double depth)
{
    double area = fabs((p->x[1] - p->x[0]) * (p->y[2] - p->y[0]) - (p->y[1] - p->y[0]) * (p->x[2] - p->x[0]));
    double longest = 0, low = fmin(p->depth[0], fmin(p->depth[1], p->depth[2])),
           high = fmax(p->depth[0], fmax(p->depth[1], p->depth[2]));
    for (int i = 0; i < 3; i++)
        longest = fmax(longest, hypot(p->x[(i + 1) % 3] - p->x[i], p->y[(i + 1) % 3] - p->y[i]));
    double height = area / longest;
    double distance = view->ortho ? view->far : view->far * view->near / (view->far - depth * (view->far - view->near));
    double slope = view->ortho ? 1 / (view->far - view->near)
                               : view->far * view->near / (distance * distance * (view->far - view->near));
    return (high - low) * fmin(1, 2 * EDGE_PIXELS / height) + slope * distance * RAY_ERROR + 1e-7;
}

static int by_sample(const void *left, const void *right)
{
    const kept_fragment *a = left, *b = right;
    if (a->y != b->y)
        return a->y < b->y ? -1 : 1;
    if (a->x != b->x)
        return a->x < b->x ? -1 : 1;
    if (a->sample != b->sample)
        return a->sample < b->sample ? -1 : 1;
    return a->primitive < b->primitive ? -1 : a->primitive > b->primitive;
}

static int by_primitive(const void *left, const void *right)
{
    const ray_hit *a = left, *b = right;
    return a->primitive < b->primitive ? -1 : a->primitive > b->primitive;
}

static void compare_sample(const view *view, const mesh *mesh, double x, double y, const kept_fragment *fragments,
                           size_t count, ray_context *rays, comparison *result)
{
    qsort(rays->hits, rays->count, sizeof *rays->hits, by_primitive);
    result->samples++;
    size_t f = 0;
    for (uint32_t h = 0; f < count || h < rays->count;) {
        bool in_trace = f < count && (h == rays->count || fragments[f].primitive <= rays->hits[h].primitive);
        bool in_rays = h < rays->count && (f == count || rays->hits[h].primitive <= fragments[f].primitive);
        uint32_t primitive = in_trace ? fragments[f].primitive : rays->hits[h].primitive;
        projected p = project(view, mesh, primitive);
        bool near_edge = edge_distance(&p, x, y) <= EDGE_PIXELS;
        result->hits++;
        result->near_edge += near_edge;
        if (in_trace != in_rays) {
            result->differences_near_edge++;
            if (!near_edge)
                fail_msg("at %.6f %.6f only the %s has primitive %u, %.6f pixels from its edge", x, y,
                         in_trace ? "trace" : "ray", primitive, edge_distance(&p, x, y));
        } else {
            double depth = depth_at(view, rays->hits[h].distance), difference = fabs(depth - fragments[f].depth);
            if (!near_edge && !(difference <= depth_tolerance(view, &p, depth)))
                fail_msg("at %.6f %.6f primitive %u: depth %.9f in the trace, %.9f by the ray", x, y, primitive,
                         fragments[f].depth, depth);
        }
        f += in_trace;
        h += in_rays;
    }
}

// Rasterizes the model and casts a ray through every sample.
static comparison compare(const model *model, const camera *camera, uint32_t size, uint32_t samples)
{
    kept kept;
    view view;
    raycaster caster;
    record_options options;
    comparison result = {0};
    model_list list = {(struct model *)model, 1};
    record_defaults(&options);
    options.camera = *camera;
    assert_int_equal(view_fit(camera, &list, size, size, NULL, &view), STATUS_OK);
    kept_start(&kept, size, size, samples);
    assert_int_equal(record_model(model, &view, &options, 0, kept.rasterizer, NULL), STATUS_OK);
    qsort(kept.fragments, kept.count, sizeof *kept.fragments, by_sample);
    assert_true(raycaster_start(&caster, model->mesh));
    ray_context *rays = malloc(sizeof *rays);
    assert_non_null(rays);
    size_t next = 0;
    for (uint32_t y = 0; y < size; y++) {
        for (uint32_t x = 0; x < size; x++) {
            for (uint32_t s = 0; s < samples; s++) {
                size_t first = next;
                while (next < kept.count && kept.fragments[next].y == y && kept.fragments[next].x == x &&
                       kept.fragments[next].sample == s)
                    next++;
                double px = (double)sample_x(&kept, x, s) / 256, py = (double)sample_y(&kept, y, s) / 256;
                raycaster_cast(&caster, &view, px, py, rays);
                assert_false(rays->overflow);
                compare_sample(&view, model->mesh, px, py, &kept.fragments[first], next - first, rays, &result);
            }
        }
    }
    assert_int_equal(next, kept.count);  // every fragment was compared
    free(rays);
    raycaster_stop(&caster);
    kept_stop(&kept);
    print_message("    %zu samples, %zu hits, %zu nearer than %.3f pixel to an edge, %zu of these differ\n",
                  result.samples, result.hits, result.near_edge, EDGE_PIXELS, result.differences_near_edge);
    return result;
}

// Snapping moves a corner by 1/1024 pixel on average, so an edge sweeps about a quarter of its band, on one side: about
// one in six of the hits in the band changes sides. Triangles of a pixel have a few per cent of their hits in a band.
static void check_differences(const comparison *seen)
{
    assert_true(seen->near_edge < seen->hits / 20);
    assert_true(seen->differences_near_edge < seen->near_edge / 4);
}

static void load_scene(const char *text, model_list *list)
{
    *list = (model_list){0};
    assert_int_equal(scene_add(text, NULL, list), STATUS_OK);
}

static void the_demo_mesh_agrees(void **state)
{
    (void)state;
    static const char BUNNY[] = "/usr/share/glmark2/models/bunny.obj";
    if (access(BUNNY, R_OK)) {
        print_message("    skipped: %s is not there (Debian package glmark2-data)\n", BUNNY);
        skip();
    }
    model_list list;
    load_scene(BUNNY, &list);
    for (int ortho = 0; ortho < 2; ortho++) {
        camera camera = {.fov_degrees = 30, .ortho = ortho};
        comparison seen = compare(&list.models[0], &camera, 256, 2);
        assert_true(seen.hits > 100000);
        check_differences(&seen);
    }
    model_list_clear(&list);
}

static void soups_agree(void **state)
{
    (void)state;
    static const char *const scenes[] = {"scene:soup,count=400,size=0.6", "scene:soup,count=3000,size=0.1,seed=2",
                                         "scene:soup,count=60,size=3,seed=3"};
    static const uint32_t samples[] = {4, 1, 8};
    for (int i = 0; i < 3; i++) {
        model_list list;
        load_scene(scenes[i], &list);
        camera camera = {.fov_degrees = 60, .ortho = i == 1};
        comparison seen = compare(&list.models[0], &camera, 128, samples[i]);
        assert_true(seen.hits > 20000);
        check_differences(&seen);
        model_list_clear(&list);
    }
}

// A knot whose faces come twice, some with the other winding, with a third face on every 16th edge.
static void coplanar_and_non_manifold_faces_agree(void **state)
{
    (void)state;
    model_list list;
    load_scene("scene:knot,rings=48,sides=12", &list);
    mesh *knot = list.models[0].mesh;
    uint32_t count = knot->triangle_count, fins = count / 16, vertices = knot->vertex_count;
    mesh *mesh = mesh_allocate(vertices + fins, 2 * count + fins);
    assert_non_null(mesh);
    memcpy(mesh->positions, knot->positions, vertices * sizeof *mesh->positions);
    for (uint32_t t = 0; t < count; t++) {
        for (int i = 0; i < 3; i++) {
            mesh->triangles[t][i] = knot->triangles[t][i];
            mesh->triangles[count + t][i] = knot->triangles[t][t % 3 ? (i + 1) % 3 : 2 - i];
        }
    }
    for (uint32_t f = 0; f < fins; f++) {
        const uint32_t *from = knot->triangles[f * 16];
        for (int i = 0; i < 3; i++)
            mesh->positions[vertices + f][i] = knot->positions[from[0]][i] + 0.3f * knot->vertex_normals[from[0]][i];
        const uint32_t fin[3] = {from[0], from[1], vertices + f};
        memcpy(mesh->triangles[2 * count + f], fin, sizeof fin);
    }
    model_list_clear(&list);
    assert_int_equal(model_add(&list, "twice", CLASS_TRANSPARENT, mesh, NULL, NULL), STATUS_OK);
    camera camera = {.fov_degrees = 40};
    comparison seen = compare(&list.models[0], &camera, 192, 4);
    assert_true(seen.hits > 100000);
    check_differences(&seen);

    // Both copies of a face: the same samples, the same depth bits.
    kept kept;
    view view;
    record_options options;
    record_defaults(&options);
    kept_start(&kept, 192, 192, 1);
    assert_int_equal(view_fit(&camera, &list, 192, 192, NULL, &view), STATUS_OK);
    assert_int_equal(record_model(&list.models[0], &view, &options, 0, kept.rasterizer, NULL), STATUS_OK);
    qsort(kept.fragments, kept.count, sizeof *kept.fragments, by_sample);
    size_t twins = 0;
    for (size_t i = 0; i < kept.count; i++) {
        if (kept.fragments[i].primitive >= count)
            continue;
        size_t twin = i + 1;
        while (twin < kept.count && kept.fragments[twin].primitive != kept.fragments[i].primitive + count &&
               kept.fragments[twin].x == kept.fragments[i].x)
            twin++;
        assert_true(twin < kept.count && kept.fragments[twin].primitive == kept.fragments[i].primitive + count);
        assert_true(kept.fragments[twin].x == kept.fragments[i].x && kept.fragments[twin].y == kept.fragments[i].y);
        assert_true(kept.fragments[twin].depth == kept.fragments[i].depth);
        twins++;
    }
    assert_true(twins > 10000);
    kept_stop(&kept);
    model_list_clear(&list);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_demo_mesh_agrees),
        cmocka_unit_test(soups_agree),
        cmocka_unit_test(coplanar_and_non_manifold_faces_agree),
    };
    return cmocka_run_group_tests_name("embree", tests, NULL, NULL);
}
