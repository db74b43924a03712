// Random program texts, right by the language's rules and without sense otherwise: what is in opcodes.def,
// states.def and the schedule's grammar comes up by chance.
#include "random_input.h"

#include <stdarg.h>
#include <stdio.h>

typedef struct plane_name {
    char name[8];
    const char *kind;
} plane_name;

typedef struct author {
    dice *dice;
    program_text *out;
    bool fixed_function;
    plane_name depth[4], stencil[2], color[4], other[3];
    uint32_t depth_count, stencil_count, color_count, other_count;
    uint32_t query_count, blend_count, kernel_count, pass_count, screen_count;
    bool fullscreen;  // the kernel being written has no fragment
    bool shader;      // it is a shader
    uint32_t labels;  // of the kernel so far
    uint32_t steps;
} author;

PRINTF_LIKE(2, 3)
static void put(author *a, const char *format, ...)
{
    program_text *out = a->out;
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(out->text + out->size, sizeof out->text - out->size, format, arguments);
    va_end(arguments);
    out->size += (size_t)length;
}

static uint32_t below(author *a, uint32_t count)
{
    return dice_below(a->dice, count);
}

static bool chance(author *a, uint32_t percent)
{
    return dice_chance(a->dice, percent);
}

// ---- Declarations --------------------------------------------------------------------------------------

static void declare(author *a, plane_name *planes, uint32_t *count, uint32_t wanted, char letter,
                    const char *const *kinds, uint32_t kind_count)
{
    for (*count = 0; *count < wanted; ++*count) {
        plane_name *plane = &planes[*count];
        snprintf(plane->name, sizeof plane->name, "%c%u", letter, *count % 10);
        plane->kind = kinds[chance(a, 60) ? 0 : below(a, kind_count)];
        put(a, "plane %s %s\n", plane->name, plane->kind);
    }
}

static void declare_planes(author *a)
{
    static const char *const depths[] = {"depth", "z16", "z24", "z32f"}, *const colors[] = {"rgba", "rgba8", "rgba16f",
                                                                                            "rgba32f"};
    static const char *const stencils[] = {"stencil"}, *const others[] = {"u32", "u8", "f32"};
    declare(a, a->depth, &a->depth_count, 2 + below(a, 3), 'd', depths, 4);
    declare(a, a->stencil, &a->stencil_count, 1 + below(a, 2), 's', stencils, 1);
    declare(a, a->color, &a->color_count, 1 + below(a, 3), 'k', colors, 4);
    declare(a, a->other, &a->other_count, below(a, 4), 'u', others, a->fixed_function ? 2 : 3);
}

static void declare_blends(author *a)
{
    a->blend_count = 1 + below(a, 4);
    for (uint32_t i = 0; i < a->blend_count; i++) {
        put(a, "blend b%u", i);
        for (int part = 0; part < 2; part++)
            put(a, " %s %s %s %s", part ? "alpha" : "rgb", blend_equation_names[below(a, BLEND_EQUATION_COUNT)],
                blend_factor_names[below(a, BLEND_FACTOR_COUNT)], blend_factor_names[below(a, BLEND_FACTOR_COUNT)]);
        put(a, "%s\n", chance(a, 50) ? " composites" : "");
    }
}

// ---- Passes --------------------------------------------------------------------------------------------

static void write_clip(author *a)
{
    static const char *const functions[] = {"<", "<=", "=", ">=", ">"};
    const plane_name *first = &a->depth[below(a, a->depth_count)];
    put(a, "    clip z %s ", functions[below(a, 5)]);
    if (chance(a, 60)) {
        put(a, "%s\n", first->name);
        return;
    }
    put(a, "min(%s", first->name);
    for (uint32_t i = 0; i < a->depth_count; i++)  // planes of one kind compare
        if (&a->depth[i] != first && a->depth[i].kind == first->kind && chance(a, 60))
            put(a, ", %s", a->depth[i].name);
    put(a, ")\n");
}

