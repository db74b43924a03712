// Batches whose outcome is foregone against the same batches executed: every count, plane value, condition and pixel must be the same.
#include "trace_path.h"

#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <cmocka.h>

static run_result *run(const program *program, const machine *machine, trace *trace, bool every_batch)
{
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true, .every_batch = every_batch};
    run_result *result;
    assert_int_equal(replay_run(program, machine, trace, &options, &printing, &result), STATUS_OK);
    return result;
}

static void assert_same(const run_result *a, const run_result *b)
{
    const uint64_t samples = (uint64_t)a->width * a->height * a->samples;
    assert_int_equal(a->geometry_passes, b->geometry_passes);
    assert_int_equal(a->fullscreen_passes, b->fullscreen_passes);
    assert_int_equal(a->iterations, b->iterations);
    assert_int_equal(a->fragments_replayed, b->fragments_replayed);
    assert_int_equal(a->fragments_composited, b->fragments_composited);
    assert_memory_equal(a->sample_rgb, b->sample_rgb, samples * 3 * sizeof *a->sample_rgb);
    for (int i = 0; i < a->plane_count; i++) {
        const plane_result *x = &a->planes[i], *y = &b->planes[i];
        const bool color = format_table[x->format].class == FORMAT_CLASS_COLOR;
        assert_int_equal(x->bytes_read, y->bytes_read);
        assert_int_equal(x->bytes_written, y->bytes_written);
        assert_int_equal(x->texture_bytes_read, y->texture_bytes_read);
        assert_memory_equal(a->plane_values[i], b->plane_values[i], samples * (color ? 4 : 1) * sizeof **a->plane_values);
    }
    assert_int_equal(a->condition_count, b->condition_count);
    for (uint64_t i = 0; i < a->condition_count; i++) {
        assert_int_equal(a->conditions[i].count, b->conditions[i].count);
        assert_int_equal(a->conditions[i].holds, b->conditions[i].holds);
    }
}

// Returns how many batches were passed over.
static uint64_t compare(const program *program, const machine *machine, trace *trace)
{
    run_result *executed = run(program, machine, trace, true), *counted = run(program, machine, trace, false);
    const uint64_t foregone = counted->batches_foregone;
    assert_int_equal(executed->batches_foregone, 0);
    assert_same(executed, counted);
    result_destroy(executed);
    result_destroy(counted);
    return foregone;
}

static uint64_t compare_shipped(const char *name, const char *machine_name)
{
    char file[4096];
    machine machine;
    program *program;
    trace *trace;
    assert_int_equal(machine_load(machine_name, &printing, &machine), STATUS_OK);
    assert_int_equal(program_load(name, &printing, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, &printing, &trace), STATUS_OK);
    const uint64_t foregone = compare(program, &machine, trace);
    trace_close(trace);
    program_destroy(program);
    return foregone;
}

static void test_shipped_programs(void **state)
{
    static const char *const scenes[] = {"scene:soup,count=300", "scene:knot"};
    static const char *const runs[][2] = {
        {"layer_peel", "g80"}, {"layer_peel", "modern"}, {"coherent_layer_peel_a", "g80"}, {"coherent_layer_peel_b", "g80"}, {"hybrid_layer_peel", "g80"},
        {"hybrid_layer_peel_closed", "g80"}, {"layer_peel_everitt", "g80"}, {"vtk_depth_peel", "g80"}, {"z_batch_peel", "g80"},
        {"ideal_coherent_layer_peel", "programmable"}, {"fused_coherent_layer_peel", "programmable"}, {"two_ended_lean_peel", "programmable"}};
    (void)state;
    for (uint32_t samples = 1; samples <= 4; samples *= 4) {
        record_options options;
        record_defaults(&options);
        options.width = 72;
        options.height = 60;
        options.samples = samples;
        assert_int_equal(record_scenes(scenes, 2, &options, trace_path, &printing), STATUS_OK);
        for (size_t i = 0; i < sizeof runs / sizeof *runs; i++)
            assert_true(compare_shipped(runs[i][0], runs[i][1]) > 0);
    }
}

static void test_random_programs(void **state)
{
    static program_text text;
    uint32_t with_foregone = 0;
    (void)state;
    for (uint32_t i = 0; i < test_count(200); i++) {
        dice dice = {(test_seed() << 32) + i};
        twin_image image;
        machine machine;
        program *program;
        random_image(&dice, false, &image);
        random_machine(&dice, i % 2 ? "g80" : "programmable", &machine);
        random_program(&dice, i % 2, &text);
        assert_int_equal(assemble_text("random", text.text, text.size, &printing, &program), STATUS_OK);
        if (runs_on(program, &machine)) {
            trace *trace = random_image_open(&image);
            with_foregone += compare(program, &machine, trace) > 0;
            trace_close(trace);
        }
        program_destroy(program);
        random_image_free(&image);
    }
    print_message("%u random programs had batches to pass over\n", with_foregone);
    assert_true(with_foregone >= test_count(200) / 20);
}

