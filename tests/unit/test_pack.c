// Stamps that one dispatch runs together against each of them for itself: every field of every stamp, every plane that it touches,
// and what its block holds when it is told, must be the same.
#include "trace_path.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>

static const report quiet = {0};

// A sum over all that stamps say, in their order.
typedef struct told {
    const frame *frame;
    uint64_t sum, stamps, small, accesses, hierarchical;
} told;

static void mix(told *t, uint64_t value)
{
    t->sum = (t->sum ^ value) * UINT64_C(0x9e3779b97f4a7c15);
    t->sum ^= t->sum >> 29;
}

static status begin(void *user, const pass_info *pass)
{
    mix(user, pass->stamps);
    return STATUS_OK;
}

static status end(void *user)
{
    mix(user, 1);
    return STATUS_OK;
}

static status take(void *user, const stamp *stamp)
{
    told *t = user;
    const uint64_t fields[] = {stamp->tile, stamp->draw, stamp->begins_primitive, stamp->hierarchical, stamp->lanes, stamp->shaded, stamp->alive,
                               stamp->passed, stamp->kernel_slots, stamp->quads, stamp->quads_shaded, stamp->quads_passed, stamp->texture_reads,
                               stamp->list_bytes, (uint64_t)stamp->access_count};
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++)
        mix(t, fields[i]);
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &stamp->accesses[i];
        const uint64_t what[] = {access->plane, access->unit, access->read, access->written};
        for (size_t k = 0; k < sizeof what / sizeof *what; k++)
            mix(t, what[k]);
        const uint32_t *words = t->frame->contents(t->frame->user, access->plane, stamp->tile);
        const bool color = format_table[t->frame->plane_formats[access->plane]].class == FORMAT_CLASS_COLOR;
        for (int w = 0; w < (color ? 4 : 1) * TILE_LANES; w++)
            mix(t, words[w]);
    }
    t->stamps++;
    t->small += count_lanes(stamp->lanes) < 8;
    t->accesses += (uint64_t)stamp->access_count;
    t->hierarchical += stamp->hierarchical;
    return STATUS_OK;
}

static told run(const program *program, const machine *machine, trace *trace, const run_result *function, bool apart)
{
    const arrival_options options = {.hierarchical = machine->hierarchical_depth, .early = machine->early_depth, .apart = apart};
    arrival *arrival;
    assert_int_equal(arrival_create(program, machine, trace, function, &options, &quiet, &arrival), STATUS_OK);
    told t = {.frame = arrival_frame(arrival)};
    assert_int_equal(arrival_run(arrival, &(stamp_sink){.begin_pass = begin, .stamp = take, .end_pass = end, .user = &t}), STATUS_OK);
    assert_int_equal(arrival_check(arrival), STATUS_OK);
    arrival_destroy(arrival);
    t.frame = NULL;
    return t;
}

static void compare(const char *name, const char *machine_name)
{
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    char file[4096];
    machine machine;
    program *program;
    trace *trace;
    run_result *function;
    assert_int_equal(machine_load(machine_name, &quiet, &machine), STATUS_OK);
    assert_int_equal(program_load(name, &quiet, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, &quiet, &trace), STATUS_OK);
    assert_int_equal(replay_run(program, &machine, trace, &options, &quiet, &function), STATUS_OK);
    const told together = run(program, &machine, trace, function, false), apart = run(program, &machine, trace, function, true);
    assert_true(2 * together.small > together.stamps);  // else there is little to see
    assert_true(together.accesses > 0);
    assert_int_equal(together.stamps, apart.stamps);
    assert_int_equal(together.accesses, apart.accesses);
    assert_int_equal(together.hierarchical, apart.hierarchical);
    assert_true(together.sum == apart.sum);
    result_destroy(function);
    trace_close(trace);
    program_destroy(program);
}

static void record(uint32_t samples)
{
    static const char *const scenes[] = {"scene:soup,count=300", "scene:knot"};
    record_options options;
    record_defaults(&options);
    options.width = 72;
    options.height = 60;
    options.samples = samples;
    assert_int_equal(record_scenes(scenes, 2, &options, trace_path, &quiet), STATUS_OK);
}

static void test_stamps_are_those_of_single_dispatches(void **state)
{
    static const char *const runs[][2] = {
        {"layer_peel", "g80"}, {"coherent_layer_peel_a", "g80"}, {"coherent_layer_peel_b", "g80"}, {"layer_peel", "modern"},
        {"ideal_coherent_layer_peel", "programmable"}, {"fused_coherent_layer_peel", "programmable"}, {"item_buffer", "programmable"},
        {"weighted_average", "g80"}, {"stencil_routed_k_buffer", "modern"}, {"dual_depth_peel", "g80"}};
    (void)state;
    for (uint32_t samples = 1; samples <= 4; samples *= 4) {
        record(samples);
        for (size_t i = 0; i < sizeof runs / sizeof *runs; i++)
            compare(runs[i][0], runs[i][1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_stamps_are_those_of_single_dispatches)};
    return cmocka_run_group_tests(tests, trace_path_make, trace_path_remove);
}
