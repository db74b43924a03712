// The figures known of each algorithm, reproduced by the programs and by the model: passes by order of the layers,
// the limits of the 8-bit stencil, the smallest case that algorithm 2 as printed gets wrong, figure 2 step by step.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "trace_small.h"

#include <math.h>

enum { LAYERS_MAX = 600 };
typedef enum order { SORTED, REVERSED } order;

static small_trace stack(size_t count, order order)
{
    double depths[LAYERS_MAX];
    for (size_t i = 0; i < count; i++)
        depths[i] = (double)(order == SORTED ? i + 1 : count - i) / (double)(count + 1);
    return small_layers(depths, count);
}

static void assert_close(const model_result *model, const run_result *run)
{
    for (uint32_t i = 0; i < 3 * run->width * run->height * run->samples; i++)
        assert_true(fabs(model->rgb[i / 3][i % 3] - (double)run->sample_rgb[i]) <= 1e-5);
}

// iterations and passes that a program and the model must both take; the image is exact.
static void expect_counts(const char *stem, size_t count, order order, uint64_t iterations, uint64_t passes)
{
    small_trace t = stack(count, order);
    const model_scene scene = small_scene(&t);
    model_result model = strcmp(stem, "layer_peel") == 0 ? model_layer_peel(&scene)
                         : strcmp(stem, "coherent_layer_peel_a") == 0
                             ? model_coherent_a(&scene, NULL)
                             : model_ideal(&scene, strstr(stem, "printed") != NULL);
    program *program = small_program(stem);
    run_result *run = small_run(program, "programmable", &t);
    assert_non_null(run);
    if (run->iterations != iterations || run->geometry_passes != passes)
        fail_msg("%s, %zu layers: %d iterations and %d passes, not %d and %d", stem, count, (int)run->iterations,
                 (int)run->geometry_passes, (int)iterations, (int)passes);
    assert_int_equal(model.iterations, iterations);
    assert_int_equal(model.passes, passes);
    assert_int_equal(run->fragments_composited, count);
    assert_true(run->error.exact);
    assert_close(&model, run);
    model_free(&model);
    result_destroy(run);
    program_destroy(program);
    small_free(&t);
}

static void test_sixty_four_layers(void **state)
{
    (void)state;
    expect_counts("layer_peel", 64, SORTED, 65, 129);
    expect_counts("layer_peel", 64, REVERSED, 65, 129);
    expect_counts("coherent_layer_peel_a", 64, SORTED, 2, 12);
    expect_counts("coherent_layer_peel_a", 64, REVERSED, 33, 198);
    expect_counts("ideal_coherent_layer_peel", 64, SORTED, 2, 3);
    expect_counts("ideal_coherent_layer_peel", 64, REVERSED, 65, 129);
    expect_counts("ideal_coherent_layer_peel_printed", 64, SORTED, 2, 3);  // with one sample it is exact
    expect_counts("ideal_coherent_layer_peel_printed", 64, REVERSED, 65, 129);
}

static void test_span_of_128(void **state)
{
    (void)state;
    expect_counts("coherent_layer_peel_a", 128, SORTED, 2, 12);
    expect_counts("coherent_layer_peel_a", 129, SORTED, 3, 18);
    expect_counts("coherent_layer_peel_a", 257, SORTED, 4, 24);
}

static void test_stencil_overflow(void **state)
{
    (void)state;
    expect_counts("coherent_layer_peel_a", 254, REVERSED, 128, 128 * 6);
    expect_counts("coherent_layer_peel_a", 300, REVERSED, 174, 174 * 6);
    expect_counts("coherent_layer_peel_a", 600, REVERSED, 474, 474 * 6);
}

// ---- Variants of a shipped program ---------------------------------------------------------------------

static char *program_text(const char *stem)
{
    char path[4096];
    snprintf(path, sizeof path, "%s/programs/%s.rop", ROPSIM_SOURCE, stem);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    char *text = calloc(1, 65536);
    assert_non_null(text);
    assert_true(fread(text, 1, 65535, file) > 0);
    fclose(file);
    return text;
}

