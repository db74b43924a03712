// A program in, its canonical text out: declarations, kernels, passes, schedule, in that order, one layout.
#include "isa.h"

#include <string.h>

typedef struct printer {
    const program *program;
    const bound_program *bound;  // NULL: passes as declared
    FILE *out;
} printer;

// The shortest decimal that reads back as the same float, always with a '.' or an exponent.
static void print_float(FILE *out, float value)
{
    char text[40];
    for (int digits = 1; digits <= 9; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, (double)value);
        float back = 0;
        if (sscanf(text, "%f", &back) == 1 && back == value)
            break;
    }
    fprintf(out, "%s%s", text, strpbrk(text, ".e") ? "" : ".0");
}

static void print_value(const printer *p, const value *value)
{
    float number;
    switch (value->kind) {
    case VALUE_UINT: fprintf(p->out, "%u", value->bits); break;
    case VALUE_FLOAT:
        memcpy(&number, &value->bits, sizeof number);
        print_float(p->out, number);
        break;
    case VALUE_NEAR: fputs("near", p->out); break;
    case VALUE_FAR:
        fputs("far", p->out);
        if (value->format >= 0)
            fprintf(p->out, ".%s", format_table[value->format].name);
        break;
    case VALUE_STENCIL_MAX: fputs("stencil_max", p->out); break;
    case VALUE_BACKGROUND: fputs("background", p->out); break;
    case VALUE_BATCH_NEAR: fputs("batch_near", p->out); break;
    case VALUE_BATCH_FAR: fputs("batch_far", p->out); break;
    case VALUE_RGBA:
        for (int i = 0; i < 4; i++) {
            if (i)
                fputc(' ', p->out);
            print_float(p->out, value->rgba[i]);
        }
        break;
    }
}

static void print_source(const printer *p, uint8_t source)
{
    if (source >= SOURCE_CONSTANT + p->program->constant_count)  // added by lowering
        fprintf(p->out, "%u", bound_constant(p->bound, source - SOURCE_CONSTANT));
    else if (source >= SOURCE_CONSTANT)
        print_value(p, &p->program->constants[source - SOURCE_CONSTANT]);
    else if (source >= SOURCE_DEPTH_FORMAT)
        fprintf(p->out, "z.%s", format_table[source - SOURCE_DEPTH_FORMAT].name);
    else if (source == SOURCE_DEPTH)
        fputc('z', p->out);
    else if (source == SOURCE_PRIMITIVE)
        fputs("primitive", p->out);
    else if (source >= SOURCE_FRAGMENT_COLOR)
        fputs(source == SOURCE_FRAGMENT_COLOR ? "color" : "premul", p->out);
    else if (source >= SOURCE_COLOR)
        fprintf(p->out, "c%d", source - SOURCE_COLOR);
    else
        fprintf(p->out, "r%d", source);
}

static void print_operand(const printer *p, operand_kind kind, uint8_t field, int word)
{
    switch (kind) {
    case OPERAND_NONE: break;
    case OPERAND_REG:
    case OPERAND_COLOR:
    case OPERAND_ANY:
    case OPERAND_SRC:
    case OPERAND_CSRC:
    case OPERAND_ASRC: print_source(p, field); break;
    case OPERAND_PRED: fprintf(p->out, "%sp%d", field & 8 ? "!" : "", field & 7); break;
    case OPERAND_PLANE: fputs(p->program->planes[field].name, p->out); break;
    case OPERAND_QUERY: fputs(p->program->queries[field].name, p->out); break;
    case OPERAND_BLEND: fputs(p->program->blends[field].name, p->out); break;
    case OPERAND_COMP: fputc("rgba"[field & 3], p -> out); break;
    case OPERAND_FORMAT: fputs(format_table[field].name, p->out); break;
    case OPERAND_LABEL: fprintf(p->out, "L%d", word + field); break;
    }
}

static void print_instruction(const printer *p, instruction i, int word)
{
    if (i.guard)
        fprintf(p->out, "    @%sp%d", i.guard_negated ? "!" : "", i.guard);
    fprintf(p->out, "%*s%-5s", i.guard ? (i.guard_negated ? 3 : 4) : 11, "", opcode_table[i.op].name);
    const opcode_row *row = &opcode_table[i.op];
    const operand_kind kinds[] = {row->d, row->a, row->b, row->c};
    const uint8_t fields[] = {i.d, i.a, i.b, i.c};
    const char *separator = " ";
    for (int k = 0; k < 4; k++) {
        if (kinds[k] == OPERAND_NONE)
            continue;
        fputs(separator, p->out);
        separator = ", ";
        print_operand(p, kinds[k], fields[k], word);
    }
    fputc('\n', p->out);
}

