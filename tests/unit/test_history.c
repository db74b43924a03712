// Pixel histories against the replay: every sample of random images ends with the replay's planes, the histories of all
// samples together write, count and composite as often as the replay says, and every test that is told holds as told.
#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include <jansson.h>

#include "messages.h"
#include "trace_small.h"

enum { PROGRAM_MAX = 64 };

// Sums over the histories of all samples.
typedef struct totals {
    uint64_t written[PLANE_MAX], composited, tests;
} totals;

// Prints the history of one sample as JSON and parses it.
static json_t *history_json(const program *program, const machine *machine, trace *trace, uint32_t x, uint32_t y,
                            uint32_t sample, const history_options *options)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    assert_non_null(stream);
    assert_int_equal(history_print_json(program, machine, trace, x, y, sample, options, &printing, stream), STATUS_OK);
    fclose(stream);
    json_error_t error;
    json_t *object = json_loadb(text, size, JSON_REJECT_DUPLICATES, &error);
    if (!object)
        fail_msg("not JSON: %s in line %d\n%s", error.text, error.line, text);
    free(text);
    return object;
}

// A value of an event as a number that compares as the ROP compares it; false: it is not a number (NaN, infinity).
static bool comparable(const json_t *side, double *value)
{
    const json_t *number = json_object_get(side, "value");
    if (json_is_object(number))
        number = json_object_get(number, "code");
    *value = json_number_value(number);
    return json_is_number(number);
}

static bool relation_holds(const char *relation, double a, double b)
{
    if (strcmp(relation, "<") == 0)
        return a < b;
    if (strcmp(relation, "<=") == 0)
        return a <= b;
    if (strcmp(relation, "=") == 0)
        return a == b;
    if (strcmp(relation, "!=") == 0)
        return a != b;
    if (strcmp(relation, ">=") == 0)
        return a >= b;
    assert_string_equal(relation, ">");
    return a > b;
}

static void count_write(const program *program, const json_t *plane, totals *totals)
{
    for (int p = 0; p < program->plane_count; p++)
        totals->written[p] += strcmp(program->planes[p].name, json_string_value(plane)) == 0;
}

static void check_event(const program *program, const json_t *event, totals *totals)
{
    const char *kind = json_string_value(json_object_get(event, "event"));
    const char *relation = json_string_value(json_object_get(event, "relation"));
    double left, right;
    if (strcmp(kind, "composite") == 0)
        totals->composited++;
    if (strcmp(kind, "write") == 0)
        count_write(program, json_object_get(event, "plane"), totals);
    const bool holds = json_is_true(json_object_get(event, "holds"));
    if (relation && strcmp(relation, "always") == 0)
        assert_true(holds);
    else if (relation && strcmp(relation, "never") == 0)
        assert_false(holds);
    else if (relation && comparable(json_object_get(event, "left"), &left) &&
             comparable(json_object_get(event, "right"), &right)) {
        totals->tests++;
        if (holds != relation_holds(relation, left, right))
            fail_msg("told to %s: %s", holds ? "hold" : "fail", json_dumps(event, 0));
    }
}

// A copy writes its plane once a sample, and so does a list, however many fragments it blends in registers.
static void check_step(const program *program, const json_t *step, totals *totals)
{
    const char *kind = json_string_value(json_object_get(step, "step"));
    const json_t *fragment, *event;
    size_t j, k;
    const struct totals before = *totals;
    const bool is_list = strcmp(kind, "list_blend") == 0;
    json_array_foreach(json_object_get(step, "fragments"), j, fragment)
    {
        json_array_foreach(json_object_get(fragment, "events"), k, event) check_event(program, event, totals);
    }
    if (is_list) {
        memcpy(totals->written, before.written, sizeof before.written);
        count_write(program, json_object_get(step, "into"), totals);
    }
    if (strcmp(kind, "copy") == 0)
        count_write(program, json_object_get(json_array_get(json_object_get(step, "planes"), 0), "plane"), totals);
}

static void check_history(const program *program, const json_t *history, totals *totals)
{
    const json_t *step;
    size_t i;
    json_array_foreach(json_object_get(history, "steps"), i, step) check_step(program, step, totals);
}

// The histories of all samples of an image, each checked against the replay by itself and all in sum.
static void compare_image(const program *program, const machine *machine, const twin_image *image)
{
    trace *trace = random_image_open(image);
    const history_options options = {.run = {.threads = 1, .occlusion_ratio = -1}};
    run_options run_options = options.run;
    run_options.keep_planes = true;
    run_result *run;
    totals totals = {0};
    assert_int_equal(replay_run(program, machine, trace, &run_options, NULL, &run), STATUS_OK);
    for (uint32_t y = 0; y < image->height; y++) {
        for (uint32_t x = 0; x < image->width; x++) {
            for (uint32_t s = 0; s < image->samples; s++) {
                json_t *history = history_json(program, machine, trace, x, y, s, &options);
                check_history(program, history, &totals);
                json_decref(history);
            }
        }
    }
    assert_int_equal(totals.composited, run->fragments_composited);
    for (int p = 0; p < program->plane_count; p++)
        assert_int_equal(totals.written[p] * (uint64_t)format_table[run->planes[p].format].bits / 8,
                         run->planes[p].bytes_written);
    result_destroy(run);
    trace_close(trace);
}