static void write_stencil(author *a)
{
    put(a, "    stencil %s %s %u %u", a->stencil[below(a, a->stencil_count)].name,
        compare_function_names[below(a, COMPARE_FUNCTION_COUNT)], chance(a, 80) ? below(a, 2) : below(a, 16),
        chance(a, 50) ? 255 : below(a, 256));
    for (int i = 0; i < 3; i++)
        put(a, " %s", stencil_operation_names[below(a, STENCIL_OPERATION_COUNT)]);
    if (chance(a, 30))
        put(a, " write %u", below(a, 256));
    put(a, "\n");
}

static void write_targets(author *a, bool shaded, bool fragment)
{
    for (uint32_t targets = below(a, 3); targets > 0; targets--) {
        put(a, "    target %s ", a->color[below(a, a->color_count)].name);
        if (chance(a, 70))
            put(a, "b%u", below(a, a->blend_count));
        else
            put(a, "replace");
        if (shaded && (!fragment || chance(a, 60)))
            put(a, " c%u\n", below(a, 4));
        else
            put(a, " %s\n", chance(a, 50) ? "premul" : "color");
    }
}

static bool write_shading(author *a, const char *shader, uint32_t percent)
{
    if (!chance(a, percent))
        return false;
    put(a, "    shader %s", shader);
    if (chance(a, 70))
        put(a, " keep %sp%u", chance(a, 50) ? "!" : "", 1 + below(a, 3));
    put(a, "\n");
    return true;
}

// A full-screen pass has no depth, no clip, no fragment's colour.
static void write_screen_pass(author *a)
{
    put(a, "\npass screen%u fullscreen\n", a->screen_count++);
    write_shading(a, "screen_shader", 100);
    if (chance(a, 50))
        write_stencil(a);
    write_targets(a, true, false);
    if (chance(a, 50))
        put(a, "    count q%u\n", below(a, a->query_count));
    put(a, "end\n");
}

static void write_pass(author *a)
{
    put(a, "\npass pass%u\n", a->pass_count++);
    const bool shaded = write_shading(a, "shader0", 40);
    for (uint32_t clips = chance(a, 50) ? 0 : 1 + below(a, 2); clips > 0; clips--)
        write_clip(a);
    if (chance(a, 75))
        put(a, "    depth %s %s%s\n", compare_function_names[below(a, COMPARE_FUNCTION_COUNT)],
            a->depth[below(a, a->depth_count)].name, chance(a, 20) ? " read_only" : "");
    if (chance(a, 60))
        write_stencil(a);
    write_targets(a, shaded, true);
    if (chance(a, 60))
        put(a, "    count q%u\n", below(a, a->query_count));
    put(a, "end\n");
}

// ---- Kernels -------------------------------------------------------------------------------------------

// Few registers, so that they meet; few constants, since a program has at most 32.
static void write_scalar(author *a)
{
    static const char *const constants[] = {"0",          "1",    "2",    "255",     "4294967295",  "8388609",
                                            "2143289344", "near", "far",  "far.z16", "stencil_max", "0.0",
                                            "1.0",        "0.5",  "-1.5", "3.0",     "1e30"};
    static const char *const inputs[] = {"z", "z.z16", "z.z24", "z.z32f", "primitive", "z"};
    if (chance(a, 60))
        put(a, "r%u", chance(a, 90) ? below(a, 5) : below(a, REGISTER_COUNT));
    else if (!a->fullscreen && chance(a, 50))
        put(a, "%s", inputs[below(a, 6)]);
    else
        put(a, "%s", constants[below(a, sizeof constants / sizeof *constants)]);
}

static void write_color(author *a)
{
    if (a->fullscreen || chance(a, 60))
        put(a, "c%u", below(a, 3));
    else
        put(a, "%s", chance(a, 50) ? "color" : "premul");
}

static void write_predicate(author *a, bool source)
{
    if (source && chance(a, 30))
        put(a, "!");
    put(a, "p%u", source && chance(a, 5) ? 0 : 1 + below(a, chance(a, 90) ? 3 : 7));
}