static void print_instructions(const printer *p, const kernel_decl *kernel, const instruction *code, int count)
{
    bool label[WORD_MAX + 1] = {false};
    for (int w = 0; w < count; w++)
        if (code[w].op == OP_skip && w + code[w].b <= WORD_MAX)
            label[w + code[w].b] = true;
    fprintf(p->out, "\n%s %s%s\n", kernel->is_shader ? "shader" : "kernel", kernel->name, kernel->fullscreen ? " fullscreen" : "");
    for (int w = 0; w <= count; w++) {
        if (label[w])
            fprintf(p->out, "  L%d:\n", w);
        if (w < count)
            print_instruction(p, code[w], w);
    }
    fputs("end\n", p->out);
}

static void print_kernel(const printer *p, const kernel_decl *kernel)
{
    instruction code[WORD_MAX];
    int count = 0;
    while (count < kernel->word_count && word_decode(kernel->words[count], &code[count]))
        count++;
    print_instructions(p, kernel, code, count);
}

static void print_clip(const printer *p, const clip_decl *clip)
{
    static const char *const names[] = {"<", "<=", "=", ">=", ">"};
    fprintf(p->out, "    clip z %s ", names[clip->function]);
    if (clip->plane_count > 1)
        fputs("min(", p->out);
    for (int i = 0; i < clip->plane_count; i++)
        fprintf(p->out, "%s%s", i ? ", " : "", p->program->planes[clip->plane[i]].name);
    fputs(clip->plane_count > 1 ? ")\n" : "\n", p->out);
}

static void print_pass(const printer *p, const kernel_decl *kernel)
{
    const pass_decl *pass = &kernel->pass;
    const program *program = p->program;
    fprintf(p->out, "\npass %s%s\n", kernel->name, kernel->fullscreen ? " fullscreen" : "");
    if (pass->shader >= 0) {
        fprintf(p->out, "    shader %s", program->kernels[pass->shader].name);
        if (pass->keep || pass->keep_negated)
            fprintf(p->out, " keep %sp%d", pass->keep_negated ? "!" : "", pass->keep);
        fputc('\n', p->out);
    }
    for (int i = 0; i < pass->clip_count; i++)
        print_clip(p, &pass->clips[i]);
    if (pass->stencil_plane >= 0) {
        fprintf(p->out, "    stencil %s %s %d %d %s %s %s", program->planes[pass->stencil_plane].name,
                compare_function_names[pass->stencil_function], pass->stencil_reference, pass->stencil_mask,
                stencil_operation_names[pass->stencil_fail], stencil_operation_names[pass->stencil_depth_fail],
                stencil_operation_names[pass->stencil_pass]);
        if (pass->stencil_write_mask != 255)
            fprintf(p->out, " write %d", pass->stencil_write_mask);
        fputc('\n', p->out);
    }
    if (pass->depth_plane >= 0)
        fprintf(p->out, "    depth %s %s%s\n", compare_function_names[pass->depth_function],
                program->planes[pass->depth_plane].name, pass->depth_write ? "" : " read_only");
    for (int i = 0; i < pass->target_count; i++) {
        fprintf(p->out, "    target %s %s ", program->planes[pass->targets[i].plane].name,
                pass->targets[i].blend < 0 ? "replace" : program->blends[pass->targets[i].blend].name);
        print_source(p, (uint8_t)pass->targets[i].source);
        fputc('\n', p->out);
    }
    if (pass->query >= 0)
        fprintf(p->out, "    count %s\n", program->queries[pass->query].name);
    fputs("end\n", p->out);
}

static const char *class_name(uint8_t classes)
{
    return classes == DRAW_OPAQUE        ? "opaque"
           : classes == DRAW_TRANSPARENT ? "transparent"
           : classes == DRAW_UNSORTED    ? "unsorted"
           : classes == DRAW_BATCH       ? "batch"
                                         : "sorted";
}

