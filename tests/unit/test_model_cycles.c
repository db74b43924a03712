// Cycles of the smallest traces, worked out by hand from the rules of docs/machine.md: the cycle asserted, no sooner
// and no later.
//
// s is the pass's start. On tiny every rate is a quad a clock, a line of 256 bytes takes 32 clocks of memory and 20 of
// latency, and an operation is done 4 cycles after its end. No draw has triangles, so that geometry takes nothing: the
// first stamp leaves the rasterizer at s and arrives at s + 1, the next a cycle later.
#include "cost_fixture.h"

#define HEAD \
    "program small\nplane z, zt depth\nplane base, front rgba\nquery seen\n" \
    "blend under rgb add dst_alpha one alpha add zero one_minus_src_alpha\noutput base\n"
#define TAIL "schedule\nclear z far\nclear base background\ndraw opaque with first\nend\n"
static const char depth_only[] = HEAD "pass first\ndepth less z\nend\n" TAIL;
// `front` was never cleared: memory holds all of it, and a blend reads it.
static const char blend[] = HEAD "pass first\ntarget front under color\nend\n" TAIL;
static const char blend_cleared[] = HEAD "pass first\ntarget base under color\nend\n" TAIL;
static const char clip[] = HEAD "pass first\ndepth less zt\nend\npass second\nclip z < zt\ncount seen\nend\n"
                                "schedule\nclear zt far\ndraw opaque with first\ndraw transparent with second\nend\n";
// Eight instructions of a slot each, the last never executed.
static const char kernel[] =
    HEAD "kernel first\nld r0, z\nmin r0, r0, z\nadd r1, r0, 1\nadd r1, r1, 1\nadd r1, r1, 1\nst z, r0\n"
         "lt p1, z, near\n@p1 add r1, r1, 1\nend\n" TAIL;

typedef struct times {
    uint64_t start, last, drained, interlock, victim;
} times;  // last and drained since the start

static times time_boxes(const char *machine_name, const char *sets, const char *text, uint32_t width, uint32_t height,
                        const box *boxes, uint32_t count)
{
    const machine machine = cost_machine(machine_name, sets);
    box_scene scene = {.width = width, .height = height, .samples = 1, .boxes = boxes, .count = count};
    detail_result *detail = cost_run(text, &machine, &scene);
    const pass_record *pass = cost_draw(detail);
    const times times = {pass->start, pass->last_fragment - pass->start, pass->drained - pass->start,
                         pass->statistics.unit_wait_interlock, pass->statistics.unit_wait_victim};
    detail_destroy(detail);
    return times;
}

static const box one[] = {{0, 0, 2, 2, 0.5, CLASS_OPAQUE}};
static const box same_quad[] = {{0, 0, 2, 2, 0.5, CLASS_OPAQUE}, {0, 0, 2, 2, 0.25, CLASS_OPAQUE}};
static const box next_quad[] = {{0, 0, 2, 2, 0.5, CLASS_OPAQUE}, {2, 0, 4, 2, 0.5, CLASS_OPAQUE}};
static const box next_block[] = {{0, 0, 2, 2, 0.5, CLASS_OPAQUE}, {8, 0, 10, 2, 0.5, CLASS_OPAQUE}};

// The clears mark 1 line of z and 4 of base, a line a clock: s = 5. Nothing is shaded: the shader passes the stamp on
// at s + 1. Depth unit: lookup at s + 1, a cleared line is there at s + 2, 4 samples take a cycle, done at s + 3 + 4.
// The line goes back whole, since it was cleared: 32 clocks.
static void one_quad_of_depth(void **state)
{
    (void)state;
    const times t = time_boxes("tiny", NULL, depth_only, 2, 2, one, 1);
    assert_int_equal(t.start, 5);
    assert_int_equal(t.last, 7);
    assert_int_equal(t.drained, 7 + 32);
}

