// A fixed-function pass's lines in, its state out. Order of the lines is free; the hardware's order is fixed:
// the shader, range clip, stencil test, depth test, stencil update, depth write, blend, count.
//
//   shader NAME [keep p1|!p1]  runs before all else; without `keep` no fragment is discarded
//   clip z > PLANE             or < <= = >=, or min(PLANE, PLANE...); every clip line must hold
//   depth FUNCTION PLANE [read_only]
//   stencil PLANE FUNCTION REFERENCE MASK FAIL DEPTH_FAIL PASS [write MASK]
//   target PLANE BLEND|replace color|premul|c0..c6     c0..c6: as the shader left them
//   count QUERY
//   end
#include "assemble.h"

#include <string.h>

static bool plane_is(assembler *assembler, int plane, format_class class, const char *what, token at)
{
    const plane_decl *decl = &assembler->program->planes[plane];
    const format_class found = decl->kind == PLANE_DEPTH     ? FORMAT_CLASS_DEPTH
                               : decl->kind == PLANE_RGBA    ? FORMAT_CLASS_COLOR
                               : decl->kind == PLANE_STENCIL ? FORMAT_CLASS_UINT
                                                             : format_table[decl->format].class;
    if (found == class)
        return true;
    return lex_error(&assembler->lex, at, "'%s' is not %s", decl->name, what);
}

static bool read_bound_plane(assembler *assembler, clip_decl *clip)
{
    int plane;
    const token at = lex_peek(&assembler->lex);
    if (clip->plane_count == CLIP_MAX)
        return lex_error(&assembler->lex, at, "min takes at most %d planes", CLIP_MAX);
    if (!assemble_plane(assembler, &plane) || !plane_is(assembler, plane, FORMAT_CLASS_DEPTH, "a depth plane", at))
        return false;
    const plane_decl *planes = assembler->program->planes;
    if (clip->plane_count > 0 && !planes_match(&planes[plane], &planes[clip->plane[0]]))
        return lex_error(&assembler->lex, at, "planes '%s' and '%s' differ in format; min compares codes",
                         planes[clip->plane[0]].name, planes[plane].name);
    clip->plane[clip->plane_count++] = (uint8_t)plane;
    return true;
}

static bool read_clip(assembler *assembler, pass_decl *pass)
{
    static const char *const names[] = {"<", "<=", "=", ">=", ">"};
    lexer *lex = &assembler->lex;
    if (pass->clip_count == CLIP_MAX)
        return lex_error(lex, lex_peek(lex), "too many clips; at most %d in a pass", CLIP_MAX);
    clip_decl *clip = &pass->clips[pass->clip_count++];
    int function;
    if (!lex_expect(lex, "z") || !lex_lookup(lex, "comparison", names, 5, &function))
        return false;
    clip->function = (bound_function)function;
    clip->line = lex->line;
    if (!lex_accept(lex, "min"))
        return read_bound_plane(assembler, clip);
    if (!lex_expect(lex, "("))
        return false;
    do {
        if (!read_bound_plane(assembler, clip))
            return false;
    } while (lex_accept(lex, ","));
    return lex_expect(lex, ")");
}

static bool read_depth(assembler *assembler, pass_decl *pass)
{
    lexer *lex = &assembler->lex;
    int function;
    if (!lex_lookup(lex, "compare function", compare_function_names, COMPARE_FUNCTION_COUNT, &function))
        return false;
    const token at = lex_peek(lex);
    if (pass->depth_plane >= 0)
        return lex_error(lex, at, "a pass has one depth plane");
    if (!assemble_plane(assembler, &pass->depth_plane) ||
        !plane_is(assembler, pass->depth_plane, FORMAT_CLASS_DEPTH, "a depth plane", at))
        return false;
    pass->depth_function = (compare_function)function;
    pass->depth_write = !lex_accept(lex, "read_only");
    return true;
}

static bool read_byte(lexer *lex, const char *what, uint8_t *byte)
{
    uint64_t value;
    if (!lex_uint(lex, what, 255, &value))
        return false;
    *byte = (uint8_t)value;
    return true;
}

static bool read_operation(lexer *lex, stencil_operation *operation)
{
    int index;
    if (!lex_lookup(lex, "stencil operation", stencil_operation_names, STENCIL_OPERATION_COUNT, &index))
        return false;
    *operation = (stencil_operation)index;
    return true;
}

static bool read_stencil(assembler *assembler, pass_decl *pass)
{
    lexer *lex = &assembler->lex;
    const token at = lex_peek(lex);
    int function;
    if (pass->stencil_plane >= 0)
        return lex_error(lex, at, "a pass has one stencil plane");
    if (!assemble_plane(assembler, &pass->stencil_plane))
        return false;
    if (assembler->program->planes[pass->stencil_plane].kind != PLANE_STENCIL)
        return lex_error(lex, at, "'%s' is not declared stencil", assembler->program->planes[pass->stencil_plane].name);
    if (!lex_lookup(lex, "compare function", compare_function_names, COMPARE_FUNCTION_COUNT, &function))
        return false;
    pass->stencil_function = (compare_function)function;
    pass->stencil_write_mask = 255;
    return read_byte(lex, "the reference value", &pass->stencil_reference) &&
           read_byte(lex, "the compare mask", &pass->stencil_mask) && read_operation(lex, &pass->stencil_fail) &&
           read_operation(lex, &pass->stencil_depth_fail) && read_operation(lex, &pass->stencil_pass) &&
           (!lex_accept(lex, "write") || read_byte(lex, "the write mask", &pass->stencil_write_mask));
}