// Puts `with` for every `what`; there is at least one.
static char *replace(char *text, const char *what, const char *with)
{
    char *out = calloc(1, 2 * 65536), *to = out;
    assert_non_null(out);
    assert_non_null(strstr(text, what));
    const char *from = text;
    for (const char *at; (at = strstr(from, what)); from = at + strlen(what)) {
        memcpy(to, from, (size_t)(at - from));
        to += at - from;
        memcpy(to, with, strlen(with));
        to += strlen(with);
    }
    strcpy(to, from);
    free(text);
    return out;
}

static program *assemble_variant(char *text)
{
    program *program = NULL;
    assert_int_equal(assemble_text("variant", text, strlen(text), NULL, &program), STATUS_OK);
    free(text);
    return program;
}

static void expect_variant(const program *program, const small_trace *t, const model_a_options *options)
{
    const model_scene scene = small_scene(t);
    model_result model = model_coherent_a(&scene, options);
    run_result *run = small_run(program, "programmable", t);
    assert_non_null(run);
    assert_int_equal(run->iterations, model.iterations);
    assert_true(run->error.exact);
    assert_close(&model, run);
    model_free(&model);
    result_destroy(run);
}

// Wrapping counts instead of stopping at 255: the image stays exact, since the loop ends only when nothing was
// composited.
static void test_stencil_wraps(void **state)
{
    (void)state;
    char *text = replace(program_text("coherent_layer_peel_a"), " incr\n", " incr_wrap\n");
    program *program =
        assemble_variant(replace(replace(text, " decr\n", " decr_wrap\n"), " incr keep", " incr_wrap keep"));
    const size_t counts[] = {254, 256, 257, 300};
    for (int i = 0; i < 4; i++) {
        small_trace t = stack(counts[i], REVERSED);
        expect_variant(program, &t, &(model_a_options){.wrap = true});
        small_free(&t);
    }
    program_destroy(program);
}

// The closed range of section 5: exact, but the surface at z_min_prev interrupts the run, so that more iterations are
// needed.
static void test_closed_clip(void **state)
{
    (void)state;
    program *program =
        assemble_variant(replace(program_text("coherent_layer_peel_a"), "clip z < min(z_before, z_opaque)",
                                 "clip z <= min(z_before, z_opaque)"));
    uint64_t open_iterations = 0, closed_iterations = 0, seed = 7;
    for (int image = 0; image < 50; image++) {
        double depths[24];
        for (int i = 0; i < 24; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            depths[i] = (double)(1 + (seed >> 33) % 97) / 98;
        }
        small_trace t = small_layers(depths, 24);
        const model_scene scene = small_scene(&t);
        expect_variant(program, &t, &(model_a_options){.closed_clip = true});
        model_result open = model_coherent_a(&scene, NULL),
                     closed = model_coherent_a(&scene, &(model_a_options){.closed_clip = true});
        open_iterations += open.iterations;
        closed_iterations += closed.iterations;
        model_free(&open);
        model_free(&closed);
        small_free(&t);
    }
    print_message("50 images of 24 shuffled layers: %d iterations half-open, %d closed\n", (int)open_iterations,
                  (int)closed_iterations);
    assert_true(closed_iterations > open_iterations);
    program_destroy(program);
}

// ---- Algorithm 2 as printed ----------------------------------------------------------------------------

static void test_finished_sample(void **state)
{
    (void)state;
    static const float red[] = {1, 0, 0, 0.5f}, green[] = {0, 1, 0, 0.5f}, blue[] = {0, 0, 1, 0.5f};
    small_trace t = {.width = 2, .height = 1, .samples = 1};
    small_add(&t, 0, 0, 0, CLASS_TRANSPARENT, 0.5, red);
    small_add(&t, 1, 0, 0, CLASS_TRANSPARENT, 0.5, red);
    small_add(&t, 1, 0, 0, CLASS_TRANSPARENT, 0.4, green);
    small_add(&t, 1, 0, 0, CLASS_TRANSPARENT, 0.3, blue);
    const float mended[] = {0.5f, 0, 0, 0.125f, 0.25f, 0.5f}, printed[] = {0.875f, 0, 0, 0.125f, 0.25f, 0.5f};
    for (int form = 0; form < 2; form++) {
        program *program = small_program(form ? "ideal_coherent_layer_peel_printed" : "ideal_coherent_layer_peel");
        run_result *run = small_run(program, "programmable", &t);
        assert_non_null(run);
        assert_memory_equal(run->sample_rgb, form ? printed : mended, sizeof mended);
        assert_int_equal(run->fragments_composited, form ? 6 : 4);  // P's layer three times
        assert_int_equal(run->error.exact, !form);
        assert_int_equal(run->iterations, 4);
        assert_int_equal(run->geometry_passes, 7);
        result_destroy(run);
        program_destroy(program);
    }
    small_free(&t);
}

