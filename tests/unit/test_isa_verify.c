// Programs against machines: for each limit a program that just fits and one that is just too much, with its message.
// And lowering: a pass as instructions is the same program.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "messages.h"

#include <stdlib.h>

static const rop_limits generous = {.machine = "m",
                                    .depth_format = FORMAT_z24,
                                    .color_format = FORMAT_rgba8,
                                    .stencil_bits = 8,
                                    .formats = UINT32_MAX,
                                    .opcodes = UINT32_MAX,
                                    .planes_max = PLANE_MAX,
                                    .bits_per_sample_max = 65536,
                                    .color_targets_max = TARGET_MAX,
                                    .instructions_max = WORD_MAX};

// Lines 2 to 7: 24 + 8 + 32 + 32 bits. The kernel begins in line 11, the pass in line 16.
static const char text[] = "program p\n"
                           "plane z0 depth\n"
                           "plane s0 stencil\n"
                           "plane c0, c1 rgba\n"
                           "query q\n"
                           "blend b rgb add one one alpha add one one\n"
                           "output c0\n"
                           "\n"
                           "\n"
                           "\n"
                           "kernel k\n"
                           "    ld    r0, z0\n"
                           "    lt    p1, z, r0\n"
                           "@p1 st    z0, z\n"
                           "end\n"
                           "pass fixed\n"
                           "    stencil s0 less 15 255 keep keep incr\n"
                           "    depth less z0\n"
                           "    target c0 b color\n"
                           "    target c1 replace premul\n"
                           "    count q\n"
                           "end\n"
                           "schedule\n"
                           "    draw transparent with k\n"
                           "    draw transparent with fixed\n"
                           "end\n";

static program *assembled(const char *source)
{
    static messages said;
    program *program;
    messages_start(&said);
    if (assemble_text("p.rop", source, strlen(source), &said.report, &program) != STATUS_OK)
        fail_msg("%s", said.text);
    return program;
}

// NULL: it runs; else all that is said.
static void expect_verify(rop_limits limits, const char *message)
{
    static messages said;
    program *program = assembled(text);
    messages_start(&said);
    assert_int_equal(verify_program(program, "p.rop", &limits, &said.report), message ? STATUS_REFUSED : STATUS_OK);
    assert_string_equal(said.text, message ? message : "");
    assert_int_equal(verify_program(program, "p.rop", &limits, NULL), message ? STATUS_REFUSED : STATUS_OK);
    program_destroy(program);
}

#define EXPECT(field, value, message) \
    do { \
        rop_limits limits = generous; \
        limits.field = (value); \
        expect_verify(limits, message); \
    } while (0)

