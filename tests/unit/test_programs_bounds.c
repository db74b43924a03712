// What is known of passes, beyond single images: the figures of 64 layers in each order, the papers' volume, how the
// fused and the two-ended program bound each other, and the smallest images that a program gets wrong.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "trace_images.h"

#include <math.h>

enum { LAYERS_MAX = 300, SHUFFLES = 40 };
typedef enum order { SORTED, REVERSED, SHUFFLED } order;

static small_trace stack(size_t count, order order, uint64_t seed)
{
    double depths[LAYERS_MAX];
    for (size_t i = 0; i < count; i++)
        depths[i] = (double)(order == REVERSED ? count - i : i + 1) / (double)(count + 1);
    for (size_t i = count; order == SHUFFLED && i > 1; i--) {
        const size_t j = below(&seed, (uint32_t)i);
        const double swap = depths[i - 1];
        depths[i - 1] = depths[j];
        depths[j] = swap;
    }
    return small_layers(depths, count);
}

static run_result *run_text(const char *stem, const small_trace *t)
{
    program *program = small_program(stem);
    run_result *run = small_run(program, "programmable", t);
    assert_non_null(run);
    program_destroy(program);
    return run;
}

typedef struct figures {
    uint64_t iterations, passes, fullscreen;
    bool exact;
} figures;

static void expect(const char *stem, size_t count, order order, figures expected)
{
    small_trace t = stack(count, order, 1);
    run_result *run = run_text(stem, &t);
    if (run->iterations != expected.iterations || run->geometry_passes != expected.passes ||
        run->fullscreen_passes != expected.fullscreen || run->error.exact != expected.exact)
        fail_msg("%s, %zu layers: %d iterations, %d passes, %d full-screen, %s", stem, count, (int)run->iterations,
                 (int)run->geometry_passes, (int)run->fullscreen_passes, run->error.exact ? "exact" : "wrong");
    if (expected.exact)
        assert_int_equal(run->fragments_composited, count);
    result_destroy(run);
    small_free(&t);
}

static void test_orders(void **state)
{
    (void)state;
    expect("sorted_blend", 64, SORTED, (figures){0, 1, 0, true});
    expect("sorted_blend", 64, REVERSED, (figures){0, 1, 0, false});
    for (order order = SORTED; order <= SHUFFLED; order++) {
        expect("layer_peel_everitt", 64, order, (figures){65, 65, 65, true});
        expect("hybrid_layer_peel", 64, order, (figures){65, 129 + 65, 0, true});
        expect("hybrid_layer_peel_closed", 64, order, (figures){65, 130, 64, true});
        expect("dual_depth_peel", 64, order, (figures){33, 34, 34, true});
        expect("vtk_depth_peel", 64, order, (figures){65, 65, 65 + 8, true});
        expect("stencil_routed_k_buffer", 8, order, (figures){1, 1, 2, true});
        expect("k_buffer", 8, order, (figures){0, 1, 1, true});
    }
    expect("coherent_layer_peel_b", 64, SORTED, (figures){2, 10, 0, true});
    expect("coherent_layer_peel_b", 64, REVERSED, (figures){33, 165, 0, true});
    expect("coherent_layer_peel_b", 128, SORTED, (figures){2, 10, 0, true});
    expect("coherent_layer_peel_b", 129, SORTED, (figures){3, 15, 0, true});
    expect("coherent_layer_peel_b", 257, SORTED, (figures){4, 20, 0, true});
    expect("coherent_layer_peel_b", 300, REVERSED, (figures){151, 755, 0, true});
    expect("fused_coherent_layer_peel", 64, SORTED, (figures){2, 2, 2, true});
    expect("fused_coherent_layer_peel", 64, REVERSED, (figures){65, 65, 65, true});
    expect("two_ended_coherent_layer_peel", 64, SORTED, (figures){2, 2, 3, true});
    expect("two_ended_coherent_layer_peel", 64, REVERSED, (figures){33, 33, 34, true});
    expect("two_ended_coherent_layer_peel", 65, REVERSED, (figures){34, 34, 35, true});
    expect("dual_depth_peel", 1, SORTED, (figures){1, 2, 2, true});
    expect("dual_depth_peel", 65, SORTED, (figures){33, 34, 34, true});
}

// Means over shuffles of 64 layers.
static void test_shuffled_means(void **state)
{
    (void)state;
    double fused = 0, two_ended = 0;
    for (uint64_t seed = 1; seed <= SHUFFLES; seed++) {
        small_trace t = stack(64, SHUFFLED, seed);
        run_result *run = run_text("fused_coherent_layer_peel", &t);
        fused += (double)run->geometry_passes / SHUFFLES;
        result_destroy(run);
        run = run_text("two_ended_coherent_layer_peel", &t);
        two_ended += (double)run->geometry_passes / SHUFFLES;
        assert_true(run->error.exact);
        result_destroy(run);
        small_free(&t);
    }
    print_message("64 shuffled layers: fused %.1f, two-ended %.1f passes\n", fused, two_ended);
    assert_true(fabs(fused - 38) < 2 && fabs(two_ended - 18) < 1.5);
}

