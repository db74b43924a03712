// From scene to fragments: camera, clipping, draw order, scenes and their keys, determinism.
#include "messages.h"
#include "raster_fixture.h"
#include "../../sim/raster/record.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <unistd.h>
#include <cmocka.h>

// Records one scene into `kept`; the models stay until recorded_stop.
typedef struct recorded {
    kept kept;
    model_list models;
    view view;
    messages said;
} recorded;

static status try_record(recorded *r, const char *scene, const record_options *options)
{
    messages_start(&r->said);
    return record_prepare(&scene, 1, options, &r->said.report, &r->models, &r->view);
}

static void run_record(recorded *r, const record_options *options)
{
    kept_start(&r->kept, options->width, options->height, options->samples);
    rasterizer_destroy(r->kept.rasterizer);
    record_trace_info(options, &r->kept.info);
    r->kept.rasterizer = rasterizer_create(&r->kept.info, (fragment_sink){keep, &r->kept});
    uint32_t primitive = 0;
    for (uint32_t i = 0; i < r->models.count; i++) {
        assert_int_equal(record_model(&r->models.models[i], &r->view, options, primitive, r->kept.rasterizer, NULL),
                         STATUS_OK);
        primitive += r->models.models[i].mesh->triangle_count;
    }
}

static void start_record(recorded *r, const char *scene, const record_options *options)
{
    if (try_record(r, scene, options))
        fail_msg("%s: %s", scene, r->said.text);
    run_record(r, options);
}

static void stop_record(recorded *r)
{
    kept_stop(&r->kept);
    model_list_clear(&r->models);
}

static record_options small(void)
{
    record_options options;
    record_defaults(&options);
    options.width = options.height = 64;
    return options;
}

// A list of one draw with one triangle.
static void one_triangle(recorded *r, const float corners[3][3])
{
    r->models = (model_list){0};
    mesh *mesh = mesh_allocate(3, 1);
    assert_non_null(mesh);
    memcpy(mesh->positions, corners, sizeof(float[3][3]));
    for (uint32_t i = 0; i < 3; i++)
        mesh->triangles[0][i] = i;
    assert_int_equal(model_add(&r->models, "one", CLASS_TRANSPARENT, mesh, NULL, NULL), STATUS_OK);
}

static void sheets_fill_every_pixel_at_their_depths(void **state)
{
    (void)state;
    for (int samples = 1; samples <= 8; samples *= 2) {
        recorded r;
        record_options options = small();
        options.samples = (uint32_t)samples;
        options.width = 96;  // not square
        start_record(&r, "scene:sheets,count=5", &options);
        assert_int_equal(r.kept.count, 96u * 64 * 5 * (uint32_t)samples);
        double depth = 0;
        for (size_t i = 0; i < r.kept.count; i++) {
            const kept_fragment *f = &r.kept.fragments[i];
            assert_true(f->depth > 0 && f->depth < 1);
            assert_int_equal(f->primitive, i / (96 * 64 * (size_t)samples));
            if (i % (96 * 64 * (size_t)samples) == 0) {
                assert_true(f->depth > depth);
                depth = f->depth;
            }
            assert_true(f->depth == depth);  // one layer has one depth, to the last bit
        }
        stop_record(&r);
    }
}

static void expect_layers(const char *scene, const uint32_t *layers, uint32_t count)
{
    recorded r;
    record_options options = small();
    start_record(&r, scene, &options);
    size_t a_layer = 64 * 64;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t nearer = 0;
        for (uint32_t j = 0; j < count; j++)
            nearer += r.kept.fragments[j * a_layer].depth < r.kept.fragments[i * a_layer].depth;
        assert_int_equal(nearer, layers[i]);
    }
    stop_record(&r);
}

static void sheets_come_in_the_order_asked_for(void **state)
{
    (void)state;
    expect_layers("scene:sheets,count=5,order=sorted", (const uint32_t[]){0, 1, 2, 3, 4}, 5);
    expect_layers("scene:sheets,count=5,order=reversed", (const uint32_t[]){4, 3, 2, 1, 0}, 5);
    expect_layers("scene:sheets,count=5,order=block:2", (const uint32_t[]){4, 2, 3, 0, 1}, 5);
    expect_layers("scene:sheets,count=6,order=shuffled,seed=3", (const uint32_t[]){5, 0, 2, 4, 1, 3}, 6);
}

