// Which stamps the level sampled looks at: any is as likely to be measured as any other, at strata's ends and at the pass's.
#include "cost_fixture.h"

#include <math.h>

enum { SIDE = 512, BOXES = SIDE / 8 * SIDE / 8, SEEDS = 800, WINDOW = 64, EVERY = 8 };

static const report quiet = {0};

// One box a block: each stamp begins a primitive, so primitives that began before are stamps that came before.
typedef struct tally {
    bool draws;
    stamp_phase phase;
    uint64_t next;                   // stamp's number
    uint64_t windows, measured, head;  // stamps of windows, of heads
    uint64_t hits[BOXES];
} tally;

static status begin(void *user, const pass_info *pass)
{
    tally *t = user;
    t->draws = pass->kind == PASS_DRAW;
    return STATUS_OK;
}

static status end(void *user)
{
    (void)user;
    return STATUS_OK;
}

static status enter(void *user, stamp_phase phase, uint64_t begun)
{
    tally *t = user;
    t->phase = phase;
    t->next = begun;
    t->windows += t->draws && phase == PHASE_MEASURE;
    return STATUS_OK;
}

static status take(void *user, const stamp *stamp)
{
    tally *t = user;
    if (!t->draws)
        return STATUS_OK;
    assert_true(stamp->begins_primitive);
    assert_true(t->next < BOXES);
    t->head += t->phase == PHASE_HEAD;
    t->measured += t->phase == PHASE_MEASURE;
    t->hits[t->next++] += t->phase == PHASE_MEASURE;
    return STATUS_OK;
}

static status warm(void *user, const stamp *stamp, const uint64_t *times)
{
    (void)user, (void)stamp, (void)times;
    return STATUS_OK;
}

static void passed_over(void *user, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time)
{
    (void)user, (void)tile, (void)planes, (void)lanes, (void)time;
}

static tally run_seeds(void)
{
    static const run_options function_options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    static box boxes[BOXES];
    sampling sampling = {.head = 32, .warm = 64, .lead = 32, .window = WINDOW, .period = EVERY * WINDOW, .lead_and_window = 32 + WINDOW};
    const machine machine = cost_machine("tiny", "raster_queue=2 shader_queue=4 depth_queue=2 color_queue=2");
    char file[4096];
    program *program;
    run_result *function;
    arrival *arrival;
    tally t = {0};
    for (uint32_t i = 0; i < BOXES; i++) {
        const uint32_t x = i % (SIDE / 8) * 8, y = i / (SIDE / 8) * 8;
        boxes[i] = (box){x, y, x + 1, y + 1, 0.5, CLASS_TRANSPARENT};
    }
    box_scene scene = {.width = SIDE, .height = SIDE, .samples = 1, .boxes = boxes, .count = BOXES, .triangles = BOXES, .vertices = 3 * BOXES};
    trace *trace = cost_trace(&scene);
    assert_int_equal(program_load("weighted_sum", &quiet, file, sizeof file, &program), STATUS_OK);
    assert_int_equal(replay_run(program, &machine, trace, &function_options, &quiet, &function), STATUS_OK);
    assert_int_equal(arrival_create(program, &machine, trace, function, &(arrival_options){.sampling = &sampling}, &quiet, &arrival), STATUS_OK);
    const stamp_sink sink = {.begin_pass = begin, .stamp = take, .end_pass = end, .warm = warm, .skip = passed_over, .phase = enter, .user = &t};
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        sampling.seed = seed;
        assert_int_equal(arrival_run(arrival, &sink), STATUS_OK);
    }
    arrival_destroy(arrival);
    result_destroy(function);
    program_destroy(program);
    trace_close(trace);
    return t;
}

static void any_stamp_is_as_likely_to_be_measured(void **state)
{
    (void)state;
    const tally t = run_seeds();
    assert_int_equal(t.head % SEEDS, 0);
    const uint64_t head = t.head / SEEDS, behind = BOXES - head;
    assert_true(head >= 32 && head < BOXES / 4);
    const double mean = (double)t.measured / (double)behind, chance = mean / SEEDS, deviation = sqrt(mean * (1 - chance));
    assert_true(t.windows >= 6 * SEEDS);
    assert_true(fabs(chance * EVERY - 1) < 0.15);  // strata are not cut to the stamp
    for (uint64_t i = 0; i < head; i++)
        assert_int_equal(t.hits[i], 0);
    for (uint64_t i = head; i < BOXES; i++)
        if (fabs((double)t.hits[i] - mean) > 6 * deviation)
            fail_msg("stamp %d of %d, behind a head of %d: measured %d times, expected %.0f +- %.0f", (int)i, BOXES, (int)head, (int)t.hits[i], mean, deviation);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(any_stamp_is_as_likely_to_be_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
