// A program and a machine's limits in; every reason why the program cannot run there out, with its line.
#include "isa.h"

#include <stdarg.h>

typedef struct verifier {
    const program *program;
    const char *file;
    const rop_limits *limits;
    const report *report;
    int problems;
} verifier;

#define PROBLEM(v, line, ...) ((v)->problems++, report_problem(v, line, __VA_ARGS__))

PRINTF_LIKE(3, 4)
static void report_problem(const verifier *v, int line, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    report_error(v->report, STATUS_REFUSED, "%s:%d: %s (machine %s)", v->file, line, text, v->limits->machine);
}

format plane_format(const plane_decl *plane, const rop_limits *limits)
{
    switch (plane->kind) {
    case PLANE_DEPTH: return limits->depth_format;
    case PLANE_RGBA: return limits->color_format;
    case PLANE_STENCIL: return FORMAT_u8;
    case PLANE_FORMAT: break;
    }
    return plane->format;
}

int plane_bits(const plane_decl *plane, const rop_limits *limits)
{
    return plane->kind == PLANE_STENCIL ? limits->stencil_bits : format_table[plane_format(plane, limits)].bits;
}

static void verify_planes(verifier *v)
{
    int bits = 0;
    for (int i = 0; i < v->program->plane_count; i++) {
        const plane_decl *plane = &v->program->planes[i];
        const format format = plane_format(plane, v->limits);
        if (!(v->limits->formats >> format & 1))
            PROBLEM(v, plane->line, "plane '%s' has format %s, which the machine lacks", plane->name, format_table[format].name);
        if (i == v->limits->planes_max)
            PROBLEM(v, plane->line, "plane '%s' is one too many: the program has %d planes, the machine takes %d",
                    plane->name, v->program->plane_count, v->limits->planes_max);
        const int before = bits;
        bits += plane_bits(plane, v->limits);
        if (bits > v->limits->bits_per_sample_max && before <= v->limits->bits_per_sample_max)
            PROBLEM(v, plane->line, "with plane '%s' a sample takes %d bits, the machine has %d", plane->name, bits,
                    v->limits->bits_per_sample_max);
    }
}

static void verify_pass(verifier *v, const kernel_decl *kernel)
{
    if (kernel->pass.target_count > v->limits->color_targets_max)
        PROBLEM(v, kernel->line, "pass '%s' writes %d colour targets, the machine has %d", kernel->name,
                kernel->pass.target_count, v->limits->color_targets_max);
    if (kernel->pass.stencil_plane >= 0) {
        const int largest = (1 << v->limits->stencil_bits) - 1;
        if (kernel->pass.stencil_reference > largest)
            PROBLEM(v, kernel->line, "pass '%s' has stencil reference %d, but %d bits hold at most %d", kernel->name,
                    kernel->pass.stencil_reference, v->limits->stencil_bits, largest);
    }
}

static void verify_kernel(verifier *v, const kernel_decl *kernel)
{
    if (v->limits->fixed_function) {
        PROBLEM(v, kernel->line, "'%s' is a kernel; the machine has no programmable ROP and runs declared passes only", kernel->name);
        return;
    }
    if (kernel->word_count > v->limits->instructions_max)
        PROBLEM(v, kernel->line, "kernel '%s' has %d instructions, the machine's memory holds %d", kernel->name,
                kernel->word_count, v->limits->instructions_max);
    for (int i = 0; i < kernel->word_count; i++) {
        instruction instruction;
        if (word_decode(kernel->words[i], &instruction) && !(v->limits->opcodes >> instruction.op & 1))
            PROBLEM(v, kernel->word_lines[i], "opcode %s, which the machine lacks", opcode_table[instruction.op].name);
    }
}

status verify_program(const program *program, const char *file, const rop_limits *limits, const report *report)
{
    verifier v = {program, file, limits, report, 0};
    verify_planes(&v);
    for (int i = 0; i < program->kernel_count; i++) {
        if (program->kernels[i].is_shader)
            continue;  // runs on the shader cores, not in the ROP
        if (program->kernels[i].is_pass)
            verify_pass(&v, &program->kernels[i]);
        else
            verify_kernel(&v, &program->kernels[i]);
    }
    for (int i = 0; i < program->step_count; i++) {
        const step *step = &program->steps[i];
        if (step->kind == STEP_LIST && step->entries > (uint32_t)limits->list_entries_max)
            PROBLEM(&v, step->line, "a list of %u fragments a sample; the machine keeps %s%d", step->entries,
                    limits->list_entries_max ? "at most " : "no lists: ", limits->list_entries_max);
    }
    return v.problems ? STATUS_REFUSED : STATUS_OK;
}