static void slices_are_sorted_and_the_cone_crosses_them(void **state)
{
    (void)state;
    recorded r;
    record_options options = small();
    start_record(&r, "scene:slices_cone,slices=16,grid=4", &options);
    assert_int_equal(r.models.count, 2);
    assert_int_equal(r.models.models[0].class, CLASS_SORTED);
    assert_int_equal(r.models.models[1].class, CLASS_TRANSPARENT);
    static double last[64 * 64];
    static uint8_t slices[64 * 64], cone[64 * 64];
    memset(last, 0, sizeof last);
    memset(slices, 0, sizeof slices);
    memset(cone, 0, sizeof cone);
    for (size_t i = 0; i < r.kept.count; i++) {
        const kept_fragment *f = &r.kept.fragments[i];
        size_t pixel = f->y * 64u + f->x;
        if (f->primitive < r.models.models[0].mesh->triangle_count) {
            assert_true(f->depth > last[pixel]);
            last[pixel] = f->depth;
            slices[pixel]++;
        } else {
            cone[pixel]++;
        }
    }
    assert_int_equal(slices[32 * 64 + 32], 16);
    assert_int_equal(cone[32 * 64 + 32], 2);
    int most = 0, pixels = 0;
    for (int i = 0; i < 64 * 64; i++) {
        most = slices[i] + cone[i] > most ? slices[i] + cone[i] : most;
        pixels += slices[i] > 0;
    }
    assert_int_equal(most, 18);
    assert_true(pixels > 64 * 64 * 6 / 10);
    stop_record(&r);
}

static void near_and_far_cut_exactly(void **state)
{
    (void)state;
    recorded r;
    record_options options = small();
    options.camera.eye_set = options.camera.target_set = true;
    options.camera.target[2] = -1;
    options.camera.near = 1;
    options.camera.far = 3;
    for (int mode = 0; mode < 4; mode++) {
        options.camera.ortho = mode & 1;
        options.camera.ortho_height = 4;
        options.camera.reverse_z = mode & 2;
        // A floor that runs from behind the eye to far beyond the far plane, much wider than the view.
        one_triangle(&r, (const float[3][3]){{-1000, -0.3f, 1000}, {1000, -0.3f, 1000}, {0, -0.3f, -3000}});
        if (options.camera.ortho) {
            // Seen edge-on from the front, so tilt it: z from 10 to -10 over the view's height.
            model_list_clear(&r.models);
            one_triangle(&r, (const float[3][3]){{-1000, -20, 20}, {1000, -20, 20}, {0, 2000, -2000}});
        }
        messages_start(&r.said);
        assert_int_equal(view_fit(&options.camera, &r.models, 64, 64, &r.said.report, &r.view), STATUS_OK);
        run_record(&r, &options);
        assert_true(r.kept.count > 64);
        int rows[64] = {0};
        for (size_t i = 0; i < r.kept.count; i++) {
            const kept_fragment *f = &r.kept.fragments[i];
            rows[f->y]++;
            // The surface's distance along the view at this row, in closed form.
            double ndc_y = 1 - (f->y + 0.5) / 32, tangent = angle_tangent(30.0 / 720);
            double distance = options.camera.ortho ? ndc_y * 2 : 0.3 / (-ndc_y * tangent);
            double depth = options.camera.ortho ? (distance - 1) / 2 : 3.0 / 2 * (1 - 1 / distance);
            assert_true(distance > 0.99 && distance < 3.01);
            // Snapping moves corners by up to 1/512 pixel in x and y.
            assert_true(fabs(f->depth - depth) < 2e-3);
        }
        for (int y = 0; y < 64; y++)
            assert_true(rows[y] == 0 || rows[y] == 64);
        stop_record(&r);
    }
}