// An image of few samples, so that all of them are looked at.
static void tiny_image(dice *dice, bool nonfinite, twin_image *image)
{
    for (;;) {
        random_image(dice, nonfinite, image);
        if (image->width * image->height * image->samples <= 24)
            return;
        random_image_free(image);
    }
}

static void random_programs_equal_replay(void **state)
{
    (void)state;
    static program_text text;
    for (uint32_t i = 0; i < test_count(60); i++) {
        dice dice = {(test_seed() << 32) + i};
        twin_image image;
        machine machine;
        program *program;
        const bool fixed_function = dice_chance(&dice, 40);
        tiny_image(&dice, dice_chance(&dice, 20), &image);
        random_machine(&dice, fixed_function ? "g80" : "programmable", &machine);
        random_program(&dice, fixed_function, &text);
        assert_int_equal(assemble_text("random", text.text, text.size, &printing, &program), STATUS_OK);
        if (runs_on(program, &machine))
            compare_image(program, &machine, &image);
        program_destroy(program);
        random_image_free(&image);
    }
}

static void shipped_programs_equal_replay(void **state)
{
    (void)state;
    static char names[PROGRAM_MAX][NAME_SIZE];
    const int count = data_names("programs", ".rop", names, PROGRAM_MAX);
    assert_true(count >= 4);
    int compared = 0;
    for (int p = 0; p < count; p++) {
        program *program = small_program(names[p]);
        if (!program)
            fail_msg("%s cannot be assembled", names[p]);
        for (uint32_t i = 0; i < test_count(4); i++) {
            dice dice = {(test_seed() << 32) + 1000 + i};
            twin_image image;
            machine machine;
            tiny_image(&dice, false, &image);
            random_machine(&dice, "programmable", &machine);
            if (!runs_on(program, &machine))  // one that keeps lists
                random_machine(&dice, "abuffer", &machine);
            if (runs_on(program, &machine)) {
                compare_image(program, &machine, &image);
                compared++;
            }
            random_image_free(&image);
        }
        program_destroy(program);
    }
    assert_true(compared > count);
}

// ---- Plane values --------------------------------------------------------------------------------------

// s1 to s10 of figure 2 in order of arrival, without s4, which is peeled already.
static const double figure2[] = {0.8, 0.7, 0.3, 0.4, 0.5, 0.65, 0.9, 0.6, 0.55};

static uint32_t value_after(const program *program, trace *trace, uint64_t iteration, uint64_t pass, const char *plane)
{
    machine machine;
    uint32_t value[4];
    const history_options options = {
        .run = {.threads = 1, .occlusion_ratio = -1}, .pass = pass, .iteration = iteration};
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    assert_int_equal(history_plane_value(program, &machine, trace, 0, 0, 0, plane, &options, &printing, value),
                     STATUS_OK);
    return value[0];
}

static uint32_t code(double depth)
{
    return format_depth_to_code(FORMAT_z32f, depth, false);
}

// What the paper says: the stencil is 3 and the depth D(s3); it counts down to 1 and stops at s2; s3, s5, s6 and s7
// are counted, s9 inverts 4 to 251; the nearest that interrupts is s10.
static void figure_2_pass_by_pass(void **state)
{
    (void)state;
    static const struct {
        uint64_t pass;
        uint32_t count;
        const char *plane;
        double depth;
    } expected[] = {
        {1, 3, "z_first", 0.3}, {2, 1, "z_before", 0.7}, {3, 251, "z_run", 0.65}, {4, 255, "z_after", 0.55}};
    program *program = small_program("coherent_layer_peel_a");
    small_trace t = small_layers(figure2, sizeof figure2 / sizeof *figure2);
    trace *trace = small_open(&t);
    assert_non_null(trace);
    for (int i = 0; i < 4; i++) {
        assert_int_equal(value_after(program, trace, 1, expected[i].pass, "count"), expected[i].count);
        assert_int_equal(value_after(program, trace, 0, expected[i].pass, expected[i].plane), code(expected[i].depth));
    }
    // Six passes an iteration: pass 7 of the run is pass 1 of the second.
    assert_int_equal(value_after(program, trace, 0, 7, "z_first"), value_after(program, trace, 2, 1, "z_first"));
    trace_close(trace);
    small_free(&t);
    program_destroy(program);
}

// ---- Text ----------------------------------------------------------------------------------------------

static char *history_text(const char *stem, const small_trace *t, const history_options *options)
{
    char *text = NULL;
    size_t size = 0;
    machine machine;
    program *program = small_program(stem);
    trace *trace = small_open(t);
    FILE *stream = open_memstream(&text, &size);
    assert_true(program && trace && stream);
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    assert_int_equal(history_print(program, &machine, trace, 0, 0, 0, options, &printing, stream), STATUS_OK);
    fclose(stream);
    trace_close(trace);
    program_destroy(program);
    return text;
}