// Shaded from s + 1 to s + 2. Colour unit: lookup at s + 2, a miss: 32 clocks and 20 are s + 54; blended in a cycle,
// done at s + 55 + 4. Two rows of two pixels are two bursts of 8 bytes: 2 clocks to write back.
static void one_quad_blended(void **state)
{
    (void)state;
    const times t = time_boxes("tiny", "color_format=rgba8", blend, 2, 2, one, 1);
    assert_int_equal(t.last, 59);
    assert_int_equal(t.drained, 61);
    // Each part of the sum on its own: one cycle more or less of it is one of the whole.
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 memory_latency_cycles=19", blend, 2, 2, one, 1).last, 58);
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 rop_latency_cycles=5", blend, 2, 2, one, 1).last, 60);
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 shader_latency_cycles=1", blend, 2, 2, one, 1).last, 60);
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 memory_t_cl=3 memory_t_rcd=2", blend, 2, 2, one, 1).last,
                     64);
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 blend_samples_per_clock=2", blend, 2, 2, one, 1).last, 60);
}

// A second quad of the same line: arrives at s + 2, is shaded until s + 3, finds the line on its way, and is blended
// when the first has been: from s + 55 to s + 56. No second read.
static void a_hit_takes_its_operation(void **state)
{
    (void)state;
    const times t = time_boxes("tiny", "color_format=rgba8", blend, 4, 2, next_quad, 2);
    assert_int_equal(t.last, 60);
    assert_int_equal(t.interlock, 0);
}

// On the same quad it may begin when the first is done, at s + 59, 4 cycles after it could have, and is done at s + 60
// + 4. Without an interlock it takes the time of the hit, and so it does if the first were done a cycle earlier: at t -
// 1 it is not ready, at t it is.
static void a_hazard_waits_to_the_cycle(void **state)
{
    (void)state;
    const times exact = time_boxes("tiny", "color_format=rgba8", blend, 2, 2, same_quad, 2);
    assert_int_equal(exact.last, 64);
    assert_int_equal(exact.interlock, 4);
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 interlock=none", blend, 2, 2, same_quad, 2).last, 60);
    // One cycle less of latency: the first is done at s + 58, the second at s + 59 + 3.
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 rop_latency_cycles=3", blend, 2, 2, same_quad, 2).last, 62);
    // No latency: nothing to wait for, and nothing waited.
    const times none = time_boxes("tiny", "color_format=rgba8 rop_latency_cycles=0", blend, 2, 2, same_quad, 2);
    assert_int_equal(none.last, 56);
    assert_int_equal(none.interlock, 0);
    // One bucket: any two quads are taken for one.
    assert_int_equal(
        time_boxes("tiny", "color_format=rgba8 interlock=buckets interlock_buckets=1", blend, 4, 2, next_quad, 2).last,
        64);
    // In the depth unit: operations at s + 2 and, instead of s + 3, s + 7; done at s + 12.
    assert_int_equal(time_boxes("tiny", NULL, depth_only, 2, 2, same_quad, 2).last, 12);
    assert_int_equal(time_boxes("tiny", "interlock=none", depth_only, 2, 2, same_quad, 2).last, 8);
}

// A cache of one line. The second stamp's lookup at s + 3 has to replace the first's line, which is used until s + 55:
// it waits 52 cycles. Then 16 bytes are written, from s + 55 to s + 57; the port takes the read at s + 56, its data
// come from s + 57 to s + 89 and are there at s + 109; done at s + 110 + 4, 2 clocks to write back.
static void a_replaced_line_is_written_first(void **state)
{
    (void)state;
    const times t =
        time_boxes("tiny", "color_format=rgba8 color_cache_bytes=256 color_cache_ways=1", blend, 10, 2, next_block, 2);
    assert_int_equal(t.victim, 52);
    assert_int_equal(t.last, 114);
    assert_int_equal(t.drained, 116);
    // With room for both the second read follows the first on the bus: data from s + 34 to s + 66, there at s + 86,
    // done at s + 91.
    assert_int_equal(time_boxes("tiny", "color_format=rgba8", blend, 10, 2, next_block, 2).last, 91);
    // One miss at a time: the second is asked for at s + 54, there at s + 54 + 52.
    assert_int_equal(time_boxes("tiny", "color_format=rgba8 cache_misses_max=1", blend, 10, 2, next_block, 2).last,
                     111);
}