// One tile of two full layers, the nearer first, and a program whose one kernel makes the compare at hand. What a range can tell of it is known.
typedef struct single { const char *compare, *clear; bool foregone; } single;

static const single singles[] = {
    {"lt p1, z, r0", "near", true},        // holds nowhere
    {"lt p1, r0, z", "near", false},       // holds everywhere: writes
    {"lt p1, r0, z", "far", true},
    {"ge p1, r0, z", "near", true},
    {"ge p1, r0, z", "far", false},
    {"ge p1, z, r0", "far", true},
    {"eq p1, r0, z", "near", true},
    {"eq p1, z, r0", "far", true},
    {"ne p1, z, r0", "near", false},
    {"ne p1, r0, r0", "near", true},       // of two planes, or one twice
    {"eq p1, r0, r0", "near", false},
    {"lt p1, r0, r1", "far", false},       // r1 holds no plane
    {"lt p1, z, z", "far", false},         // nothing is known of two depths
};

static void add_layer(twin_image *image, double depth)
{
    for (uint32_t i = 0; i < TILE_LANES; i++)
        image->fragments[image->fragment_count++] = (twin_fragment){.x = i % 8, .y = i / 8, .depth = depth, .rgba = {0.5f, 0.5f, 0.5f, 0.5f}};
}

static trace *two_layers(void)
{
    twin_fragment fragments[2 * TILE_LANES];
    twin_image image = {.width = 8, .height = 8, .samples = 1, .classes = {CLASS_TRANSPARENT}, .draw_count = 1, .fragments = fragments};
    add_layer(&image, 0.25);
    add_layer(&image, 0.75);
    return random_image_open(&image);
}

static uint64_t compare_text(const char *text, trace *trace)
{
    machine machine;
    program *program;
    assert_int_equal(machine_load("programmable", &printing, &machine), STATUS_OK);
    assert_int_equal(assemble_text("single", text, strlen(text), &printing, &program), STATUS_OK);
    const uint64_t foregone = compare(program, &machine, trace);
    program_destroy(program);
    return foregone;
}

static void test_single_compares(void **state)
{
    (void)state;
    trace *trace = two_layers();
    for (size_t i = 0; i < sizeof singles / sizeof *singles; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "program single\nplane limit depth\nplane ticks u32\nplane color rgba\nquery found\noutput color over color\n"
                 "kernel only\n ld r0, limit\n ld r2, ticks\n add r1, r2, 1\n %s\n @p1 count found\n @p1 st ticks, r1\nend\n"
                 "schedule\n clear limit %s\n draw transparent with only\n if found\n draw transparent with only\n end\nend\n",
                 singles[i].compare, singles[i].clear);
        assert_int_equal(compare_text(text, trace), singles[i].foregone ? 2 : 0);
    }
    trace_close(trace);
}

// The first layer moves the limit of 0.5 behind the second, which would have failed before. In the second draw both fail.
static void test_a_batch_changes_what_decides_on_the_next(void **state)
{
    static const char text[] = "program moving\nplane limit u32\nplane color rgba\noutput color over color\n"
                               "kernel only\n ld r0, limit\n lt p1, z, r0\n @p1 st limit, 0x3f600000\nend\n"
                               "kernel close\n ld r0, limit\n lt p1, r0, z\n @p1 st limit, 0\nend\n"
                               "schedule\n clear limit 0x3f000000\n draw transparent with only\n draw transparent with close\nend\n";
    (void)state;
    trace *trace = two_layers();
    assert_int_equal(compare_text(text, trace), 2);
    trace_close(trace);
}

// A plane that no compare looks at is cleared and written to, and becomes by its name one that a compare looks at. Passed over by what the
// clear left there, the last draw would write nothing.
static void test_planes_that_change_names(void **state)
{
    static const char *const changes[] = {"swap limit other", "swap other limit", "copy limit other"};
    (void)state;
    trace *trace = two_layers();
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "program single\nplane limit depth\nplane other depth\nplane ticks u32\nplane color rgba\noutput color over color\n"
                 "kernel write\n st other, near\nend\n"
                 "kernel only\n ld r0, limit\n lt p1, r0, z\n @p1 ld r2, ticks\n @p1 add r1, r2, 1\n @p1 st ticks, r1\nend\n"
                 "schedule\n clear limit near\n clear other far\n draw transparent with write\n %s\n draw transparent with only\n"
                 " draw transparent with write\n clear limit far\n draw transparent with only\nend\n",
                 changes[i]);
        assert_int_equal(compare_text(text, trace), 2);  // the last draw's
    }
    trace_close(trace);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shipped_programs), cmocka_unit_test(test_random_programs), cmocka_unit_test(test_single_compares),
                                       cmocka_unit_test(test_a_batch_changes_what_decides_on_the_next), cmocka_unit_test(test_planes_that_change_names)};
    return cmocka_run_group_tests(tests, trace_path_make, trace_path_remove);
}