// A triangle whose corners lie 1e6 view widths away covers what the exact one does: the whole view.
static void huge_triangles_are_not_clipped_away(void **state)
{
    (void)state;
    recorded r;
    record_options options = small();
    options.camera = (camera){
        .ortho = true, .ortho_height = 2, .eye = {0, 0, 5}, .eye_set = true, .target_set = true, .near = 1, .far = 10};
    one_triangle(&r, (const float[3][3]){{-2e6f, -2e6f, 0}, {2e6f, -2e6f, 0}, {0, 4e6f, 0}});
    messages_start(&r.said);
    assert_int_equal(view_fit(&options.camera, &r.models, 64, 64, &r.said.report, &r.view), STATUS_OK);
    run_record(&r, &options);
    assert_int_equal(r.kept.count, 64 * 64);
    for (size_t i = 0; i < r.kept.count; i++)
        assert_true(fabs(r.kept.fragments[i].depth - 4.0 / 9) < 1e-15);
    stop_record(&r);
    // Beyond the guard band as well: 1e12 views.
    one_triangle(&r, (const float[3][3]){{-2e12f, -2e12f, 0}, {2e12f, -2e12f, 0}, {0, 4e12f, 0}});
    assert_int_equal(view_fit(&options.camera, &r.models, 64, 64, &r.said.report, &r.view), STATUS_OK);
    run_record(&r, &options);
    assert_int_equal(r.kept.count, 64 * 64);
    stop_record(&r);
}

static double centroid(const recorded *r, uint32_t triangle)
{
    const mesh *mesh = r->models.models[0].mesh;
    return (double)(mesh->positions[mesh->triangles[triangle][0]][2] +
                    mesh->positions[mesh->triangles[triangle][1]][2] +
                    mesh->positions[mesh->triangles[triangle][2]][2]);
}

static void orders_are_by_centroid_along_the_view(void **state)
{
    (void)state;
    enum { COUNT = 300, BUCKETS = 7 };
    recorded r;
    record_options options = small();
    assert_int_equal(try_record(&r, "scene:soup,count=300", &options), STATUS_OK);
    uint32_t order[COUNT], again[COUNT];
    triangle_order kinds[] = {ORDER_NONE, ORDER_FRONT, ORDER_BACK, ORDER_BUCKET, ORDER_SHUFFLE};
    double low = 1e9, high = -1e9;
    for (uint32_t i = 0; i < COUNT; i++) {
        low = fmin(low, centroid(&r, i));
        high = fmax(high, centroid(&r, i));
    }
    for (int k = 0; k < 5; k++) {
        uint64_t parameter = kinds[k] == ORDER_BUCKET ? BUCKETS : 42;
        assert_int_equal(triangle_order_fill(&r.models.models[0], &r.view, kinds[k], parameter, NULL, order),
                         STATUS_OK);
        bool seen[COUNT] = {false};
        uint32_t in_place = 0;
        for (uint32_t i = 0; i < COUNT; i++) {
            assert_false(seen[order[i]]);
            seen[order[i]] = true;
            in_place += order[i] == i;
            if (!i)
                continue;
            double before = centroid(&r, order[i - 1]), after = centroid(&r, order[i]);  // larger z is nearer
            if (kinds[k] == ORDER_FRONT)
                assert_true(before > after - 1e-6);
            if (kinds[k] == ORDER_BACK)
                assert_true(before < after + 1e-6);
            int bucket_before = (int)((high - before) / (high - low) * BUCKETS * 0.99999),
                bucket = (int)((high - after) / (high - low) * BUCKETS * 0.99999);
            if (kinds[k] == ORDER_BUCKET)
                assert_true(bucket_before < bucket || (bucket_before == bucket && order[i - 1] < order[i]));
        }
        assert_true(kinds[k] == ORDER_NONE ? in_place == COUNT : in_place < COUNT / 10);
        triangle_order_fill(&r.models.models[0], &r.view, kinds[k], parameter, NULL, again);
        assert_memory_equal(order, again, sizeof order);
    }
    r.models.models[0].class = CLASS_SORTED;  // keeps its promise
    triangle_order_fill(&r.models.models[0], &r.view, ORDER_SHUFFLE, 1, NULL, order);
    for (uint32_t i = 0; i < COUNT; i++)
        assert_int_equal(order[i], i);
    model_list_clear(&r.models);
}

