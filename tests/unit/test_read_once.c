// The function level on a trace that the level sampled has read, against the same on the trace itself: no field of the result may differ.
// And runs of deeper levels, one after the other on the same reading, against runs that read for themselves.
#include "trace_path.h"

#include "../../sim/replay/stamps.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>

static const report quiet = {0};

static void assert_same_planes(const run_result *a, const run_result *b)
{
    const size_t samples = (size_t)a->width * a->height * a->samples;
    assert_memory_equal(a->image, b->image, (size_t)a->width * a->height * 3 * sizeof *a->image);
    assert_memory_equal(a->sample_rgb, b->sample_rgb, samples * 3 * sizeof *a->sample_rgb);
    for (int i = 0; i < a->plane_count; i++) {
        const size_t components = format_table[a->planes[i].format].class == FORMAT_CLASS_COLOR ? 4 : 1;
        assert_memory_equal(&a->planes[i], &b->planes[i], sizeof a->planes[i]);
        assert_memory_equal(a->plane_values[i], b->plane_values[i], samples * components * sizeof(uint32_t));
    }
}

static void assert_same(const run_result *a, const run_result *b)
{
    const uint64_t of_a[] = {a->geometry_passes, a->fullscreen_passes, a->iterations, a->fragments_in_trace, a->fragments_replayed,
                             a->fragments_composited, a->list_kept, a->list_lost, a->deepest_sample, a->condition_count, a->error.samples_wrong};
    const uint64_t of_b[] = {b->geometry_passes, b->fullscreen_passes, b->iterations, b->fragments_in_trace, b->fragments_replayed,
                             b->fragments_composited, b->list_kept, b->list_lost, b->deepest_sample, b->condition_count, b->error.samples_wrong};
    assert_memory_equal(of_a, of_b, sizeof of_a);
    assert_memory_equal(a->passes_by_class, b->passes_by_class, sizeof a->passes_by_class);
    assert_memory_equal(&a->error.max_abs, &b->error.max_abs, 3 * sizeof(double));
    for (uint64_t i = 0; i < a->condition_count; i++) {
        assert_int_equal(a->conditions[i].count, b->conditions[i].count);
        assert_int_equal(a->conditions[i].holds, b->conditions[i].holds);
    }
    assert_same_planes(a, b);
}

// Returns whether all of the trace was there to be shared.
static bool compare(const char *name, const char *machine_name, uint64_t memory_bytes, bool reference)
{
    char file[4096];
    machine machine;
    program *program;
    trace *trace;
    stamps *read;
    run_result *alone, *shared;
    run_options options = {.threads = 2, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true, .reference = reference};
    const detail_options detail = {.level = DETAIL_SAMPLED, .memory_bytes = memory_bytes};
    assert_int_equal(machine_load(machine_name, &quiet, &machine), STATUS_OK);
    assert_int_equal(program_load(name, &quiet, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, &quiet, &trace), STATUS_OK);
    assert_int_equal(replay_run(program, &machine, trace, &options, &quiet, &alone), STATUS_OK);
    assert_int_equal(detail_read(program, &machine, trace, &detail, &quiet, &read), STATUS_OK);
    assert_int_equal(replay_run_on(program, &machine, trace, read, &options, &quiet, &shared), STATUS_OK);
    const bool whole = read && bins_can_share(read);
    assert_same(alone, shared);
    result_destroy(alone);
    result_destroy(shared);
    stamps_destroy(read);
    trace_close(trace);
    program_destroy(program);
    return whole;
}

static void record(const char *const *scenes, int count, uint32_t samples)
{
    record_options options;
    record_defaults(&options);
    options.width = 100;  // the last blocks lie outside in part
    options.height = 75;
    options.samples = samples;
    assert_int_equal(record_scenes(scenes, count, &options, trace_path, &quiet), STATUS_OK);
}

static const char *const programs[][2] = {
    {"layer_peel", "g80"},           {"coherent_layer_peel_a", "g80"},
    {"coherent_layer_peel_b", "g80"}, {"ideal_coherent_layer_peel", "programmable"},
    {"hybrid_layer_peel", "g80"},    {"fused_coherent_layer_peel", "programmable"},
    {"a_buffer", "abuffer"},         {"z_batch_peel", "g80"},
};

static void every_program_gives_the_same(void **state)
{
    static const char *const scenes[] = {"opaque:scene:knot", "scene:soup,count=300", "sorted:scene:slices_cone,slices=6"};
    (void)state;
    for (uint32_t samples = 1; samples <= 4; samples += 3) {
        record(scenes, 3, samples);
        for (size_t i = 0; i < sizeof programs / sizeof *programs; i++)
            for (int reference = 0; reference < 2; reference++)
                assert_true(compare(programs[i][0], programs[i][1], 0, reference));
    }
}

static void what_cannot_be_shared_is_read(void **state)
{
    static const char *const scenes[] = {"scene:soup,count=4000"};
    (void)state;
    record(scenes, 1, 1);
    assert_false(compare("layer_peel", "g80", 1, false));    // not all fits the budget
    assert_false(compare("layer_peel", "tiled", 0, false));  // stamps by region
}

// Two runs on one reading, of which the first leaves it as the second finds it, whether all of it is in memory or not.
static void compare_deeper(const char *machine_name, detail_level level, uint64_t memory_bytes)
{
    char file[4096];
    machine machine;
    program *program;
    trace *trace;
    run_result *function;
    detail_result *alone, *shared;
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    detail_options detail = {.level = level, .memory_bytes = memory_bytes};
    assert_int_equal(machine_load(machine_name, &quiet, &machine), STATUS_OK);
    assert_int_equal(program_load("layer_peel", &quiet, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, &quiet, &trace), STATUS_OK);
    assert_int_equal(replay_run(program, &machine, trace, &options, &quiet, &function), STATUS_OK);
    assert_int_equal(detail_run(program, &machine, trace, function, &detail, &quiet, &alone), STATUS_OK);
    assert_int_equal(detail_read(program, &machine, trace, &detail, &quiet, &detail.stamps), STATUS_OK);
    assert_int_equal(detail.stamps->whole, memory_bytes == 0);
    for (int i = 0; i < 2; i++) {
        assert_true(detail_fits(detail.stamps, program, &machine, trace, &detail));
        assert_int_equal(detail_run(program, &machine, trace, function, &detail, &quiet, &shared), STATUS_OK);
        assert_memory_equal(&alone->total, &shared->total, sizeof alone->total);
        assert_int_equal(alone->drained_cycles, shared->drained_cycles);
        detail_destroy(shared);
    }
    detail_destroy(alone);
    result_destroy(function);
    stamps_destroy(detail.stamps);
    trace_close(trace);
    program_destroy(program);
}

static void deeper_runs_share_one_reading(void **state)
{
    static const char *const scenes[] = {"opaque:scene:knot", "scene:soup,count=300"};
    (void)state;
    record(scenes, 2, 2);
    for (detail_level level = DETAIL_TRAFFIC; level < DETAIL_COUNT; level++) {
        compare_deeper("g80", level, 0);
        compare_deeper("g80", level, 1);
        compare_deeper("tiled", level, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_program_gives_the_same),
        cmocka_unit_test(what_cannot_be_shared_is_read),
        cmocka_unit_test(deeper_runs_share_one_reading),
    };
    return cmocka_run_group_tests(tests, trace_path_make, trace_path_remove);
}