static void text_of_a_pass(void **state)
{
    (void)state;
    static const char expected[] =
        "layer_peel on programmable: pixel 0, 0, sample 0\n"
        "3 fragments in raster order: number, depth, straight red green blue alpha, primitive, draw\n"
        "  #1     0.5          0 0 0 0.5                    0        draw (transparent)\n"
        "  #2     0.25         0.5 0.25 0.166667 0.5        1        draw (transparent)\n"
        "  #3     0.5          1 0.5 0.333333 0.5           2        draw (transparent)\n"
        "\n"
        "pass 4 (iteration 2, its pass 2): draw transparent with composite\n"
        "  #1    clip z 0.5 < z_opaque 1: yes; depth z 0.5 = z_next 0.5: yes; composited;\n"
        "        front (0.25 0.125 0.0833333 0.5) -> (0.25 0.125 0.0833333 0.25)\n"
        "  #2    clip z 0.25 < z_opaque 1: yes; depth z 0.25 = z_next 0.5: no\n"
        "  #3    clip z 0.5 < z_opaque 1: yes; depth z 0.5 = z_next 0.5: yes; composited;\n"
        "        front (0.25 0.125 0.0833333 0.25) -> (0.375 0.1875 0.125 0.125)\n"
        "  after z_opaque = 1; z_next = 0.5; front (0.25 0.125 0.0833333 0.5) -> (0.375 0.1875 0.125 0.125)\n";
    const double depths[] = {0.5, 0.25, 0.5};
    small_trace t = small_layers(depths, 3);
    char *text = history_text("layer_peel", &t, &(history_options){.run = {.occlusion_ratio = -1}, .pass = 4});
    assert_string_equal(text, expected);
    free(text);
    small_free(&t);
}

static void text_fits_a_terminal(void **state)
{
    (void)state;
    static char names[PROGRAM_MAX][NAME_SIZE];
    const int count = data_names("programs", ".rop", names, PROGRAM_MAX);
    small_trace t = small_layers(figure2, sizeof figure2 / sizeof *figure2);
    for (int p = 0; p < count; p++) {
        machine machine;
        program *program = small_program(names[p]);
        assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
        const bool runs = runs_on(program, &machine);
        program_destroy(program);
        if (!runs)
            continue;
        char *text = history_text(names[p], &t, &(history_options){.run = {.occlusion_ratio = -1}});
        assert_non_null(strstr(text, "at the end"));
        for (const char *line = text; *line; line += strcspn(line, "\n") + 1)
            if (strcspn(line, "\n") > 100)
                fail_msg("%s: a line of %d columns: %.200s", names[p], (int)strcspn(line, "\n"), line);
        free(text);
    }
    small_free(&t);
}

// ---- What is refused -----------------------------------------------------------------------------------

static void expect_refusal(trace *trace, const program *program, uint32_t x, uint32_t sample, const char *plane,
                           uint64_t pass, uint64_t iteration, status wanted, const char *said)
{
    machine machine;
    messages messages;
    uint32_t value[4];
    const history_options options = {
        .run = {.threads = 1, .occlusion_ratio = -1}, .pass = pass, .iteration = iteration};
    messages_start(&messages);
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    assert_int_equal(
        history_plane_value(program, &machine, trace, x, 0, sample, plane, &options, &messages.report, value), wanted);
    assert_string_equal(messages.text, said);
}

static void refusals(void **state)
{
    (void)state;
    const double depths[] = {0.5, 0.25};
    small_trace t = small_layers(depths, 2);
    trace *trace = small_open(&t);
    program *program = small_program("layer_peel");
    expect_refusal(trace, program, 1, 0, "front", 0, 0, STATUS_USAGE,
                   "pixel 1, 0, sample 0 is not in the trace: x is 0 to 0, y is 0 to 0, the sample is 0\n");
    expect_refusal(trace, program, 0, 1, "front", 0, 0, STATUS_USAGE,
                   "pixel 0, 0, sample 1 is not in the trace: x is 0 to 0, y is 0 to 0, the sample is 0\n");
    expect_refusal(trace, program, 0, 0, "frond", 0, 0, STATUS_REFUSED,
                   "program 'layer_peel' has no plane 'frond'; did you mean 'front'?\n");
    expect_refusal(trace, program, 0, 0, "front", 6, 0, STATUS_REFUSED,
                   "there is no pass 6: the schedule ran 5 passes in 3 iterations\n");
    expect_refusal(trace, program, 0, 0, "front", 2, 3, STATUS_REFUSED,
                   "there is no pass 2 of iteration 3: the schedule ran 5 passes in 3 iterations\n");
    program_destroy(program);
    trace_close(trace);
    small_free(&t);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_programs_equal_replay), cmocka_unit_test(shipped_programs_equal_replay),
        cmocka_unit_test(figure_2_pass_by_pass),        cmocka_unit_test(text_of_a_pass),
        cmocka_unit_test(text_fits_a_terminal),         cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