static const plane_name *any_plane(author *a, bool *color)
{
    *color = chance(a, 35);
    if (*color)
        return &a->color[below(a, a->color_count)];
    const uint32_t which = below(a, a->depth_count + a->stencil_count + a->other_count);
    if (which < a->depth_count)
        return &a->depth[which];
    return which < a->depth_count + a->stencil_count ? &a->stencil[which - a->depth_count]
                                                     : &a->other[which - a->depth_count - a->stencil_count];
}

static void write_operand(author *a, operand_kind kind, bool color, const plane_name *plane)
{
    static const char *const depth_formats[] = {"z16", "z24", "z32f"}, *const components[] = {"r", "g", "b", "a"};
    switch (kind) {
    case OPERAND_NONE: return;
    case OPERAND_REG: put(a, "r%u", below(a, 5)); return;
    case OPERAND_COLOR: put(a, "c%u", below(a, 3)); return;
    case OPERAND_ANY: put(a, "%c%u", color ? 'c' : 'r', below(a, color ? 3 : 5)); return;
    case OPERAND_PRED: write_predicate(a, true); return;
    case OPERAND_SRC: write_scalar(a); return;
    case OPERAND_CSRC: write_color(a); return;
    case OPERAND_ASRC: (color ? write_color : write_scalar)(a); return;
    case OPERAND_PLANE: put(a, "%s", plane->name); return;
    case OPERAND_QUERY: put(a, "q%u", below(a, a->query_count)); return;
    case OPERAND_BLEND: put(a, "b%u", below(a, a->blend_count)); return;
    case OPERAND_COMP: put(a, "%s", components[below(a, 4)]); return;
    case OPERAND_FORMAT: put(a, "%s", depth_formats[below(a, 3)]); return;
    case OPERAND_LABEL: put(a, "label%u", a->labels); return;
    }
}

static void write_instruction(author *a, opcode op)
{
    const opcode_row *row = &opcode_table[op];
    bool color;
    const plane_name *plane = any_plane(a, &color);
    put(a, "    ");
    if (chance(a, 40)) {
        put(a, chance(a, 70) ? "@" : "@!");
        write_predicate(a, false);
    }
    put(a, " %s ", row->name);
    if (row->d == OPERAND_PRED)
        write_predicate(a, false);
    else
        write_operand(a, row->d, color, plane);
    bool first = row->d == OPERAND_NONE;
    const operand_kind kinds[] = {row->a, row->b, row->c};
    for (int i = 0; i < 3; i++) {
        if (kinds[i] == OPERAND_NONE)
            continue;
        put(a, first ? "" : ", ");
        first = false;
        write_operand(a, kinds[i], color, plane);
    }
    put(a, "\n");
}

static void write_kernel(author *a, const char *what, const char *name, bool fullscreen)
{
    put(a, "\n%s %s%s\n", what, name, fullscreen ? " fullscreen" : "");
    a->fullscreen = fullscreen;
    a->shader = what[0] == 's';
    a->labels = 0;
    const bool skips = chance(a, 50);
    uint32_t label_in = 0;  // instructions until the pending label; 0: none is pending
    for (uint32_t left = 1 + below(a, chance(a, 50) ? 12 : 55); left > 0; left--) {
        opcode op = (opcode)below(a, OPCODE_COUNT);
        if (op == OP_skip && (!skips || label_in))
            op = OP_tex;
        if (a->shader && (op == OP_ld || op == OP_st || op == OP_blend || op == OP_count))
            op = OP_tex;
        write_instruction(a, op);
        if (op == OP_skip)
            label_in = 1 + below(a, 6);
        else if (label_in && --label_in == 0)
            put(a, "  label%u:\n", a->labels++);
    }
    if (label_in)
        put(a, "  label%u:\n", a->labels++);
    put(a, "end\n");
}

// ---- Schedule ------------------------------------------------------------------------------------------