static void test_limits(void **state)
{
    (void)state;
    expect_verify(generous, NULL);
    EXPECT(planes_max, 4, NULL);
    EXPECT(planes_max, 3,
           "p.rop:4: plane 'c1' is one too many: the program has 4 planes, the machine takes 3 (machine m)\n");
    EXPECT(planes_max, 1,
           "p.rop:3: plane 's0' is one too many: the program has 4 planes, the machine takes 1 (machine m)\n");
    EXPECT(bits_per_sample_max, 24 + 8 + 32 + 32, NULL);
    EXPECT(bits_per_sample_max, 24 + 8 + 32 + 31,
           "p.rop:4: with plane 'c1' a sample takes 96 bits, the machine has 95 (machine m)\n");
    EXPECT(bits_per_sample_max, 23,
           "p.rop:2: with plane 'z0' a sample takes 24 bits, the machine has 23 (machine m)\n");
    EXPECT(color_targets_max, 2, NULL);
    EXPECT(color_targets_max, 1, "p.rop:16: pass 'fixed' writes 2 colour targets, the machine has 1 (machine m)\n");
    EXPECT(instructions_max, 3, NULL);
    EXPECT(instructions_max, 2, "p.rop:11: kernel 'k' has 3 instructions, the machine's memory holds 2 (machine m)\n");
    EXPECT(stencil_bits, 4, NULL);
    EXPECT(stencil_bits, 3, "p.rop:16: pass 'fixed' has stencil reference 15, but 3 bits hold at most 7 (machine m)\n");
    EXPECT(opcodes, 1u << OP_ld | 1u << OP_lt | 1u << OP_st, NULL);
    EXPECT(opcodes, 1u << OP_ld | 1u << OP_st, "p.rop:13: opcode lt, which the machine lacks (machine m)\n");
    EXPECT(formats, 1u << FORMAT_z24 | 1u << FORMAT_u8 | 1u << FORMAT_rgba8, NULL);
    EXPECT(formats, 1u << FORMAT_z24 | 1u << FORMAT_rgba8,
           "p.rop:3: plane 's0' has format u8, which the machine lacks (machine m)\n");
    EXPECT(formats, ~(1u << FORMAT_z24), "p.rop:2: plane 'z0' has format z24, which the machine lacks (machine m)\n");
    EXPECT(
        fixed_function, true,
        "p.rop:11: 'k' is a kernel; the machine has no programmable ROP and runs declared passes only (machine m)\n");
    // All reasons at once.
    rop_limits limits = generous;
    limits.planes_max = 3;
    limits.color_targets_max = 1;
    expect_verify(limits,
                  "p.rop:4: plane 'c1' is one too many: the program has 4 planes, the machine takes 3 (machine m)\n"
                  "p.rop:16: pass 'fixed' writes 2 colour targets, the machine has 1 (machine m)\n");
}

static void test_formats_and_bits(void **state)
{
    (void)state;
    program *program = assembled(text);
    rop_limits limits = generous;
    limits.stencil_bits = 5;
    assert_int_equal(plane_format(&program->planes[0], &limits), FORMAT_z24);
    assert_int_equal(plane_bits(&program->planes[0], &limits), 24);
    assert_int_equal(plane_format(&program->planes[1], &limits), FORMAT_u8);
    assert_int_equal(plane_bits(&program->planes[1], &limits), 5);
    assert_int_equal(plane_format(&program->planes[2], &limits), FORMAT_rgba8);
    program_destroy(program);
}

static void test_shipped_programs(void **state)
{
    (void)state;
    static const struct {
        const char *program, *refused;
    } cases[] = {{"layer_peel", NULL},
                 {"coherent_layer_peel_a", NULL},
                 {"ideal_coherent_layer_peel", "'search' is a kernel"},
                 {"ideal_coherent_layer_peel_printed", "'search' is a kernel"}};
    for (int i = 0; i < 4; i++) {
        for (int m = 0; m < 3; m++) {
            static const char *const machines[] = {"g80", "programmable", "tiny"};
            static messages said;
            char path[4096];
            program *program;
            machine machine;
            rop_limits limits;
            messages_start(&said);
            snprintf(path, sizeof path, ROPSIM_SOURCE "/programs/%s.rop", cases[i].program);
            assert_int_equal(assemble_file(path, NULL, &program), STATUS_OK);
            assert_int_equal(machine_load(machines[m], NULL, &machine), STATUS_OK);
            machine_limits(&machine, &limits);
            const bool refused = m == 0 && cases[i].refused;
            assert_int_equal(verify_program(program, path, &limits, &said.report),
                             refused ? STATUS_REFUSED : STATUS_OK);
            assert_true(!refused || strstr(said.text, cases[i].refused));
            program_destroy(program);
        }
    }
}

// ---- Lowering --------------------------------------------------------------------------------------------

static char *lowered(const program *program, const rop_limits *limits)
{
    static const float background[4];
    bound_program *bound;
    char *out = NULL;
    size_t size = 0;
    assert_int_equal(bind_program(program, limits, false, background, NULL, &bound), STATUS_OK);
    FILE *stream = open_memstream(&out, &size);
    assert_non_null(stream);
    assert_int_equal(disassemble_bound(program, bound, stream), STATUS_OK);
    fclose(stream);
    bound_destroy(bound);
    return out;
}

