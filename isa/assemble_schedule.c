// The schedule's lines in, steps out: `repeat`, `while`, `if` and `end` are resolved to step numbers.
//
//   clear PLANE VALUE          near, far, far.FORMAT, stencil_max, background, an integer, a float, R G B A
//   copy PLANE SOURCE          swap PLANE PLANE
//   draw opaque|transparent|unsorted|sorted with KERNEL
//   fullscreen KERNEL          reset QUERY
//   if QUERY ... end           repeat ... while QUERY
//   list transparent|unsorted|sorted before PLANE entries N into PLANE with BLEND
//   batches N ... end          inside: draw batch with KERNEL, clear PLANE batch_near|batch_far
//   end
#include "assemble.h"

#include <string.h>

enum { NESTING_MAX = 16 };

typedef enum word { W_CLEAR, W_COPY, W_SWAP, W_DRAW, W_FULLSCREEN, W_RESET, W_IF, W_REPEAT, W_WHILE, W_END, W_LIST, W_BATCHES, W_COUNT } word;
static const char *const words[W_COUNT] = {"clear", "copy", "swap",   "draw",  "fullscreen",
                                           "reset", "if",   "repeat", "while", "end",  "list", "batches"};

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
    const bool batch_far = lex_is(at, "batch_far");
    if (batch_far || lex_is(at, "batch_near")) {
        lex_take(lex);
        step->value = (value){.kind = batch_far ? VALUE_BATCH_FAR : VALUE_BATCH_NEAR, .format = -1};
        return assembler->in_batches && decl->kind == PLANE_DEPTH
                   ? true
                   : lex_error(lex, at, "a plane declared depth is cleared to a batch's range, inside 'batches'");
    }
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
    static const char *const names[] = {"opaque", "transparent", "unsorted", "sorted", "batch"};
    static const uint8_t classes[] = {DRAW_OPAQUE, DRAW_TRANSPARENT, DRAW_UNSORTED, DRAW_SORTED, DRAW_BATCH};
    int which;
    const token at = lex_peek(&assembler->lex);
    if (!lex_lookup(&assembler->lex, "class of draws", names, 5, &which) || !lex_expect(&assembler->lex, "with"))
        return false;
    step->classes = classes[which];
    if (step->classes == DRAW_BATCH && !assembler->in_batches)
        return lex_error(&assembler->lex, at, "'batch' is for steps inside 'batches'");
    return read_kernel_name(assembler, step, false);
}

// list CLASS before PLANE entries N into PLANE with BLEND
static bool read_list(assembler *assembler, step *step)
{
    static const char *const names[] = {"transparent", "unsorted", "sorted"};
    static const uint8_t classes[] = {DRAW_TRANSPARENT, DRAW_UNSORTED, DRAW_SORTED};
    lexer *lex = &assembler->lex;
    const plane_decl *planes = assembler->program->planes;
    int which, before, into, blend;
    uint64_t entries;
    if (!lex_lookup(lex, "class of draws", names, 3, &which) || !lex_expect(lex, "before"))
        return false;
    const token depth = lex_peek(lex);
    if (!assemble_plane(assembler, &before))
        return false;
    if (planes[before].kind != PLANE_DEPTH)
        return lex_error(lex, depth, "'%s' is not declared depth", planes[before].name);
    if (!lex_expect(lex, "entries") || !lex_uint(lex, "the entries of a sample's list", 65536, &entries) || !lex_expect(lex, "into"))
        return false;
    const token color = lex_peek(lex);
    if (!assemble_plane(assembler, &into))
        return false;
    if (!plane_is_color(&planes[into]))
        return lex_error(lex, color, "'%s' is not a colour plane", planes[into].name);
    if (!lex_expect(lex, "with") || !assemble_blend(assembler, &blend))
        return false;
    step->classes = classes[which];
    step->source = (uint8_t)before;
    step->entries = (uint32_t)entries;
    step->plane = (uint8_t)into;
    step->kernel = (uint8_t)blend;
    return true;
}

static bool read_query(assembler *assembler, step *step)
{
    int query;
    if (!assemble_query(assembler, &query))
        return false;
    step->query = (uint8_t)query;
    return true;
}

// Closes the innermost block: `while` a `repeat`, `end` an `if` or `batches`; also if it is the wrong one, so that one
// mistake gives one message.
static bool close_block(assembler *assembler, int *open, int *depth, bool is_while, token at)
{
    program *program = assembler->program;
    step *steps = program->steps, *end = &steps[program->step_count];
    const step_kind kind = *depth > 0 ? steps[open[*depth - 1]].kind : STEP_END;
    if (*depth == 0 || is_while != (kind == STEP_REPEAT)) {
        *depth -= *depth > 0;
        return lex_error(&assembler->lex, at, is_while ? "'while' without 'repeat'" : "'end' inside 'repeat': close it with 'while'");
    }
    const int start = open[--*depth];
    if (kind == STEP_BATCHES) {
        end->kind = STEP_END_BATCHES;
        assembler->in_batches = false;
    }
    steps[start].target = (uint16_t)program->step_count;
    end->target = (uint16_t)start;
    return true;
}

// batches N
static bool read_batches(assembler *assembler, step *step)
{
    uint64_t draws;
    const token at = lex_peek(&assembler->lex);
    if (!lex_uint(&assembler->lex, "the draws of a batch", 65536, &draws))
        return false;
    if (draws == 0 || assembler->in_batches)
        return lex_error(&assembler->lex, at, draws ? "'batches' inside 'batches'" : "a batch has at least one draw");
    step->entries = (uint32_t)draws;
    assembler->in_batches = true;
    return true;
}

bool assemble_schedule(assembler *assembler)
{
    static const step_kind kinds[W_COUNT] = {STEP_CLEAR, STEP_COPY, STEP_SWAP,   STEP_DRAW,  STEP_FULLSCREEN,
                                             STEP_RESET, STEP_IF,   STEP_REPEAT, STEP_WHILE, STEP_END,
                                             STEP_LIST,  STEP_BATCHES};
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
        case W_BATCHES:
            if (depth == NESTING_MAX)
                return lex_error(lex, at, "nested more than %d deep", NESTING_MAX);
            open[depth++] = program->step_count;
            good = which == W_REPEAT || (which == W_IF ? read_query(assembler, step) : read_batches(assembler, step));
            break;
        case W_WHILE: good = close_block(assembler, open, &depth, true, at) && read_query(assembler, step); break;
        case W_END: good = close_block(assembler, open, &depth, false, at); break;
        case W_LIST: good = read_list(assembler, step); break;
        case W_COUNT: break;
        }
        program->step_count++;
        if (good)
            lex_finish(lex);
    }
    return lex_error(lex, lex_peek(lex), "the schedule has no 'end'");
}