static void write_clear(author *a)
{
    static const char *const depths[] = {"near", "far", "far", "77"}, *const others[] = {"0", "3", "stencil_max", "0.5",
                                                                                         "far.z24"};
    const uint32_t which = below(a, 4);
    if (which < 2)
        put(a, "clear %s %s\n", a->depth[below(a, a->depth_count)].name, depths[below(a, 4)]);
    else if (which == 2)
        put(a, "clear %s %s\n", a->stencil[below(a, a->stencil_count)].name, others[below(a, 5)]);
    else if (a->other_count && chance(a, 40))
        put(a, "clear %s %s\n", a->other[below(a, a->other_count)].name, others[below(a, 5)]);
    else
        put(a, "clear %s %s\n", a->color[below(a, a->color_count)].name,
            chance(a, 30)   ? "background"
            : chance(a, 50) ? "0 0 0 1"
                            : "0.3 0.7 1.5 0.2");
}

// Two planes of one kind; they may be the same.
static void write_transfer(author *a, const char *what)
{
    const plane_name *planes = chance(a, 70) ? a->depth : a->color;
    const uint32_t count = planes == a->depth ? a->depth_count : a->color_count, first = below(a, count);
    uint32_t second = below(a, count);
    while (planes[second].kind != planes[first].kind)
        second = (second + 1) % count;
    put(a, "%s %s %s\n", what, planes[first].name, planes[second].name);
}

static void write_draw(author *a)
{
    static const char *const classes[] = {"opaque", "transparent", "transparent", "unsorted", "sorted"};
    put(a, "draw %s with ", classes[below(a, 5)]);
    if (a->kernel_count && chance(a, 50))
        put(a, "kernel%u\n", below(a, a->kernel_count));
    else
        put(a, "pass%u\n", below(a, a->pass_count));
}

static void write_steps(author *a, int depth)
{
    for (uint32_t left = 1 + below(a, 6); left > 0 && a->steps < 40; left--) {
        a->steps++;
        const uint32_t which = below(a, 20);
        if (which < 4)
            write_clear(a);
        else if (which < 6)
            write_transfer(a, which == 4 ? "copy" : "swap");
        else if (which < 12)
            write_draw(a);
        else if (which < 13 && !a->fixed_function && chance(a, 50))
            put(a, "fullscreen whole\n");
        else if (which < 13)
            put(a, "fullscreen screen%u\n", below(a, a->screen_count));
        else if (which < 16)
            put(a, "reset q%u\n", below(a, a->query_count));
        else if (depth < 3) {
            const bool loop = chance(a, 60);
            put(a, loop ? "repeat\n" : "if q%u\n", below(a, a->query_count));
            write_steps(a, depth + 1);
            put(a, loop ? "while q%u\n" : "end\n", below(a, a->query_count));
        }
    }
}

void random_program(dice *dice, bool fixed_function, program_text *text)
{
    author author = {.dice = dice, .out = text, .fixed_function = fixed_function}, *a = &author;
    text->size = 0;
    put(a, "program random\n\n");
    declare_planes(a);
    a->query_count = 1 + below(a, 3);
    for (uint32_t q = 0; q < a->query_count; q++)
        put(a, "query q%u\n", q);
    declare_blends(a);
    put(a, "limit iterations %u\n", 1 + below(a, 5));
    if (chance(a, 20))
        put(a, "limit occlusion_ratio 0.1\n");
    put(a, chance(a, 50) ? "output k0\n" : "output k0 over k%u\n", below(a, a->color_count));
    write_kernel(a, "shader", "shader0", false);
    write_kernel(a, "shader", "screen_shader", true);
    for (uint32_t passes = 1 + below(a, 3); passes > 0; passes--)
        write_pass(a);
    write_screen_pass(a);
    if (!fixed_function) {
        for (uint32_t kernels = 1 + below(a, 2); kernels > 0; kernels--) {
            char name[16];
            snprintf(name, sizeof name, "kernel%u", a->kernel_count++);
            write_kernel(a, "kernel", name, false);
        }
        write_kernel(a, "kernel", "whole", true);
    }
    put(a, "\nschedule\n");
    for (int i = 0; i < 4; i++)
        write_clear(a);
    while (a->steps < 8)
        write_steps(a, 0);
    put(a, "end\n");
}
