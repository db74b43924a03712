// One instruction at a time against a whole dispatch of 64 lanes: random kernels and passes on random planes and
// fragments leave the same bits in every plane and execute every instruction as often.
#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

// A tile of planes and a batch of fragments, as the dispatch wants them.
typedef struct tile_input {
    _Alignas(64) uint32_t planes[PLANE_MAX][4 * TILE_LANES];
    _Alignas(64) uint32_t codes[FORMAT_COUNT][TILE_LANES];
    _Alignas(64) float rgba[4][TILE_LANES];
    _Alignas(64) uint32_t primitive[TILE_LANES];
    double depth[TILE_LANES];
    uint64_t lanes;
} tile_input;

static uint32_t as_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static float random_float(dice *dice)
{
    static const float special[] = {
        __builtin_nanf(""), __builtin_inff(), -__builtin_inff(), -0.0f, 1e-42f, 3e38f, -1.5f, 70000.0f};
    return dice_chance(dice, 20) ? special[dice_below(dice, 8)] : dice_unit(dice);
}

static uint32_t random_word(dice *dice, const bound_program *bound, int plane)
{
    const format format = bound_plane_format(bound, plane);
    switch (format_table[format].class) {
    case FORMAT_CLASS_DEPTH: return format_depth_to_code(format, dice_below(dice, 7) / 6.0, false);
    case FORMAT_CLASS_UINT:
        return (dice_chance(dice, 50) ? dice_below(dice, 4) : (uint32_t)dice_next(dice)) &
               bound_plane_mask(bound, plane);
    case FORMAT_CLASS_FLOAT: return as_bits(random_float(dice));
    case FORMAT_CLASS_COLOR: break;
    }
    return as_bits(format_round_component(format, random_float(dice)));
}

static void random_tile(dice *dice, const program *program, const bound_program *bound, bool reversed, tile_input *in)
{
    in->lanes = dice_chance(dice, 50) ? UINT64_MAX : dice_next(dice) & dice_next(dice);
    for (int p = 0; p < program->plane_count; p++)
        for (int i = 0; i < 4 * TILE_LANES; i++)
            in->planes[p][i] = random_word(dice, bound, p);
    for (int lane = 0; lane < TILE_LANES; lane++) {
        in->depth[lane] = dice_chance(dice, 80) ? dice_below(dice, 7) / 6.0 : (double)random_float(dice);
        for (int f = 0; f < FORMAT_COUNT; f++)
            if (format_table[f].class == FORMAT_CLASS_DEPTH)
                in->codes[f][lane] = format_depth_to_code((format)f, in->depth[lane], reversed);
        for (int c = 0; c < 4; c++)
            in->rgba[c][lane] = random_float(dice);
        in->primitive[lane] = dice_below(dice, 1000);
    }
}

// Runs each lane on its own over a copy of the planes.
static void run_lanes(const program *program, const bound_program *bound, int kernel, const tile_input *in,
                      uint32_t planes[PLANE_MAX][4 * TILE_LANES], uint64_t *counts)
{
    const bool fullscreen = program->kernels[kernel].fullscreen;
    for (int lane = 0; lane < TILE_LANES; lane++) {
        if (!(in->lanes >> lane & 1))
            continue;
        uint32_t sample[PLANE_MAX][4];
        for (int p = 0; p < program->plane_count; p++)
            for (int c = 0; c < 4; c++)
                sample[p][c] = planes[p][c * TILE_LANES + lane];
        const fragment_input fragment = {in->depth[lane],
                                         {in->rgba[0][lane], in->rgba[1][lane], in->rgba[2][lane], in->rgba[3][lane]},
                                         in->primitive[lane]};
        fragment_state state = {0};
        stepped stepped;
        while (step_instruction(bound, kernel, fullscreen ? NULL : &fragment, sample, &state, &stepped)) {
            counts[stepped.at] += stepped.executed;
            const bool stores = stepped.executed && stepped.instruction.op == OP_st;
            if (stores)  // what it says it wrote is what the plane holds
                assert_int_equal(stepped.after[0], sample[stepped.instruction.d][0]);
        }
        for (int p = 0; p < program->plane_count; p++)
            for (int c = 0; c < 4; c++)
                planes[p][c * TILE_LANES + lane] = sample[p][c];
    }
}