static bool read_shader(assembler *assembler, pass_decl *pass)
{
    lexer *lex = &assembler->lex;
    const program *program = assembler->program;
    const char *names[KERNEL_MAX];
    int kernels[KERNEL_MAX], count = 0, found;
    for (int i = 0; i < program->kernel_count; i++) {
        if (program->kernels[i].is_shader) {
            names[count] = program->kernels[i].name;
            kernels[count++] = i;
        }
    }
    if (pass->shader >= 0)
        return lex_error(lex, lex_peek(lex), "a pass runs one shader");
    if (!lex_lookup(lex, "shader", names, count, &found))
        return false;
    pass->shader = kernels[found];
    if (!lex_accept(lex, "keep"))
        return true;
    uint8_t field;
    if (!assemble_predicate(lex, &field))
        return false;
    pass->keep = field & 7;
    pass->keep_negated = field >> 3;
    return true;
}

// color, premul, or a colour register that the shader leaves.
static bool read_target_source(assembler *assembler, const pass_decl *pass, int *source)
{
    lexer *lex = &assembler->lex;
    const token token = lex_peek(lex);
    if (token.length == 2 && token.text[0] == 'c' && token.text[1] >= '0' && token.text[1] < '0' + COLOR_COUNT - 1) {
        if (pass->shader < 0)
            return lex_error(lex, token, "without a shader above there is nothing in c0 to c%d", COLOR_COUNT - 2);
        *source = SOURCE_COLOR + token.text[1] - '0';
        lex_take(lex);
        return true;
    }
    return assemble_fragment_color(assembler, source);
}

static bool read_target(assembler *assembler, pass_decl *pass)
{
    lexer *lex = &assembler->lex;
    const token at = lex_peek(lex);
    if (pass->target_count == TARGET_MAX)
        return lex_error(lex, at, "too many targets; at most %d in a pass", TARGET_MAX);
    int plane, blend = -1, source;
    if (!assemble_plane(assembler, &plane) || !plane_is(assembler, plane, FORMAT_CLASS_COLOR, "a colour plane", at) ||
        (!lex_accept(lex, "replace") && !assemble_blend(assembler, &blend)) ||
        !read_target_source(assembler, pass, &source))
        return false;
    pass->targets[pass->target_count].plane = plane;
    pass->targets[pass->target_count].blend = blend;
    pass->targets[pass->target_count++].source = source;
    return true;
}

static bool read_count(assembler *assembler, pass_decl *pass)
{
    if (pass->query >= 0)
        return lex_error(&assembler->lex, lex_peek(&assembler->lex), "a pass counts into one query");
    return assemble_query(assembler, &pass->query);
}

// A full-screen pass has no fragment: no depth to test, no colour but the shader's.
static bool check_fullscreen(assembler *assembler, const kernel_decl *kernel)
{
    const pass_decl *pass = &kernel->pass;
    const kernel_decl *shader = pass->shader >= 0 ? &assembler->program->kernels[pass->shader] : NULL;
    bool fragment = pass->clip_count > 0 || pass->depth_plane >= 0 || (shader && !shader->fullscreen);
    for (int i = 0; i < pass->target_count; i++)
        fragment |= pass->targets[i].source >= SOURCE_FRAGMENT_COLOR;
    if (kernel->fullscreen && fragment)
        return lex_error(&assembler->lex, lex_peek(&assembler->lex),
                         "a fullscreen pass has no fragment: no clip, no depth test, a fullscreen shader, targets from c0 to c6");
    return true;
}

bool assemble_pass(assembler *assembler, kernel_decl *kernel)
{
    static bool (*const readers[])(struct assembler *, pass_decl *) = {read_shader, read_clip, read_depth,
                                                                               read_stencil, read_target, read_count};
    static const char *const names[] = {"shader", "clip", "depth", "stencil", "target", "count", "end"};
    enum { END = 6 };
    lexer *lex = &assembler->lex;
    pass_decl *pass = &kernel->pass;
    pass->shader = pass->depth_plane = pass->stencil_plane = pass->query = -1;
    while (lex_line(lex)) {
        int which;
        if (!lex_lookup(lex, "part of a pass", names, END + 1, &which))
            continue;
        if (which == END)
            return lex_finish(lex) && check_fullscreen(assembler, kernel);
        if (readers[which](assembler, pass))
            lex_finish(lex);
        if (lex->errors >= ERROR_MAX)
            return false;
    }
    return lex_error(lex, lex_peek(lex), "pass '%s' of line %d has no 'end'", kernel->name, kernel->line);
}
