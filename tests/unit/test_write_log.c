// The log of batches that write: its rows against a plain table, and the level sampled with it against the level sampled without, which runs
// whatever ranges of depths do not rule out.
#include "trace_path.h"

#include "../../sim/levels.h"
#include "../../sim/replay/stamps.h"
#include "../../sim/replay/write_log.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

static const report quiet = {0};

enum { TILES = 3, DRAWS = 40, BATCHES_EACH = 100 };  // of tile t: t * BATCHES_EACH

static write_log *make(uint64_t most_bytes)
{
    static bin of_tile[TILES];
    for (uint32_t t = 0; t < TILES; t++)
        of_tile[t] = (bin){.opaque_count = t * BATCHES_EACH / 4, .transparent_count = t * BATCHES_EACH - t * BATCHES_EACH / 4};
    write_log *log = write_log_create(&(bins){.bins = of_tile, .tile_count = TILES}, most_bytes);
    assert_non_null(log);
    return log;
}

static uint32_t dice(uint32_t *state, uint32_t below)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) % below;
}

static void rows_hold_what_was_noted(void **state)
{
    static bool wrote[TILES][DRAWS][TILES * BATCHES_EACH];
    (void)state;
    uint32_t seed = 7;
    memset(wrote, 0, sizeof wrote);
    write_log *log = make(1 << 20);
    for (uint32_t t = 1; t < TILES; t++)
        for (uint32_t d = 0; d < DRAWS / 2; d++)
            for (uint32_t i = 0; d % 3 && i < 9; i++) {
                const uint32_t batch = dice(&seed, t * BATCHES_EACH);
                wrote[t][d][batch] = true;
                write_log_note(log, t, d, batch);
            }
    for (uint32_t d = DRAWS / 2; d < DRAWS - 3; d += 3) {  // three draws come again, of one tile
        write_log_repeat(log, 1, d, 3);
        write_log_repeat(log, 0, d, 3);
        memcpy(wrote[1][d], wrote[1][d - 3], 3 * sizeof wrote[1][d]);
    }
    assert_true(write_log_is_of(log, 3 * BATCHES_EACH));
    assert_false(write_log_is_of(log, 3 * BATCHES_EACH + 1));
    assert_false(write_log_is_of(NULL, 0));
    uint32_t found = 0;
    for (uint32_t t = 0; t < TILES; t++)
        for (uint32_t d = 0; d < DRAWS; d++) {
            const uint64_t *row = write_log_row(log, t, d);
            const uint32_t end = t * BATCHES_EACH;
            for (uint32_t b = 0, next = row ? write_log_next(row, 0, end) : end; b < end; b++) {
                assert_int_equal(wrote[t][d][b], b == next);
                found += b == next;
                next = b == next ? write_log_next(row, b + 1, end) : next;
            }
        }
    assert_true(found > 300);
    write_log_destroy(log);
}

static void what_does_not_fit_is_lost(void **state)
{
    (void)state;
    write_log *log = make(64);
    assert_true(write_log_is_of(log, 3 * BATCHES_EACH));
    write_log_note(log, 2, DRAWS, 0);
    assert_false(write_log_is_of(log, 3 * BATCHES_EACH));
    write_log_note(log, 1, 0, 0);
    write_log_repeat(log, 1, 1, 1);
    write_log_destroy(log);
}

// Short queues, heads and windows: most of a small trace is passed over.
static detail_result *run(const program *program, const machine *machine, trace *trace, const run_result *function, stamps *stamps)
{
    const sampling sampling = {.head = 32, .warm = 64, .lead = 16, .window = 16, .period = 256, .lead_and_window = 32, .seed = 1};
    const detail_options options = {.level = DETAIL_SAMPLED, .sampling = &sampling, .stamps = stamps};
    detail_result *detail;
    assert_int_equal(detail_run(program, machine, trace, function, &options, &quiet, &detail), STATUS_OK);
    assert_true(detail->windows > 0);
    return detail;
}

static void compare(const char *name, const char *base)
{
    char file[4096];
    machine machine;
    program *program;
    trace *trace;
    stamps *read;
    run_result *function;
    const run_options options = {.threads = 2, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    const sampling sampling = sampling_default();
    assert_int_equal(machine_load(base, &quiet, &machine), STATUS_OK);
    for (const char *const *set = (const char *const[]){"raster_queue=2", "shader_queue=16", "depth_queue=2", "color_queue=2", NULL}; *set; set++)
        assert_int_equal(machine_set(&machine, *set, &quiet), STATUS_OK);
    assert_int_equal(program_load(name, &quiet, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, &quiet, &trace), STATUS_OK);
    assert_int_equal(detail_read(program, &machine, trace, &(detail_options){.level = DETAIL_SAMPLED, .sampling = &sampling}, &quiet, &read), STATUS_OK);
    assert_int_equal(replay_run_on(program, &machine, trace, read, &options, &quiet, &function), STATUS_OK);
    assert_true(write_log_is_of(function->writes, read->chunks[0].blocks.batch_count));
    detail_result *with = run(program, &machine, trace, function, read);
    write_log_destroy(function->writes);
    function->writes = NULL;
    detail_result *without = run(program, &machine, trace, function, read);
    assert_memory_equal(&with->total, &without->total, sizeof with->total);
    assert_memory_equal(with->planes, without->planes, sizeof with->planes);
    assert_memory_equal(with->half_widths, without->half_widths, sizeof with->half_widths);
    detail_destroy(with);
    detail_destroy(without);
    result_destroy(function);
    stamps_destroy(read);
    program_destroy(program);
    trace_close(trace);
}

static void the_level_sampled_gives_the_same(void **state)
{
    static const char *const scenes[] = {"opaque:scene:knot", "scene:soup,count=1000", "sorted:scene:slices_cone,slices=6"};
    static const char *const programs[][2] = {{"layer_peel", "g80"}, {"coherent_layer_peel_a", "g80"}, {"coherent_layer_peel_b", "g80"},
        {"ideal_coherent_layer_peel", "programmable"}, {"hybrid_layer_peel", "g80"}, {"fused_coherent_layer_peel", "programmable"},
        {"dual_depth_peel", "programmable"}, {"two_ended_lean_peel", "programmable"}, {"weighted_sum", "g80"}};
    (void)state;
    record_options options;
    record_defaults(&options);
    options.width = 100;
    options.height = 75;
    for (uint32_t samples = 1; samples <= 4; samples += 3) {
        options.samples = samples;
        assert_int_equal(record_scenes(scenes, 3, &options, trace_path, &quiet), STATUS_OK);
        for (size_t i = 0; i < sizeof programs / sizeof *programs; i++)
            compare(programs[i][0], programs[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_hold_what_was_noted),
        cmocka_unit_test(what_does_not_fit_is_lost),
        cmocka_unit_test(the_level_sampled_gives_the_same),
    };
    return cmocka_run_group_tests(tests, trace_path_make, trace_path_remove);
}