static void expect_lowering(const char *state_lines, const char *instructions)
{
    char source[2048], wanted[2048];
    snprintf(source, sizeof source,
             "program p\nplane z0, z1 depth\nplane s0 stencil\nplane col rgba\nquery q\n"
             "blend b rgb add one one alpha add one one\noutput col\npass k\n%send\nschedule\nend\n",
             state_lines);
    snprintf(wanted, sizeof wanted, "\nkernel k\n%send\n", instructions);
    program *program = assembled(source);
    char *out = lowered(program, &generous);
    if (!strstr(out, wanted))
        fail_msg("lowered:\n%s\nexpected:\n%s", strstr(out, "\nkernel"), wanted);
    free(out);
    program_destroy(program);
}

static void test_lowering(void **state)
{
    (void)state;
    expect_lowering("", "");
    expect_lowering("depth less z0\n", "           ld    r5, z0\n"
                                       "           lt    p4, z.z24, r5\n"
                                       "           pand  p5, p0, !p4\n"
                                       "    @p4    st    z0, z.z24\n");
    expect_lowering("clip z > z1\ntarget col b premul\ncount q\n", "           tex   r1, z1\n"
                                                                   "           lt    p1, r1, z.z24\n"
                                                                   "    @p1    ld    c7, col\n"
                                                                   "    @p1    blend c7, premul, c7, b\n"
                                                                   "    @p1    st    col, c7\n"
                                                                   "    @p1    count q\n");
    expect_lowering("stencil s0 always 3 255 keep keep replace\n", "           pand  p2, p0, p0\n"
                                                                   "           pand  p3, p0, !p2\n"
                                                                   "    @p2    mov   r6, 3\n"
                                                                   "    @p2    st    s0, r6\n");
}

// What passes lower to, assembled again as kernels, lowers to itself.
static void test_lowered_text(void **state)
{
    (void)state;
    static const char *const stems[] = {"layer_peel", "coherent_layer_peel_a"};
    for (int i = 0; i < 2; i++) {
        char path[4096];
        program *program;
        snprintf(path, sizeof path, ROPSIM_SOURCE "/programs/%s.rop", stems[i]);
        assert_int_equal(assemble_file(path, NULL, &program), STATUS_OK);
        char *once = lowered(program, &generous);
        program_destroy(program);
        program = assembled(once);
        char *twice = lowered(program, &generous);
        assert_string_equal(once, twice);
        program_destroy(program);
        free(once);
        free(twice);
    }
}

// More stencil values than a bound program has room for are refused, not mixed up.
static void test_too_many_constants(void **state)
{
    (void)state;
    for (int passes = 40; passes <= 64; passes += 24) {
        static const float background[4];
        static messages said;
        bound_program *bound;
        char *source = NULL;
        size_t size = 0;
        FILE *stream = open_memstream(&source, &size);
        assert_non_null(stream);
        fprintf(stream, "program p\nplane s0 stencil\nplane c0 rgba\noutput c0\n");
        for (int i = 0; i < passes; i++)
            fprintf(stream, "pass k%d\nstencil s0 less %d %d replace keep incr write %d\nend\n", i, i + 2, 66 + i,
                    130 + i);
        fprintf(stream, "schedule\nend\n");
        fclose(stream);
        program *program = assembled(source);
        messages_start(&said);
        const status status = bind_program(program, &generous, false, background, &said.report, &bound);
        assert_int_equal(status, passes == 64 ? STATUS_REFUSED : STATUS_OK);
        assert_true(passes != 64 || strstr(said.text, "the passes need more than 192 constants"));
        bound_destroy(bound);
        program_destroy(program);
        free(source);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_limits),           cmocka_unit_test(test_formats_and_bits),
        cmocka_unit_test(test_shipped_programs), cmocka_unit_test(test_lowering),
        cmocka_unit_test(test_lowered_text),     cmocka_unit_test(test_too_many_constants),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