static void compare_kernel(const program *program, const bound_program *bound, int kernel, const tile_input *in,
                           int bytes)
{
    static _Alignas(64) uint32_t vector_planes[PLANE_MAX][4 * TILE_LANES], lane_planes[PLANE_MAX][4 * TILE_LANES];
    uint64_t vector_counts[WORD_MAX] = {0}, lane_counts[WORD_MAX] = {0};
    tile_plane planes[PLANE_MAX];
    batch batch = {.lanes = in->lanes, .primitive = in->primitive};
    execute_kernel *execute = execute_select(bytes);
    if (!execute)
        return;
    memcpy(vector_planes, in->planes, sizeof vector_planes);
    memcpy(lane_planes, in->planes, sizeof lane_planes);
    for (int p = 0; p < PLANE_MAX; p++)
        planes[p] = vector_planes[p];
    for (int f = 0; f < FORMAT_COUNT; f++)
        batch.depth[f] = in->codes[f];
    for (int c = 0; c < 4; c++)
        batch.rgba[c] = in->rgba[c];
    execute(bound, kernel, planes, &batch, vector_counts);
    run_lanes(program, bound, kernel, in, lane_planes, lane_counts);
    assert_memory_equal(lane_counts, vector_counts, sizeof lane_counts);
    for (int p = 0; p < program->plane_count; p++) {
        const bool color = format_table[bound_plane_format(bound, p)].class == FORMAT_CLASS_COLOR;
        if (memcmp(lane_planes[p], vector_planes[p], (color ? 4 : 1) * sizeof vector_planes[p] / 4) != 0) {
            disassemble_bound(program, bound, stdout);
            fail_msg("kernel '%s', vectors of %d bytes: plane '%s' differs", program->kernels[kernel].name, bytes,
                     program->planes[p].name);
        }
    }
}

static void compare_random(bool fixed_function, uint32_t count)
{
    static program_text text;
    tile_input *in = aligned_alloc(64, sizeof *in);
    assert_non_null(in);
    memset(in, 0, sizeof *in);
    uint64_t kernels = 0;
    for (uint32_t i = 0; i < test_count(count); i++) {
        dice dice = {(test_seed() << 32) + i};
        machine machine;
        program *program;
        bound_program *bound;
        rop_limits limits;
        const float background[4] = {0.25f, 0.5f, 0.75f, 1};
        const bool reversed = dice_chance(&dice, 30);
        random_machine(&dice, fixed_function ? "g80" : "programmable", &machine);
        random_program(&dice, fixed_function, &text);
        assert_int_equal(assemble_text("random", text.text, text.size, &printing, &program), STATUS_OK);
        machine_limits(&machine, &limits);
        if (bind_program(program, &limits, reversed, background, NULL, &bound) == STATUS_OK) {
            random_tile(&dice, program, bound, reversed, in);
            for (int k = 0; k < program->kernel_count; k++) {
                if (program->kernels[k].is_shader)  // runs as part of its passes
                    continue;
                for (int bytes = 16; bytes <= 64; bytes *= 2)
                    compare_kernel(program, bound, k, in, bytes);
                kernels++;
            }
            bound_destroy(bound);
        }
        program_destroy(program);
    }
    free(in);
    assert_true(kernels > count);
}

static void kernels_equal_dispatch(void **state)
{
    (void)state;
    compare_random(false, 300);
}

static void passes_equal_dispatch(void **state)
{
    (void)state;
    compare_random(true, 150);
}

// What a single step reports, on a kernel that is short enough to follow.
static void step_tells(void **state)
{
    (void)state;
    static const char text[] =
        "program steps\nplane d depth\nplane k rgba\noutput k\nkernel peel\n"
        " ld r0, d\n lt p1, r0, z\n@p1 st d, z\n@!p1 ne p2, r0, z\n skip p1, on\n mov r0, 7\non:\n st d, r0\nend\n"
        "schedule\n draw transparent with peel\nend\n";
    const rop_limits limits = {.depth_format = FORMAT_z16, .color_format = FORMAT_rgba8, .stencil_bits = 8};
    const float background[4] = {0};
    program *program;
    bound_program *bound;
    assert_int_equal(assemble_text("steps", text, strlen(text), &printing, &program), STATUS_OK);
    assert_int_equal(bind_program(program, &limits, false, background, NULL, &bound), STATUS_OK);
    uint32_t planes[PLANE_MAX][4] = {{100}};
    const fragment_input fragment = {.depth = 1.0};
    fragment_state registers = {0};
    stepped s;
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // ld
    assert_true(s.executed && s.at == 0 && s.a[0] == 100 && s.before[0] == 0 && s.after[0] == 100);
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // lt
    assert_true(s.executed && s.a[0] == 100 && s.b[0] == 65535 && s.after[0] == 1);
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // st
    assert_true(s.executed && s.before[0] == 100 && s.after[0] == 65535 && planes[0][0] == 65535);
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // ne, switched off
    assert_true(!s.executed && s.after[0] == 0);
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // skip
    assert_true(s.executed && s.a[0] == 1);
    assert_true(step_instruction(bound, 0, &fragment, planes, &registers, &s));  // st, behind the label
    assert_true(s.at == 6 && s.after[0] == 100);
    assert_false(step_instruction(bound, 0, &fragment, planes, &registers, &s));
    bound_destroy(bound);
    program_destroy(program);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_equal_dispatch),
        cmocka_unit_test(passes_equal_dispatch),
        cmocka_unit_test(step_tells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
