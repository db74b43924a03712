// The programs beyond the first four against the model of their algorithms, on hundreds of random images: passes,
// iterations, composited fragments and every sample's colour; and whether the picture is exact where it claims to be
// and wrong where it is known to be.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "trace_images.h"

#include <math.h>

enum { IMAGES = 300, DEEP = 1000000 };

typedef model_result algorithm(const model_scene *scene);

static model_result hybrid(const model_scene *scene)
{
    return model_hybrid(scene, true);
}
static model_result hybrid_closed(const model_scene *scene)
{
    return model_hybrid(scene, false);
}
static model_result b(const model_scene *scene)
{
    return model_coherent_b(scene, false, DEEP);
}
static model_result vtk(const model_scene *scene)
{
    return model_vtk(scene, 0, 0);
}
static model_result eight(const model_scene *scene)
{
    return model_k_buffer(scene, 8);
}
static model_result eight_routed(const model_scene *scene)
{
    return model_stencil_routed(scene, 8);
}

static double difference(const model_result *a, const model_result *b, uint32_t s)
{
    double most = 0;
    for (int c = 0; c < 3; c++)
        most = fmax(most, fabs(a->rgb[s][c] - b->rgb[s][c]));
    return most;
}

static void assert_agrees(const char *what, uint64_t seed, const model_result *model, const run_result *run)
{
    double most = 0;
    for (uint32_t i = 0; i < 3 * run->width * run->height * run->samples; i++)
        most = fmax(most, fabs(model->rgb[i / 3][i % 3] - (double)run->sample_rgb[i]));
    if (run->geometry_passes != model->passes || run->iterations != model->iterations || most > 1e-5 ||
        run->fragments_composited != model->composited)
        fail_msg("%s, image %d: %d passes, %d iterations, %d composited, %g off; the model: %d, %d, %d", what,
                 (int)seed, (int)run->geometry_passes, (int)run->iterations, (int)run->fragments_composited, most,
                 (int)model->passes, (int)model->iterations, (int)model->composited);
}

// Samples of the trace that have two visible transparent fragments at one depth.
static bool *tied_samples(const model_scene *scene)
{
    model_state state;
    size_t *order, *start;
    bool *tied = calloc(scene->sample_count + 1u, sizeof *tied);
    assert_true(tied && model_start(&state, scene) && model_gather(&state, &order, &start));
    for (uint32_t s = 0; s < scene->sample_count; s++)
        for (size_t i = start[s]; i < start[s + 1]; i++)
            for (size_t j = start[s]; j < i; j++)
                tied[s] |= state.codes[order[i]] == state.codes[order[j]];
    free(order);
    free(start);
    model_result unused = model_finish(&state);
    model_free(&unused);
    return tied;
}

typedef struct tally {
    int wrong_images;
    uint64_t wrong_tied, wrong_untied;  // samples
} tally;

typedef small_trace image_of(uint64_t seed);

// Draws of the class `sorted` where each sample's fragments allow it: some of those that are not nearer than the last
// one.
static small_trace half_sorted_image(uint64_t seed)
{
    small_trace t = random_image(seed);
    uint64_t dice = seed;
    double *last = calloc(t.width * t.height * t.samples, sizeof *last);
    assert_non_null(last);
    for (size_t i = 0; i < t.count; i++) {
        model_fragment *f = &t.fragments[i];
        if (f->opaque)
            continue;
        f->sorted = f->depth >= last[f->sample] && below(&dice, 2);
        t.classes[i] = f->sorted ? CLASS_SORTED : CLASS_TRANSPARENT;
        if (f->sorted)
            last[f->sample] = f->depth;
    }
    free(last);
    return t;
}

// A pass over both classes counts in those that the trace has.
static bool has_both(const small_trace *t)
{
    bool has[CLASS_COUNT] = {false};
    for (size_t i = 0; i < t->count; i++)
        has[t->classes[i]] = true;
    return has[CLASS_TRANSPARENT] && has[CLASS_SORTED];
}