static void bad_words_are_refused_with_what_is_accepted(void **state)
{
    (void)state;
    static const char *const cases[][2] = {
        {"scene:nothing", "slices_cone"},
        {"scene:soup,colour=1", "count=integer 1 to 4000000"},
        {"scene:soup,count=0", "1 to 4000000"},
        {"scene:soup,count=2.5", "count"},
        {"scene:soup,count", "count"},
        {"scene:soup,count=", "count"},
        {"scene:soup,count=3x", "count"},
        {"scene:soup,count=3,count=4", "twice"},
        {"scene:soup,size=nan", "size"},
        {"scene:soup,size=1e9", "0.0001 to 8"},
        {"scene:sheets,order=block", "block:"},
        {"scene:sheets,order=block:0", "block:"},
        {"scene:sheets,order=up", "sorted reversed"},
        {"scene:soup,", "count"},
        {"nothing.here", ".ply"},
    };
    record_options options = small();
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        recorded r;
        assert_int_equal(try_record(&r, cases[i][0], &options), STATUS_USAGE);
        if (!strstr(r.said.text, cases[i][1]))
            fail_msg("%s: expected '%s' in: %s", cases[i][0], cases[i][1], r.said.text);
    }
}

static void cameras_that_see_nothing_are_refused(void **state)
{
    (void)state;
    recorded r;
    record_options options = small();
    options.camera.near = 5;
    options.camera.far = 4;
    assert_int_equal(try_record(&r, "scene:knot,rings=8", &options), STATUS_USAGE);
    assert_non_null(strstr(r.said.text, "near must be below far"));
    options = small();
    options.camera.fov_degrees = 180;
    assert_int_equal(try_record(&r, "scene:knot,rings=8", &options), STATUS_USAGE);
    options = small();
    options.camera.up_set = true;
    options.camera.up[2] = 1;
    assert_int_equal(try_record(&r, "scene:knot,rings=8", &options), STATUS_USAGE);
    assert_non_null(strstr(r.said.text, "up points along the view"));
    options = small();
    options.samples = 3;
    assert_int_equal(try_record(&r, "scene:knot,rings=8", &options), STATUS_USAGE);
    options = small();
    options.camera.eye_set = true;
    options.camera.eye[1] = 20;  // straight down: up is settled all the same
    start_record(&r, "scene:knot", &options);
    assert_true(r.kept.count > 50);
    stop_record(&r);
}

static void the_default_camera_shows_everything(void **state)
{
    (void)state;
    for (int ortho = 0; ortho < 2; ortho++) {
        recorded r;
        record_options options = small();
        options.camera.ortho = ortho;
        start_record(&r, "scene:knot", &options);
        int low[2] = {64, 64}, high[2] = {0, 0};
        for (size_t i = 0; i < r.kept.count; i++) {
            int at[2] = {r.kept.fragments[i].x, r.kept.fragments[i].y};
            for (int c = 0; c < 2; c++) {
                low[c] = at[c] < low[c] ? at[c] : low[c];
                high[c] = at[c] > high[c] ? at[c] : high[c];
            }
            assert_true(r.kept.fragments[i].depth > 0.005 && r.kept.fragments[i].depth < 0.995);
        }
        assert_true(low[0] > 0 && low[1] > 0 && high[0] < 63 && high[1] < 63);
        assert_true(high[0] - low[0] > 54 || high[1] - low[1] > 54);  // and fills the view one way
        stop_record(&r);
    }
}

// Closed: at every sample as many front faces as back faces, so an even number of layers.
static void the_knot_is_closed(void **state)
{
    (void)state;
    recorded r;
    record_options options = small();
    options.samples = 4;
    start_record(&r, "scene:knot", &options);
    static uint8_t layers[64 * 64 * 4];
    memset(layers, 0, sizeof layers);
    int most = 0;
    for (size_t i = 0; i < r.kept.count; i++) {
        size_t sample = (r.kept.fragments[i].y * 64u + r.kept.fragments[i].x) * 4 + r.kept.fragments[i].sample;
        most = ++layers[sample] > most ? layers[sample] : most;
    }
    for (int i = 0; i < 64 * 64 * 4; i++)
        assert_true(layers[i] % 2 == 0);
    assert_true(most >= 4);
    stop_record(&r);
}