// A whole block of 16-byte samples: 4 lines, looked up in 4 cycles. 16 quads are shaded until s + 17; lookups until s +
// 20, operation from s + 21 on, 16 cycles.
static void four_lines_take_four_lookups(void **state)
{
    (void)state;
    const box block[] = {{0, 0, 8, 8, 0.5, CLASS_OPAQUE}};
    assert_int_equal(time_boxes("tiny", NULL, blend_cleared, 8, 8, block, 1).last, 41);
    // On a partition with a quarter of the rate: from s + 21 to s + 85.
    assert_int_equal(time_boxes("tiny", "blend_wide_samples_per_clock=1", blend_cleared, 8, 8, block, 1).last, 89);
}

// A block of one depth, read as a texture by a quad: lookup in the shader at s + 1. Compressed it is a quarter, 8
// clocks, and 5 cycles to decompress: there at s + 1 + 8 + 20 + 5. The clip's two instructions take 4 x 2 operations, 2
// cycles, longer than 4 texture samples; no unit behind has work.
static void a_compressed_line(void **state)
{
    (void)state;
    const box boxes[] = {{0, 0, 8, 8, 0.5, CLASS_OPAQUE}, {0, 0, 2, 2, 0.25, CLASS_TRANSPARENT}};
    assert_int_equal(time_boxes("tiny", "depth_compression=true compression_cycles=5", clip, 8, 8, boxes, 2).last, 36);
    // Uncompressed: 32 clocks, no such cycles.
    assert_int_equal(time_boxes("tiny", "compression_cycles=5", clip, 8, 8, boxes, 2).last, 1 + 32 + 20 + 2);
}

// Lookup at s + 1, operation at s + 2: a slot for each instruction of a quad, the last one, whose guard never holds,
// too.
static void a_kernel_takes_its_slots(void **state)
{
    (void)state;
    assert_int_equal(time_boxes("tiny", NULL, kernel, 2, 2, one, 1).last, 2 + 8 + 4);
    assert_int_equal(time_boxes("tiny", "kernel_guarded_slots=0", kernel, 2, 2, one, 1).last, 2 + 7 + 4);
    // Two quads in one stamp.
    const box both[] = {{0, 0, 4, 2, 0.5, CLASS_OPAQUE}};
    assert_int_equal(time_boxes("tiny", NULL, kernel, 4, 2, both, 1).last, 2 + 16 + 4);
    // 8 slots at 3 a clock are two cycles and two thirds: done at the next whole one.
    assert_int_equal(time_boxes("tiny", "kernel_slots_per_clock=3", kernel, 2, 2, one, 1).last, 2 + 3 + 4);
}

// g80, a quad that misses in an idle machine. Two clears of a line each, 64 a clock: s = 2. Shading: 48 operations of
// 300 / 6 a partition, 0.96 cycles, then 40 of latency: the lookup is at s + 42 = 44. That is memory clock ceil(44 x
// 900 / 575) = 69; RCD 12 and CL 10 after it 16 clocks of data: until 107, which is core cycle ceil(107 x 575 / 900) =
// 69; 60 of latency: 129. 4 blends at 2 a clock and partition: 131; 8 of latency: 139.
static void unloaded_latency_of_g80(void **state)
{
    (void)state;
    const times t = time_boxes("g80", NULL, blend, 2, 2, one, 1);
    assert_int_equal(t.start, 2);
    assert_int_equal(t.last, 139 - 2);
    // Colour of 128 bits: the quad lies in the first quarter of its block, a line of 256 bytes as before; one blend a
    // clock: 2 cycles more. The clear of `base` is of 4 lines, still a cycle.
    assert_int_equal(time_boxes("g80", "color_format=rgba32f", blend, 2, 2, one, 1).last, 137 + 2);
    // Row 1 of the same bank open would cost RP and more; an empty bank costs RCD alone: 5 memory clocks fewer of it
    // are ceil(102 x 575 / 900) = 66.
    assert_int_equal(time_boxes("g80", "memory_t_rcd=7", blend, 2, 2, one, 1).last, 137 - 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_quad_of_depth),
        cmocka_unit_test(one_quad_blended),
        cmocka_unit_test(a_hit_takes_its_operation),
        cmocka_unit_test(a_hazard_waits_to_the_cycle),
        cmocka_unit_test(a_replaced_line_is_written_first),
        cmocka_unit_test(four_lines_take_four_lookups),
        cmocka_unit_test(a_compressed_line),
        cmocka_unit_test(a_kernel_takes_its_slots),
        cmocka_unit_test(unloaded_latency_of_g80),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