static run_result *run_on(const program *program, const char *name, const small_trace *t)
{
    machine machine;
    run_result *run = NULL;
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .reference = true};
    trace *opened = small_open(t);
    assert_int_equal(machine_load(name, NULL, &machine), STATUS_OK);
    assert_int_equal(machine_set(&machine, "depth_format=z32f", NULL), STATUS_OK);
    assert_int_equal(machine_set(&machine, "color_format=rgba32f", NULL), STATUS_OK);
    replay_run(program, &machine, opened, &options, NULL, &run);
    trace_close(opened);
    assert_non_null(run);
    return run;
}

static tally compare_images(const char *stem, const char *machine, image_of *image, algorithm *model_of)
{
    tally tally = {0};
    program *program = small_program(stem);
    assert_non_null(program);
    for (uint64_t seed = 1; seed <= IMAGES; seed++) {
        small_trace t = image(seed);
        const model_scene scene = small_scene(&t);
        model_result model = model_of(&scene), truth = model_exact(&scene);
        bool *tied = tied_samples(&scene);
        run_result *run = run_on(program, machine, &t);
        assert_agrees(stem, seed, &model, run);
        if (model.sorted_passes && has_both(&t)) {
            assert_int_equal(run->passes_by_class[CLASS_TRANSPARENT], model.unsorted_passes);
            assert_int_equal(run->passes_by_class[CLASS_SORTED], model.sorted_passes);
        }
        tally.wrong_images += !run->error.exact;
        for (uint32_t s = 0; s < scene.sample_count; s++) {
            const bool wrong = difference(&model, &truth, s) > 1e-5;
            tally.wrong_tied += wrong && tied[s];
            tally.wrong_untied += wrong && !tied[s];
        }
        free(tied);
        model_free(&model);
        model_free(&truth);
        result_destroy(run);
        small_free(&t);
    }
    program_destroy(program);
    return tally;
}

static tally compare(const char *stem, const char *machine, algorithm *model_of)
{
    return compare_images(stem, machine, random_image, model_of);
}

static void test_exact(void **state)
{
    (void)state;
    assert_int_equal(compare("coherent_layer_peel_b", "g80", b).wrong_images, 0);
    assert_int_equal(compare("fused_coherent_layer_peel", "programmable", model_fused).wrong_images, 0);
    assert_int_equal(compare("two_ended_coherent_layer_peel", "programmable", model_two_ended).wrong_images, 0);
}

static void test_hybrid(void **state)
{
    (void)state;
    tally printed = compare_images("hybrid_layer_peel", "g80", half_sorted_image, hybrid);
    print_message("algorithm 1 as printed is wrong in %d of %d images\n", printed.wrong_images, IMAGES);
    assert_true(printed.wrong_images > IMAGES / 4);
    assert_int_equal(compare_images("hybrid_layer_peel_closed", "g80", half_sorted_image, hybrid_closed).wrong_images,
                     0);
    compare("hybrid_layer_peel", "programmable", hybrid);  // the class `sorted` in any order: wrong in the same way
    compare("hybrid_layer_peel_closed", "programmable", hybrid_closed);
}

static void test_one_fragment_a_layer(void **state)
{
    (void)state;
    const tally everitt = compare("layer_peel_everitt", "g80", model_everitt);
    assert_true(everitt.wrong_tied > 100 && everitt.wrong_untied == 0);
    const tally stored = compare("vtk_depth_peel", "g80", vtk);
    assert_true(stored.wrong_tied == everitt.wrong_tied && stored.wrong_untied == 0);
}

static void test_vtk_limits(void **state)
{
    (void)state;
    program *program = small_program("vtk_depth_peel");
    assert_non_null(program);
    for (uint64_t seed = 1; seed <= IMAGES; seed++) {
        small_trace t = random_image(seed);
        const model_scene scene = small_scene(&t);
        const uint64_t peels = seed % 4 ? seed % 7 : 0;
        const double ratio = (double)(seed % 5) / 8;
        model_result model = model_vtk(&scene, peels, ratio);
        run_result *run = small_run_limited(program, "programmable", &t, peels, ratio);
        assert_non_null(run);
        assert_agrees("vtk_depth_peel with limits", seed, &model, run);
        model_free(&model);
        result_destroy(run);
        small_free(&t);
    }
    program_destroy(program);
}