static void recordings_repeat_to_the_bit(void **state)
{
    (void)state;
    static const char *const scenes[] = {"scene:soup,count=50,seed=9", "scene:knot,rings=64",
                                         "opaque:scene:sheets,order=shuffled", "scene:slices_cone,slices=4"};
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        recorded a, b;
        record_options options = small();
        options.samples = 2;
        options.order = ORDER_BUCKET;
        options.order_parameter = 16;
        start_record(&a, scenes[s], &options);
        start_record(&b, scenes[s], &options);
        assert_int_equal(a.kept.count, b.kept.count);
        for (size_t i = 0; i < a.kept.count; i++) {
            assert_true(a.kept.fragments[i].depth == b.kept.fragments[i].depth &&
                        a.kept.fragments[i].primitive == b.kept.fragments[i].primitive);
            assert_memory_equal(a.kept.fragments[i].rgba, b.kept.fragments[i].rgba, sizeof a.kept.fragments[i].rgba);
        }
        stop_record(&a);
        stop_record(&b);
    }
}

static void reverse_z_keeps_distances_from_the_far_plane(void **state)
{
    (void)state;
    recorded plain, reversed;
    record_options options = small();
    options.camera.near = 1e-3;
    options.camera.far = 1e5;
    start_record(&plain, "scene:sheets,count=3", &options);
    options.camera.reverse_z = true;
    start_record(&reversed, "scene:sheets,count=3", &options);
    assert_true(reversed.kept.info.reversed_depth && !plain.kept.info.reversed_depth);
    assert_int_equal(plain.kept.count, reversed.kept.count);
    for (size_t i = 0; i < plain.kept.count; i++)
        assert_true(fabs(plain.kept.fragments[i].depth - reversed.kept.fragments[i].depth) <= 4 * 0x1p-53);
    stop_record(&plain);
    stop_record(&reversed);
}

// The whole way: a file that the checker accepts and that says what was recorded.
static void a_trace_is_written(void **state)
{
    (void)state;
    char path[] = "/tmp/ropsim-record-XXXXXX.ropt";
    int file = mkstemps(path, 5);
    assert_true(file >= 0);
    close(file);
    messages said;
    messages_start(&said);
    record_options options = small();
    options.camera.reverse_z = true;
    const char *scenes[] = {"scene:slices_cone,slices=3", "opaque:scene:soup,count=10"};
    assert_int_equal(record_scenes(scenes, 2, &options, path, &said.report), STATUS_OK);
    assert_int_equal(trace_check(path, &said.report), STATUS_OK);
    trace *trace;
    assert_int_equal(trace_open(path, &said.report, &trace), STATUS_OK);
    const trace_info *info = trace_get_info(trace);
    assert_int_equal(info->draw_count, 3);
    assert_string_equal(info->draws[1].name, "cone");
    assert_int_equal(info->draws[0].class, CLASS_SORTED);
    assert_int_equal(info->draws[2].class, CLASS_OPAQUE);
    assert_int_equal(info->draws[2].triangles, 10);
    assert_true(info->reversed_depth);
    trace_close(trace);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sheets_fill_every_pixel_at_their_depths),
        cmocka_unit_test(sheets_come_in_the_order_asked_for),
        cmocka_unit_test(slices_are_sorted_and_the_cone_crosses_them),
        cmocka_unit_test(near_and_far_cut_exactly),
        cmocka_unit_test(huge_triangles_are_not_clipped_away),
        cmocka_unit_test(orders_are_by_centroid_along_the_view),
        cmocka_unit_test(bad_words_are_refused_with_what_is_accepted),
        cmocka_unit_test(cameras_that_see_nothing_are_refused),
        cmocka_unit_test(the_default_camera_shows_everything),
        cmocka_unit_test(the_knot_is_closed),
        cmocka_unit_test(recordings_repeat_to_the_bit),
        cmocka_unit_test(reverse_z_keeps_distances_from_the_far_plane),
        cmocka_unit_test(a_trace_is_written),
    };
    return cmocka_run_group_tests_name("record", tests, NULL, NULL);
}
