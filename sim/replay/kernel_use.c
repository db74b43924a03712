// A bound program in; out of each kernel: which planes it touches where, which instructions decide on its fragments, and
// what a machine may do before it shades.
//
// Hierarchical depth may discard a stamp whole if a fragment that fails the depth test leaves nothing behind: no stencil
// operation on failure. An early test moves the whole test, and what it writes, in front of the shader: that is legal if the
// shader discards nothing, or if the test writes nothing.
#include "arrival.h"

#include <stdlib.h>

static bool keeps_stencil_on_failure(const pass_decl *pass)
{
    return pass->stencil_plane < 0 || (pass->stencil_fail == STENCIL_keep && pass->stencil_depth_fail == STENCIL_keep);
}

static bool tests_depth(const pass_decl *pass)
{
    return pass->depth_plane >= 0 && pass->depth_function != COMPARE_always && pass->depth_function != COMPARE_never;
}

// Why nothing may be discarded before it is shaded; NULL: it may.
static const char *forbidden(const kernel_decl *kernel)
{
    if (!kernel->is_pass)
        return "a free kernel decides for itself what becomes of a fragment";
    if (!tests_depth(&kernel->pass))
        return "the pass has no depth test";
    return keeps_stencil_on_failure(&kernel->pass) ? NULL : "a failed test changes the stencil";
}

static void find_tests(const kernel_decl *kernel, kernel_use *use)
{
    const pass_decl *pass = &kernel->pass;
    use->hierarchical_forbidden = use->early_forbidden = forbidden(kernel);
    if (use->early_forbidden)
        return;
    const bool discards = pass->clip_count > 0 || pass->keep || pass->keep_negated;
    const bool writes = pass->depth_write || (pass->stencil_plane >= 0 && pass->stencil_pass != STENCIL_keep);
    use->depth_plane = pass->depth_plane;
    use->depth_write = pass->depth_write;
    use->depth_function = pass->depth_function;
    if (pass->depth_function == COMPARE_notequal)
        use->hierarchical_forbidden = "no range of depths tells what is not equal";
    if (discards && writes)
        use->early_forbidden = "the shader discards fragments whose test would write already";
    use->hierarchical = !use->hierarchical_forbidden;
    use->early = !use->early_forbidden;
    use->early_directly = discards;
}

static bool writes_predicate(opcode op)
{
    return opcode_table[op].d == OPERAND_PRED;
}

// The instruction that decides: of a stage, the first that writes a predicate; of stages in a row, the last of those.
static void find_verdicts(const bound_program *bound, int k, const instruction *code, int count, kernel_use *use)
{
    bool stencil = false, depth = false;
    for (int i = 0; i < count; i++) {
        const pass_stage stage = bound_stage(bound, k, i);
        if (!writes_predicate(code[i].op))
            continue;
        if (stage == STAGE_KEEP || stage == STAGE_CLIP) {
            use->alive_at = i;
        } else if (stage == STAGE_STENCIL_TEST && !stencil) {
            use->passed_at = i;
            stencil = true;
        } else if (stage == STAGE_DEPTH_TEST && !depth) {
            use->passed_at = i;
            depth = true;
        }
    }
}

static void note_plane(uint8_t plane, bool color, bool read, kernel_use *use)
{
    int i = 0;
    while (i < use->plane_count && use->planes[i].plane != plane)
        i++;
    if (i == use->plane_count)
        use->planes[use->plane_count++] = (kernel_plane){plane, color, false};
    use->planes[i].read |= read;
}

// That of an earlier access to the plane by the unit, or a new one.
static uint8_t group_of(uint8_t plane, access_unit unit, kernel_use *use)
{
    for (int i = 0; i < use->access_count; i++)
        if (use->accesses[i].plane == plane && use->accesses[i].unit == unit)
            return use->accesses[i].group;
    return (uint8_t)use->group_count++;
}

static void find_accesses(const bound_program *bound, const instruction *code, int count, kernel_use *use)
{
    for (int i = 0; i < count; i++) {
        const opcode op = code[i].op;
        if (op != OP_ld && op != OP_st && op != OP_tex)
            continue;
        const uint8_t plane = op == OP_st ? code[i].d : code[i].a;
        const bool color = format_table[bound_plane_format(bound, plane)].class == FORMAT_CLASS_COLOR;
        const access_unit unit = op == OP_tex ? ACCESS_TEXTURE : color ? ACCESS_COLOR : ACCESS_DEPTH;
        note_plane(plane, color, op != OP_st, use);
        const kernel_access access = {plane, unit, op == OP_st, color, (uint16_t)i, group_of(plane, unit, use)};
        use->accesses[use->access_count++] = access;
        use->texture_planes += op == OP_tex;
    }
}

static void note_source(operand_kind kind, uint8_t source, format machine_depth, kernel_use *use)
{
    if (kind != OPERAND_SRC && kind != OPERAND_CSRC && kind != OPERAND_ASRC)
        return;
    use->color |= source == SOURCE_FRAGMENT_COLOR || source == SOURCE_FRAGMENT_PREMUL;
    use->primitive |= source == SOURCE_PRIMITIVE;
    if (source >= SOURCE_DEPTH && source < SOURCE_CONSTANT)
        use->depth_formats |= 1u << (source == SOURCE_DEPTH ? (int)machine_depth : source - SOURCE_DEPTH_FORMAT);
}

static void find_sources(const instruction *code, int count, format machine_depth, kernel_use *use)
{
    for (int i = 0; i < count; i++) {
        note_source(opcode_table[code[i].op].a, code[i].a, machine_depth, use);
        note_source(opcode_table[code[i].op].b, code[i].b, machine_depth, use);
    }
}

// Operations of the fragment shader: its own, what the pass adds, and the shading of the colour that the trace holds.
static uint32_t shader_operations(const bound_program *bound, int k, const instruction *code, int count, bool is_pass,
                                  const kernel_use *use, const machine *machine)
{
    uint32_t operations = use->color ? (uint32_t)machine->shader_operations_per_fragment : 0;
    for (int i = 0; is_pass && i < count; i++) {
        const pass_stage stage = bound_stage(bound, k, i);
        operations += stage == STAGE_SHADER || stage == STAGE_KEEP || stage == STAGE_CLIP ? (uint32_t)opcode_table[code[i].op].cycles : 0;
    }
    return operations;
}

status kernel_use_find(const program *program, const bound_program *bound, const machine *machine, const report *report,
                       kernel_use uses[KERNEL_MAX])
{
    for (int k = 0; k < program->kernel_count; k++) {
        const kernel_decl *kernel = &program->kernels[k];
        kernel_use *use = &uses[k];
        int count;
        const instruction *code = bound_instructions(bound, k, &count);
        *use = (kernel_use){.alive_at = -1, .passed_at = -1, .depth_plane = -1, .free_kernel = !kernel->is_pass};
        use->accesses = malloc(((size_t)count + 1) * sizeof *use->accesses);
        if (!use->accesses)
            return report_error(report, STATUS_IO, "out of memory: kernels");
        find_accesses(bound, code, count, use);
        if (kernel->is_pass)
            find_verdicts(bound, k, code, count, use);
        find_tests(kernel, use);
        if (use->depth_plane >= 0) {
            const uint8_t plane = (uint8_t)use->depth_plane;
            use->accesses[use->access_count] = (kernel_access){plane, ACCESS_DEPTH, false, false, 0, group_of(plane, ACCESS_DEPTH, use)};
        }
        find_sources(code, count, machine->depth_format, use);
        use->shader_operations = shader_operations(bound, k, code, count, kernel->is_pass, use, machine);
    }
    return STATUS_OK;
}
