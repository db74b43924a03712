// Each program against the model of its algorithm, on hundreds of random images: passes, iterations, composited
// fragments and every sample's colour. The images have ties, opaque surfaces, several samples and blocks of order.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "trace_images.h"

#include <math.h>

enum { IMAGES = 400 };

static model_result exact(const model_scene *scene)
{
    return model_exact(scene);
}
static model_result layers(const model_scene *scene)
{
    return model_layer_peel(scene);
}
static model_result coherent(const model_scene *scene)
{
    return model_coherent_a(scene, NULL);
}
static model_result ideal(const model_scene *scene)
{
    return model_ideal(scene, false);
}
static model_result printed(const model_scene *scene)
{
    return model_ideal(scene, true);
}

static double difference(const model_result *model, const run_result *run, uint32_t samples)
{
    double most = 0;
    for (uint32_t i = 0; i < 3 * samples; i++)
        most = fmax(most, fabs(model->rgb[i / 3][i % 3] - (double)run->sample_rgb[i]));
    return most;
}

// Returns how many images came out wrong by the exact result.
static int compare_program(const char *stem, model_result (*algorithm)(const model_scene *), bool counts_composited)
{
    program *program = small_program(stem);
    assert_non_null(program);
    int wrong = 0;
    for (uint64_t seed = 1; seed <= IMAGES; seed++) {
        small_trace t = random_image(seed);
        const model_scene scene = small_scene(&t);
        model_result expected = algorithm(&scene), truth = exact(&scene);
        run_result *run = small_run(program, "programmable", &t);
        assert_non_null(run);
        assert_non_null(expected.rgb);
        const double off = difference(&expected, run, scene.sample_count);
        if (run->geometry_passes != expected.passes || run->iterations != expected.iterations || off > 1e-5 ||
            (counts_composited && run->fragments_composited != expected.composited))
            fail_msg("%s, image %d: %d passes, %d iterations, %d composited, %g off; the model: %d, %d, %d", stem,
                     (int)seed, (int)run->geometry_passes, (int)run->iterations, (int)run->fragments_composited, off,
                     (int)expected.passes, (int)expected.iterations, (int)expected.composited);
        const bool is_exact = difference(&truth, run, scene.sample_count) <= 1e-5;
        assert_int_equal(run->error.exact, is_exact);
        wrong += !is_exact;
        model_free(&expected);
        model_free(&truth);
        result_destroy(run);
        small_free(&t);
    }
    program_destroy(program);
    return wrong;
}

static void test_layer_peel(void **state)
{
    (void)state;
    assert_int_equal(compare_program("layer_peel", layers, true), 0);
}

static void test_coherent_a(void **state)
{
    (void)state;
    assert_int_equal(compare_program("coherent_layer_peel_a", coherent, true), 0);
}

static void test_ideal(void **state)
{
    (void)state;
    assert_int_equal(compare_program("ideal_coherent_layer_peel", ideal, true), 0);
}

static void test_ideal_printed(void **state)
{
    (void)state;
    const int wrong = compare_program("ideal_coherent_layer_peel_printed", printed, true);
    print_message("algorithm 2 as printed is wrong in %d of %d images\n", wrong, IMAGES);
    assert_true(wrong > IMAGES / 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layer_peel),
        cmocka_unit_test(test_coherent_a),
        cmocka_unit_test(test_ideal),
        cmocka_unit_test(test_ideal_printed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