// Most layers at one sample: distinct depths between the near plane and the opaque surface.
static uint64_t deepest(const model_scene *scene)
{
    model_state state;
    size_t *order, *start;
    uint64_t most = 0;
    assert_true(model_start(&state, scene) && model_gather(&state, &order, &start));
    for (uint32_t s = 0; s < scene->sample_count; s++) {
        uint64_t layers = 0;
        for (size_t i = start[s]; i < start[s + 1]; i++) {
            bool again = false;
            for (size_t j = start[s]; j < i; j++)
                again |= state.codes[order[j]] == state.codes[order[i]];
            layers += !again;
        }
        most = layers > most ? layers : most;
    }
    free(order);
    free(start);
    model_result unused = model_finish(&state);
    model_free(&unused);
    return most;
}

static void check_bounds(const program *two_ended, const program *fused, const small_trace *t, uint64_t seed)
{
    const model_scene scene = small_scene(t);
    model_result ideal = model_ideal(&scene, false);
    run_result *ours = small_run(two_ended, "programmable", t), *one_ended = small_run(fused, "programmable", t);
    assert_non_null(ours);
    assert_non_null(one_ended);
    const uint64_t layers = deepest(&scene), passes = ours->geometry_passes;
    if (!ours->error.exact || !one_ended->error.exact || passes > one_ended->geometry_passes ||
        passes > (layers + 1) / 2 + 1 || one_ended->geometry_passes > ideal.passes)
        fail_msg("image %d: %d layers, two-ended %d passes, fused %d, ideal %d", (int)seed, (int)layers, (int)passes,
                 (int)one_ended->geometry_passes, (int)ideal.passes);
    result_destroy(ours);
    result_destroy(one_ended);
    model_free(&ideal);
}

static void test_bounds(void **state)
{
    (void)state;
    program *two_ended = small_program("two_ended_coherent_layer_peel"),
            *fused = small_program("fused_coherent_layer_peel");
    assert_true(two_ended && fused);
    for (uint64_t seed = 1; seed <= 2000; seed++) {  // one sample; depths from a grid that ties or hardly ties
        uint64_t dice = seed;
        double depths[24];
        const size_t count = below(&dice, 25);
        const uint32_t grid = seed % 2 ? 12 : 1000;
        for (size_t i = 0; i < count; i++)
            depths[i] = (double)below(&dice, grid + 1) / grid;
        small_trace t = small_layers(depths, count);
        check_bounds(two_ended, fused, &t, seed);
        small_free(&t);
    }
    for (uint64_t seed = 1000; seed < 1400; seed++) {
        small_trace t = random_image(seed);
        check_bounds(two_ended, fused, &t, seed);
        small_free(&t);
    }
    program_destroy(two_ended);
    program_destroy(fused);
}

// The papers' volume: 256 slices in order and a cone of two layers.
static void test_volume(void **state)
{
    (void)state;
    static const char *const scenes[] = {"scene:slices_cone,slices=256"};
    static const char *const stems[] = {"hybrid_layer_peel", "hybrid_layer_peel_closed"};
    char folder[] = "/tmp/ropsim-volume-XXXXXX", path[64];
    record_options options;
    machine machine;
    trace *trace = NULL;
    record_defaults(&options);
    options.width = options.height = 32;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/volume.ropt", folder);
    assert_int_equal(record_scenes(scenes, 1, &options, path, NULL), STATUS_OK);
    assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    for (int i = 0; i < 2; i++) {
        program *program = small_program(stems[i]);
        run_result *run = NULL;
        const run_options run_options = {.threads = 1, .occlusion_ratio = -1, .reference = true};
        assert_int_equal(replay_run(program, &machine, trace, &run_options, NULL, &run), STATUS_OK);
        assert_int_equal(run->iterations, 3);
        assert_int_equal(run->passes_by_class[CLASS_TRANSPARENT], 5);
        assert_int_equal(run->passes_by_class[CLASS_SORTED], 3);
        assert_true(run->error.exact);
        result_destroy(run);
        program_destroy(program);
        trace_rewind(trace);
    }
    trace_close(trace);
    unlink(path);
    rmdir(folder);
}

// ---- The smallest images -------------------------------------------------------------------------------

static void add(small_trace *t, uint32_t x, draw_class class, double depth, float alpha)
{
    const float rgba[4] = {(float)(t->count % 3) / 2, (float)(t->count % 2), 0.25f, alpha};
    small_add(t, x, 0, 0, class, depth, rgba);
}

static void expect_composited(const char *stem, small_trace *t, uint64_t composited, bool exact)
{
    run_result *run = run_text(stem, t);
    if (run->fragments_composited != composited || run->error.exact != exact)
        fail_msg("%s: %d composited, %s", stem, (int)run->fragments_composited, run->error.exact ? "exact" : "wrong");
    result_destroy(run);
}