// As random_image, with alphas from 0.1 on: then only ties are wrong.
static small_trace visible_image(uint64_t seed)
{
    small_trace t = random_image(seed);
    for (size_t i = 0; i < t.count; i++)
        t.fragments[i].rgba[3] = (double)(float)(0.1 + 0.9 * t.fragments[i].rgba[3]);
    return t;
}

static void test_dual(void **state)
{
    (void)state;
    const tally any = compare("dual_depth_peel", "g80", model_dual);
    const tally visible = compare_images("dual_depth_peel", "programmable", visible_image, model_dual);
    assert_true(visible.wrong_tied > 100 && visible.wrong_untied == 0);
    assert_true(any.wrong_untied > 0);  // the query did not see a back layer of alpha 0
}

static void test_b_printed(void **state)
{
    (void)state;
    int wrong = 0;
    program *program = small_program("coherent_layer_peel_b_printed");
    assert_non_null(program);
    for (uint64_t seed = 1; seed <= IMAGES; seed++) {
        small_trace t = random_image(seed);
        const model_scene scene = small_scene(&t);
        model_result model = model_coherent_b(&scene, true, 20);
        run_result *run = small_run_limited(program, "programmable", &t, 20, -1);
        assert_non_null(run);
        assert_agrees("coherent_layer_peel_b_printed", seed, &model, run);
        wrong += !run->error.exact;
        model_free(&model);
        result_destroy(run);
        small_free(&t);
    }
    program_destroy(program);
    print_message("B as printed is wrong in %d of %d images\n", wrong, IMAGES);
    assert_true(wrong > IMAGES / 4);
}

static void test_one_pass(void **state)
{
    (void)state;
    assert_true(compare("sorted_blend", "g80", model_sorted_blend).wrong_images > 0);
    assert_true(compare("k_buffer", "programmable", eight).wrong_images > 0);
    assert_true(compare("stencil_routed_k_buffer", "programmable", eight_routed).wrong_images > 0);
    assert_true(compare("weighted_average", "g80", model_weighted_average).wrong_images > 0);
    assert_true(compare("weighted_sum", "g80", model_weighted_sum).wrong_images > 0);
}

// A program with one of its parameters set, against a model that takes it too.
static void compare_with(const char *stem, const char *name, uint32_t value,
                         model_result (*model_of)(const model_scene *, uint32_t))
{
    char words[2 * NAME_SIZE], path[4096];
    program *program = NULL;
    snprintf(words, sizeof words, "%s,%s=%u", stem, name, value);
    assert_int_equal(program_load(words, NULL, path, sizeof path, &program), STATUS_OK);
    for (uint64_t seed = 1; seed <= 60; seed++) {
        small_trace t = random_image(seed);
        const model_scene scene = small_scene(&t);
        model_result model = model_of(&scene, value);
        run_result *run = small_run(program, "programmable", &t);
        assert_non_null(run);
        assert_agrees(words, seed, &model, run);
        model_free(&model);
        result_destroy(run);
        small_free(&t);
    }
    program_destroy(program);
}

static model_result any_peels(const model_scene *scene, uint32_t peels)
{
    (void)peels;  // planes only: what they cannot hold is blended earlier
    return model_vtk(scene, 0, 0);
}

static void test_parameters(void **state)
{
    (void)state;
    for (uint32_t k = 1; k <= 8; k++) {
        compare_with("k_buffer", "k", k, model_k_buffer);
        compare_with("stencil_routed_k_buffer", "k", k, model_stencil_routed);
    }
    for (uint32_t peels = 2; peels <= 5; peels += 3)
        compare_with("vtk_depth_peel", "peels", peels, any_peels);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exact),
        cmocka_unit_test(test_hybrid),
        cmocka_unit_test(test_one_fragment_a_layer),
        cmocka_unit_test(test_vtk_limits),
        cmocka_unit_test(test_dual),
        cmocka_unit_test(test_b_printed),
        cmocka_unit_test(test_one_pass),
        cmocka_unit_test(test_parameters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