static void print_step(const printer *p, const step *step, int indent)
{
    const program *program = p->program;
    fprintf(p->out, "%*s", 4 * indent, "");
    switch (step->kind) {
    case STEP_CLEAR:
        fprintf(p->out, "clear %s ", program->planes[step->plane].name);
        print_value(p, &step->value);
        break;
    case STEP_COPY:
    case STEP_SWAP:
        fprintf(p->out, "%s %s %s", step->kind == STEP_COPY ? "copy" : "swap", program->planes[step->plane].name,
                program->planes[step->source].name);
        break;
    case STEP_DRAW:
        fprintf(p->out, "draw %s with %s", class_name(step->classes), program->kernels[step->kernel].name);
        break;
    case STEP_FULLSCREEN: fprintf(p->out, "fullscreen %s", program->kernels[step->kernel].name); break;
    case STEP_RESET: fprintf(p->out, "reset %s", program->queries[step->query].name); break;
    case STEP_IF: fprintf(p->out, "if %s", program->queries[step->query].name); break;
    case STEP_REPEAT: fputs("repeat", p->out); break;
    case STEP_WHILE: fprintf(p->out, "while %s", program->queries[step->query].name); break;
    case STEP_LIST:
        fprintf(p->out, "list %s before %s entries %u into %s with %s", class_name(step->classes),
                program->planes[step->source].name, step->entries, program->planes[step->plane].name,
                program->blends[step->kernel].name);
        break;
    case STEP_BATCHES: fprintf(p->out, "batches %u", step->entries); break;
    case STEP_END_BATCHES:
    case STEP_END: fputs("end", p->out); break;
    }
    fputc('\n', p->out);
}

static void print_schedule(const printer *p)
{
    fputs("\nschedule\n", p->out);
    int indent = 1;
    for (int i = 0; i < p->program->step_count; i++) {
        const step *step = &p->program->steps[i];
        if (step->kind == STEP_WHILE || step->kind == STEP_END || step->kind == STEP_END_BATCHES)
            indent--;
        print_step(p, step, indent);
        if (step->kind == STEP_REPEAT || step->kind == STEP_IF || step->kind == STEP_BATCHES)
            indent++;
    }
    fputs("end\n", p->out);
}

static void print_declarations(const printer *p)
{
    static const char *const kinds[] = {"depth", "rgba", "stencil"};
    const program *program = p->program;
    fprintf(p->out, "program %s\n\n", program->name);
    for (int i = 0; i < program->plane_count; i++)
        fprintf(p->out, "plane %s %s\n", program->planes[i].name,
                program->planes[i].kind == PLANE_FORMAT ? format_table[program->planes[i].format].name
                                                        : kinds[program->planes[i].kind]);
    for (int i = 0; i < program->query_count; i++)
        fprintf(p->out, "query %s\n", program->queries[i].name);
    for (int i = 0; i < program->blend_count; i++) {
        const blend_decl *b = &program->blends[i];
        fprintf(p->out, "blend %s rgb %s %s %s alpha %s %s %s%s\n", b->name, blend_equation_names[b->rgb.equation],
                blend_factor_names[b->rgb.source], blend_factor_names[b->rgb.destination],
                blend_equation_names[b->alpha.equation], blend_factor_names[b->alpha.source],
                blend_factor_names[b->alpha.destination], b->composites ? " composites" : "");
    }
    if (program->max_iterations)
        fprintf(p->out, "limit iterations %llu\n", (unsigned long long)program->max_iterations);
    if (program->occlusion_ratio > 0) {
        fputs("limit occlusion_ratio ", p->out);
        print_float(p->out, (float)program->occlusion_ratio);
        fputc('\n', p->out);
    }
    fputs("output ", p->out);
    if (program->output_front >= 0)
        fprintf(p->out, "%s over ", program->planes[program->output_front].name);
    fprintf(p->out, "%s\n", program->planes[program->output_base].name);
}

status disassemble_bound(const program *program, const bound_program *bound, FILE *out)
{
    const printer p = {program, bound, out};
    print_declarations(&p);
    for (int i = 0; i < program->kernel_count; i++) {
        const kernel_decl *kernel = &program->kernels[i];
        int count = 0;
        const instruction *lowered = bound && kernel->is_pass ? bound_instructions(bound, i, &count) : NULL;
        if (lowered)
            print_instructions(&p, kernel, lowered, count);
        else if (kernel->is_pass)
            print_pass(&p, kernel);
        else
            print_kernel(&p, kernel);
    }
    print_schedule(&p);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

status disassemble_text(const program *program, FILE *out)
{
    return disassemble_bound(program, NULL, out);
}