static void test_hybrid_ties(void **state)
{
    (void)state;
    small_trace t = {.width = 1, .height = 1, .samples = 1, .background = {0.5f, 0.5f, 0.5f, 1}};
    add(&t, 0, CLASS_SORTED, 0.5, 0.5f);
    add(&t, 0, CLASS_TRANSPARENT, 0.5, 0.5f);
    add(&t, 0, CLASS_SORTED, 0.5, 0.5f);
    expect_composited("hybrid_layer_peel", &t, 1, false);
    expect_composited("hybrid_layer_peel_closed", &t, 3, true);
    small_free(&t);
    // An unsorted fragment on the opaque surface of a finished sample, while another sample goes on for two iterations.
    t = (small_trace){.width = 2, .height = 1, .samples = 1};
    add(&t, 0, CLASS_OPAQUE, 0.5, 1);
    add(&t, 0, CLASS_TRANSPARENT, 0.5, 0.5f);
    add(&t, 1, CLASS_TRANSPARENT, 0.5, 0.5f);
    add(&t, 1, CLASS_TRANSPARENT, 0.6, 0.5f);
    expect_composited("hybrid_layer_peel", &t, 4, false);
    expect_composited("hybrid_layer_peel_closed", &t, 2, true);
    small_free(&t);
}

// 0.6 * 0.5 is nearer than the third surface: the span is empty, and nothing is composited at all.
static void test_b_third_surface(void **state)
{
    (void)state;
    static const double depths[] = {0.6, 0.5, 0.4};
    for (size_t count = 2; count <= 3; count++) {
        small_trace t = small_layers(depths, count);
        expect_composited("coherent_layer_peel_b", &t, count, true);
        expect_composited("coherent_layer_peel_b_printed", &t, count == 2 ? 2 : 0, count == 2);
        small_free(&t);
    }
}

// Of four layers the farthest has alpha 0: the query sees no back layer, and the two in the middle are never peeled.
static void test_dual_alpha_zero(void **state)
{
    (void)state;
    small_trace t = {.width = 1, .height = 1, .samples = 1, .background = {0.5f, 0.5f, 0.5f, 1}};
    for (int i = 1; i <= 4; i++)
        add(&t, 0, CLASS_TRANSPARENT, i / 5.0, i == 4 ? 0 : 0.5f);
    run_result *run = run_text("dual_depth_peel", &t);
    assert_int_equal(run->geometry_passes, 2);
    assert_false(run->error.exact);
    result_destroy(run);
    expect_composited("layer_peel_everitt", &t, 4, true);
    small_free(&t);
}

// k late is in time, k + 1 is not.
static void test_k_late(void **state)
{
    (void)state;
    for (size_t late = 8; late <= 9; late++) {
        small_trace t = {.width = 1, .height = 1, .samples = 1};
        for (size_t i = 0; i < late; i++)
            add(&t, 0, CLASS_TRANSPARENT, 0.2 + (double)i / 20, 0.5f);
        add(&t, 0, CLASS_TRANSPARENT, 0.1, 0.5f);
        expect_composited("k_buffer", &t, late + 1, late == 8);
        small_free(&t);
    }
}

static void test_routing_ends(void **state)
{
    (void)state;
    expect("stencil_routed_k_buffer", 248, SORTED, (figures){31, 31, 62, true});
    expect("stencil_routed_k_buffer", 256, SORTED, (figures){32, 32, 64, false});
}

// All alphas 0: the background stays; and a weight below 0.
static void test_weights(void **state)
{
    (void)state;
    small_trace t = {.width = 1, .height = 1, .samples = 1, .background = {0.25f, 0.5f, 1, 1}};
    add(&t, 0, CLASS_TRANSPARENT, 0.5, 0);
    add(&t, 0, CLASS_TRANSPARENT, 0.6, 0);
    expect_composited("weighted_average", &t, 2, true);
    small_free(&t);
    t = (small_trace){.width = 1, .height = 1, .samples = 1, .background = {0.25f, 0.5f, 1, 1}};
    add(&t, 0, CLASS_TRANSPARENT, 0.5, 1);     // 0, 0, 0.25
    add(&t, 0, CLASS_TRANSPARENT, 0.6, 0.5f);  // 0.5, 1, 0.25
    run_result *run = run_text("weighted_sum", &t);
    assert_true(run->sample_rgb[0] == 0.25f - 0.5f * 0.25f);
    assert_true(run->sample_rgb[2] == 0.25f + 0.125f - 0.5f);
    result_destroy(run);
    small_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_orders),          cmocka_unit_test(test_shuffled_means),
        cmocka_unit_test(test_bounds),          cmocka_unit_test(test_hybrid_ties),
        cmocka_unit_test(test_b_third_surface), cmocka_unit_test(test_dual_alpha_zero),
        cmocka_unit_test(test_k_late),          cmocka_unit_test(test_routing_ends),
        cmocka_unit_test(test_weights),         cmocka_unit_test(test_volume),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