// ---- Figure 2 ------------------------------------------------------------------------------------------

// s1 to s10 in order of arrival, without s4: the figure looks at them when s4 is peeled already.
static const double figure2[] = {0.8, 0.7, 0.3, 0.4, 0.5, 0.65, 0.9, 0.6, 0.55};
enum { FIGURE2_COUNT = 9 };

// Stencil and depth at the pixel after pass `pass` of the first iteration of coherent_layer_peel_a, shown by a
// full-screen kernel: the schedule is cut there and the image is (stencil, depth, 0).
static void run_until(int pass, const char *depth_plane, float *stencil, float *depth)
{
    static const char *const draws[] = {
        "draw transparent with count_until_first\n", "draw transparent with nearest_before\n",
        "draw transparent with count_in_order\n", "draw transparent with nearest_after\n"};
    char *text = program_text("coherent_layer_peel_a");
    char *cut = strstr(text, draws[pass - 1]) + strlen(draws[pass - 1]);
    const char *end = "fullscreen show\n while composited\nend\n";
    strcpy(cut, end);
    char kernel[512];
    snprintf(kernel, sizeof kernel,
             "kernel show fullscreen\n ld r0, count\n utof r0, r0\n put c0, r0, r\n ld r1, %s\n"
             " put c0, r1, g\n st base, c0\nend\nschedule\n",
             depth_plane);
    text = replace(text, "\nschedule\n", kernel);
    text = replace(text, "output front over base", "output base");
    program *program = assemble_variant(text);
    small_trace t = small_layers(figure2, FIGURE2_COUNT);
    run_result *run = small_run(program, "programmable", &t);
    assert_non_null(run);
    *stencil = run->sample_rgb[0];
    *depth = run->sample_rgb[1];
    result_destroy(run);
    program_destroy(program);
    small_free(&t);
}

static uint32_t code(double depth)
{
    return format_depth_to_code(FORMAT_z32f, depth, false);
}

static void test_figure_2(void **state)
{
    (void)state;
    // What the paper says: the stencil is 3 and the depth D(s3); it counts down to 1 and stops at s2; s3, s5, s6 and s7
    // are counted, s9 inverts 4 to 251; the nearest that interrupts is s10.
    static const struct {
        const char *plane;
        float stencil;
        double depth;
    } expected[] = {{"z_first", 3, 0.3}, {"z_before", 1, 0.7}, {"z_run", 251, 0.65}, {"z_after", 255, 0.55}};
    for (int pass = 1; pass <= 4; pass++) {
        float stencil, depth;
        run_until(pass, expected[pass - 1].plane, &stencil, &depth);
        assert_true(stencil == expected[pass - 1].stencil);
        assert_true(depth == (float)expected[pass - 1].depth);
    }
    small_trace t = small_layers(figure2, FIGURE2_COUNT);
    const model_scene scene = small_scene(&t);
    model_a_step steps[8] = {{0}};
    model_result model = model_coherent_a(&scene, &(model_a_options){.steps = steps, .step_max = 8});
    assert_int_equal(steps[0].stencil_first, 3);
    assert_int_equal(steps[0].after_first, code(0.3));
    assert_int_equal(steps[0].stencil_before, 1);
    assert_int_equal(steps[0].before, code(0.7));
    assert_int_equal(steps[0].stencil_run, 251);
    assert_int_equal(steps[0].run, code(0.65));
    assert_int_equal(steps[0].after, code(0.55));
    model_free(&model);
    small_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sixty_four_layers), cmocka_unit_test(test_span_of_128),
        cmocka_unit_test(test_stencil_overflow),  cmocka_unit_test(test_stencil_wraps),
        cmocka_unit_test(test_closed_clip),       cmocka_unit_test(test_finished_sample),
        cmocka_unit_test(test_figure_2),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
