// The schedule's lines in, steps out: `repeat`, `while`, `if` and `end` are resolved to step numbers.
//
//   clear PLANE VALUE          near, far, far.FORMAT, stencil_max, background, an integer, a float, R G B A
//   copy PLANE SOURCE          swap PLANE PLANE
//   draw opaque|transparent|unsorted|sorted with KERNEL
//   fullscreen KERNEL          reset QUERY
//   if QUERY ... end           repeat ... while QUERY
//   end
#include "assemble.h"

#include <string.h>

enum { NESTING_MAX = 16 };

typedef enum word { W_CLEAR, W_COPY, W_SWAP, W_DRAW, W_FULLSCREEN, W_RESET, W_IF, W_REPEAT, W_WHILE, W_END, W_COUNT } word;
static const char *const words[W_COUNT] = {"clear", "copy", "swap",   "draw",  "fullscreen",
                                           "reset", "if",   "repeat", "while", "end"};

static bool read_kernel_name(assembler *assembler, step *step, bool fullscreen)
{
    const program *program = assembler->program;
    const char *names[KERNEL_MAX];
    for (int i = 0; i < program->kernel_count; i++)
        names[i] = program->kernels[i].name;
    const token at = lex_peek(&assembler->lex);
    int kernel;
    if (!lex_lookup(&assembler->lex, "kernel", names, program->kernel_count, &kernel))
        return false;
    if (program->kernels[kernel].is_shader)
        return lex_error(&assembler->lex, at, "'%s' is a shader; a pass runs it", names[kernel]);
    if (program->kernels[kernel].fullscreen != fullscreen)
        return lex_error(&assembler->lex, at,
                         fullscreen ? "kernel '%s' is for fragments; declare it 'kernel %s fullscreen'"
                                    : "kernel '%s' is full-screen; 'draw' runs a kernel for fragments",
                         names[kernel], names[kernel]);
    step->kernel = (uint8_t)kernel;
    return true;
}

static bool read_rgba(assembler *assembler, value *value)
{
    memset(value, 0, sizeof *value);
    value->kind = VALUE_RGBA;
    value->format = -1;
    for (int i = 0; i < 4; i++) {
        const token at = lex_peek(&assembler->lex);
        uint64_t integer;
        if (lex_parse_uint(at, &integer) && integer <= 1 << 24)
            value->rgba[i] = (float)integer;
        else if (!lex_parse_float(at, &value->rgba[i]))
            return lex_error(&assembler->lex, at, "a colour plane is cleared to 'background' or to four numbers, R G B A");
        lex_take(&assembler->lex);
    }
    return true;
}

static bool read_clear(assembler *assembler, step *step)
{
    lexer *lex = &assembler->lex;
    int plane;
    if (!assemble_plane(assembler, &plane))
        return false;
    step->plane = (uint8_t)plane;
    const plane_decl *decl = &assembler->program->planes[plane];
    if (plane_is_color(decl)) {
        if (!lex_accept(lex, "background"))
            return read_rgba(assembler, &step->value);
        step->value = (value){.kind = VALUE_BACKGROUND, .format = -1};
        return true;
    }
    const token at = lex_peek(lex);
    if (assemble_value(assembler, &step->value))
        return true;
    return lex_error(lex, at, "plane '%s' is cleared to near, far, far.FORMAT, stencil_max, an integer or a float", decl->name);
}

static bool read_two_planes(assembler *assembler, step *step)
{
    int first, second;
    if (!assemble_plane(assembler, &first))
        return false;
    const token at = lex_peek(&assembler->lex);
    if (!assemble_plane(assembler, &second))
        return false;
    const plane_decl *planes = assembler->program->planes;
    if (!planes_match(&planes[first], &planes[second]))
        return lex_error(&assembler->lex, at, "planes '%s' and '%s' differ in format", planes[first].name, planes[second].name);
    step->plane = (uint8_t)first;
    step->source = (uint8_t)second;
    return true;
}

static bool read_draw(assembler *assembler, step *step)
{
    static const char *const names[] = {"opaque", "transparent", "unsorted", "sorted"};
    static const uint8_t classes[] = {DRAW_OPAQUE, DRAW_TRANSPARENT, DRAW_UNSORTED, DRAW_SORTED};
    int which;
    if (!lex_lookup(&assembler->lex, "class of draws", names, 4, &which) || !lex_expect(&assembler->lex, "with"))
        return false;
    step->classes = classes[which];
    return read_kernel_name(assembler, step, false);
}

static bool read_query(assembler *assembler, step *step)
{
    int query;
    if (!assemble_query(assembler, &query))
        return false;
    step->query = (uint8_t)query;
    return true;
}

// Closes the innermost `repeat` or `if`, also if it is the wrong one, so that one mistake gives one message.
static bool close_block(assembler *assembler, int *open, int *depth, step_kind kind, token at)
{
    program *program = assembler->program;
    if (*depth == 0 || program->steps[open[*depth - 1]].kind != kind) {
        *depth -= *depth > 0;
        return lex_error(&assembler->lex, at, kind == STEP_REPEAT ? "'while' without 'repeat'" : "'end' inside 'repeat': close it with 'while'");
    }
    const int start = open[--*depth];
    program->steps[start].target = (uint16_t)program->step_count;
    program->steps[program->step_count].target = (uint16_t)start;
    return true;
}

bool assemble_schedule(assembler *assembler)
{
    static const step_kind kinds[W_COUNT] = {STEP_CLEAR, STEP_COPY, STEP_SWAP,   STEP_DRAW,  STEP_FULLSCREEN,
                                             STEP_RESET, STEP_IF,   STEP_REPEAT, STEP_WHILE, STEP_END};
    lexer *lex = &assembler->lex;
    program *program = assembler->program;
    int open[NESTING_MAX], depth = 0;
    while (lex_line(lex)) {
        const token at = lex_peek(lex);
        int which;
        if (!lex_lookup(lex, "step", words, W_COUNT, &which))
            continue;
        if (which == W_END && depth == 0)
            return lex_finish(lex);
        if (program->step_count == STEP_MAX || lex->errors >= ERROR_MAX)
            return lex_error(lex, at, "too many steps; at most %d", STEP_MAX);
        step *step = &program->steps[program->step_count];
        *step = (struct step){.kind = kinds[which], .line = lex->line};
        bool good = true;
        switch ((word)which) {
        case W_CLEAR: good = read_clear(assembler, step); break;
        case W_COPY:
        case W_SWAP: good = read_two_planes(assembler, step); break;
        case W_DRAW: good = read_draw(assembler, step); break;
        case W_FULLSCREEN: good = read_kernel_name(assembler, step, true); break;
        case W_RESET: good = read_query(assembler, step); break;
        case W_IF:
        case W_REPEAT:
            if (depth == NESTING_MAX)
                return lex_error(lex, at, "nested more than %d deep", NESTING_MAX);
            open[depth++] = program->step_count;
            good = which == W_REPEAT || read_query(assembler, step);
            break;
        case W_WHILE: good = close_block(assembler, open, &depth, STEP_REPEAT, at) && read_query(assembler, step); break;
        case W_END: good = close_block(assembler, open, &depth, STEP_IF, at); break;
        case W_COUNT: break;
        }
        program->step_count++;
        if (good)
            lex_finish(lex);
    }
    return lex_error(lex, lex_peek(lex), "the schedule has no 'end'");
}
