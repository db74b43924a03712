// Program text in, `program` out: the declarations and the frame; blocks are read by their own files.
#include "assemble.h"
#include "unroll.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

enum { FILE_SIZE_MAX = 1 << 20 };

bool plane_is_color(const plane_decl *plane)
{
    return plane->kind == PLANE_RGBA ||
           (plane->kind == PLANE_FORMAT && format_table[plane->format].class == FORMAT_CLASS_COLOR);
}

bool planes_match(const plane_decl *a, const plane_decl *b)
{
    return a->kind == b->kind && (a->kind != PLANE_FORMAT || a->format == b->format);
}

bool assemble_plane(assembler *assembler, int *index)
{
    const char *names[PLANE_MAX];
    for (int i = 0; i < assembler->program->plane_count; i++)
        names[i] = assembler->program->planes[i].name;
    return lex_lookup(&assembler->lex, "plane", names, assembler->program->plane_count, index);
}

bool assemble_query(assembler *assembler, int *index)
{
    const char *names[QUERY_MAX];
    for (int i = 0; i < assembler->program->query_count; i++)
        names[i] = assembler->program->queries[i].name;
    return lex_lookup(&assembler->lex, "query", names, assembler->program->query_count, index);
}

bool assemble_blend(assembler *assembler, int *index)
{
    const char *names[BLEND_MAX];
    for (int i = 0; i < assembler->program->blend_count; i++)
        names[i] = assembler->program->blends[i].name;
    return lex_lookup(&assembler->lex, "blend state", names, assembler->program->blend_count, index);
}

bool assemble_format(assembler *assembler, format_class class, int *index)
{
    const char *names[FORMAT_COUNT];
    int formats[FORMAT_COUNT], count = 0;
    for (int i = 0; i < FORMAT_COUNT; i++) {
        if (format_table[i].class == class) {
            names[count] = format_table[i].name;
            formats[count++] = i;
        }
    }
    int found;
    if (!lex_lookup(&assembler->lex, "depth format", names, count, &found))
        return false;
    *index = formats[found];
    return true;
}

bool assemble_fragment_color(assembler *assembler, int *source)
{
    static const char *const names[] = {"color", "premul"};
    if (!lex_lookup(&assembler->lex, "fragment colour", names, 2, source))
        return false;
    *source += SOURCE_FRAGMENT_COLOR;
    return true;
}

bool assemble_value(assembler *assembler, value *value)
{
    lexer *lex = &assembler->lex;
    const token token = lex_peek(lex);
    uint64_t integer;
    float number;
    memset(value, 0, sizeof *value);
    value->format = -1;
    if (lex_accept(lex, "near")) {
        value->kind = VALUE_NEAR;
        return true;
    }
    if (lex_accept(lex, "stencil_max")) {
        value->kind = VALUE_STENCIL_MAX;
        return true;
    }
    if (token.length >= 3 && memcmp(token.text, "far", 3) == 0) {
        value->kind = VALUE_FAR;
        for (int i = 0; i < FORMAT_COUNT; i++) {
            char name[16];
            snprintf(name, sizeof name, "far.%s", format_table[i].name);
            if (format_table[i].class == FORMAT_CLASS_DEPTH && lex_is(token, name))
                value->format = (int8_t)i;
        }
        if (value->format >= 0 || lex_is(token, "far")) {
            lex_take(lex);
            return true;
        }
        return false;
    }
    if (lex_parse_uint(token, &integer) && integer <= UINT32_MAX) {
        value->kind = VALUE_UINT;
        value->bits = (uint32_t)integer;
        lex_take(lex);
        return true;
    }
    if (lex_parse_float(token, &number)) {
        value->kind = VALUE_FLOAT;
        memcpy(&value->bits, &number, sizeof number);
        lex_take(lex);
        return true;
    }
    return false;
}

// plane NAME[, NAME]... KIND
static bool read_plane(assembler *assembler)
{
    lexer *lex = &assembler->lex;
    program *program = assembler->program;
    const int first = program->plane_count;
    do {
        if (program->plane_count == PLANE_MAX)
            return lex_error(lex, lex_peek(lex), "too many planes; at most %d", PLANE_MAX);
        plane_decl *plane = &program->planes[program->plane_count];
        const token at = lex_peek(lex);
        if (!lex_name(lex, "a plane's name", plane->name))
            return false;
        for (int i = 0; i < program->plane_count; i++)
            if (strcmp(program->planes[i].name, plane->name) == 0)
                return lex_error(lex, at, "plane '%s' is declared already, in line %d", plane->name, program->planes[i].line);
        plane->line = lex->line;
        program->plane_count++;
    } while (lex_accept(lex, ","));

    const char *names[3 + FORMAT_COUNT] = {"depth", "rgba", "stencil"};
    for (int i = 0; i < FORMAT_COUNT; i++)
        names[3 + i] = format_table[i].name;
    int kind;
    if (!lex_lookup(lex, "kind of plane", names, 3 + FORMAT_COUNT, &kind))
        return false;
    for (int i = first; i < program->plane_count; i++) {
        program->planes[i].kind = kind < 3 ? (plane_kind)kind : PLANE_FORMAT;
        program->planes[i].format = kind < 3 ? 0 : (format)(kind - 3);
    }
    return true;
}

// query NAME
static bool read_query(assembler *assembler)
{
    program *program = assembler->program;
    if (program->query_count == QUERY_MAX)
        return lex_error(&assembler->lex, lex_peek(&assembler->lex), "too many queries; at most %d", QUERY_MAX);
    query_decl *query = &program->queries[program->query_count];
    const token at = lex_peek(&assembler->lex);
    if (!lex_name(&assembler->lex, "a query's name", query->name))
        return false;
    for (int i = 0; i < program->query_count; i++)
        if (strcmp(program->queries[i].name, query->name) == 0)
            return lex_error(&assembler->lex, at, "query '%s' is declared already, in line %d", query->name,
                             program->queries[i].line);
    query->line = assembler->lex.line;
    program->query_count++;
    return true;
}

static bool read_equation(lexer *lex, const char *part, blend_equation *equation, blend_factor *source,
                          blend_factor *destination)
{
    int e, s, d;
    if (!lex_expect(lex, part) ||
        !lex_lookup(lex, "blend equation", blend_equation_names, BLEND_EQUATION_COUNT, &e) ||
        !lex_lookup(lex, "blend factor", blend_factor_names, BLEND_FACTOR_COUNT, &s) ||
        !lex_lookup(lex, "blend factor", blend_factor_names, BLEND_FACTOR_COUNT, &d))
        return false;
    *equation = (blend_equation)e;
    *source = (blend_factor)s;
    *destination = (blend_factor)d;
    return true;
}

// blend NAME rgb EQUATION SOURCE DESTINATION alpha EQUATION SOURCE DESTINATION [composites]
static bool read_blend(assembler *assembler)
{
    program *program = assembler->program;
    lexer *lex = &assembler->lex;
    if (program->blend_count == BLEND_MAX)
        return lex_error(lex, lex_peek(lex), "too many blend states; at most %d", BLEND_MAX);
    blend_decl *blend = &program->blends[program->blend_count];
    const token at = lex_peek(lex);
    if (!lex_name(lex, "a blend state's name", blend->name))
        return false;
    for (int i = 0; i < program->blend_count; i++)
        if (strcmp(program->blends[i].name, blend->name) == 0)
            return lex_error(lex, at, "blend state '%s' is declared already, in line %d", blend->name, program->blends[i].line);
    if (!read_equation(lex, "rgb", &blend->rgb.equation, &blend->rgb.source, &blend->rgb.destination) ||
        !read_equation(lex, "alpha", &blend->alpha.equation, &blend->alpha.source, &blend->alpha.destination))
        return false;
    blend->composites = lex_accept(lex, "composites");
    blend->line = lex->line;
    program->blend_count++;
    return true;
}

// limit iterations N | limit occlusion_ratio R
static bool read_limit(assembler *assembler)
{
    lexer *lex = &assembler->lex;
    static const char *const names[] = {"iterations", "occlusion_ratio"};
    int which;
    if (!lex_lookup(lex, "limit", names, 2, &which))
        return false;
    if (which == 0)
        return lex_uint(lex, "a number of iterations", 1000000000, &assembler->program->max_iterations);
    float ratio;
    if (!lex_parse_float(lex_peek(lex), &ratio) || ratio < 0 || ratio > 1)
        return lex_error(lex, lex_peek(lex), "expected a ratio from 0.0 to 1.0");
    lex_take(lex);
    assembler->program->occlusion_ratio = (double)(ratio + 0.0f);  // -0 is 0
    return true;
}

// output FRONT over BASE | output BASE
static bool read_output(assembler *assembler)
{
    lexer *lex = &assembler->lex;
    program *program = assembler->program;
    int planes[2], count = 0;
    do {
        const token at = lex_peek(lex);
        if (!assemble_plane(assembler, &planes[count]))
            return false;
        if (!plane_is_color(&program->planes[planes[count]]))
            return lex_error(lex, at, "the output needs a colour plane");
    } while (++count < 2 && lex_accept(lex, "over"));
    program->output_front = count == 2 ? planes[0] : -1;
    program->output_base = planes[count - 1];
    return true;
}

// kernel NAME [fullscreen] | shader NAME [fullscreen] | pass NAME [fullscreen]
static bool read_kernel(assembler *assembler, bool is_pass, bool is_shader)
{
    program *program = assembler->program;
    lexer *lex = &assembler->lex;
    if (program->kernel_count == KERNEL_MAX)
        return lex_error(lex, lex_peek(lex), "too many kernels; at most %d", KERNEL_MAX);
    kernel_decl *kernel = &program->kernels[program->kernel_count];
    const token at = lex_peek(lex);
    if (!lex_name(lex, "a kernel's name", kernel->name))
        return false;
    for (int i = 0; i < program->kernel_count; i++)
        if (strcmp(program->kernels[i].name, kernel->name) == 0)
            lex_error(lex, at, "kernel '%s' is declared already, in line %d", kernel->name, program->kernels[i].line);
    kernel->line = lex->line;
    kernel->is_pass = is_pass;
    kernel->is_shader = is_shader;
    kernel->fullscreen = lex_accept(lex, "fullscreen");
    program->kernel_count++;
    lex_finish(lex);
    return is_pass ? assemble_pass(assembler, kernel) : assemble_kernel(assembler, kernel);
}

typedef enum statement { S_PROGRAM, S_PLANE, S_QUERY, S_BLEND, S_LIMIT, S_OUTPUT, S_KERNEL, S_SHADER, S_PASS, S_SCHEDULE, S_COUNT } statement;
static const char *const statements[S_COUNT] = {"program", "plane", "query", "blend", "limit",
                                                "output",  "kernel", "shader", "pass", "schedule"};

static void read_statement(assembler *assembler, bool seen[S_COUNT])
{
    lexer *lex = &assembler->lex;
    const token at = lex_peek(lex);
    int which;
    if (!lex_lookup(lex, "statement", statements, S_COUNT, &which))
        return;
    if (seen[which] && (which == S_PROGRAM || which == S_OUTPUT || which == S_SCHEDULE)) {
        lex_error(lex, at, "'%s' is there already", statements[which]);
        return;
    }
    if (!seen[S_PROGRAM] && which != S_PROGRAM)
        lex_error(lex, at, "the first statement is 'program NAME'");
    seen[S_PROGRAM] = seen[which] = true;
    bool block = false, good = false;
    switch ((statement)which) {
    case S_PROGRAM: good = lex_name(lex, "the program's name", assembler->program->name); break;
    case S_PLANE: good = read_plane(assembler); break;
    case S_QUERY: good = read_query(assembler); break;
    case S_BLEND: good = read_blend(assembler); break;
    case S_LIMIT: good = read_limit(assembler); break;
    case S_OUTPUT: good = read_output(assembler); break;
    case S_KERNEL: block = true; read_kernel(assembler, false, false); break;
    case S_SHADER: block = true; read_kernel(assembler, false, true); break;
    case S_PASS: block = true; read_kernel(assembler, true, false); break;
    case S_SCHEDULE: block = true; lex_finish(lex); assemble_schedule(assembler); break;
    case S_COUNT: break;
    }
    if (!block && good)
        lex_finish(lex);
}

static status assemble_lines(const char *file, const unrolled *text, const report *report, program **result)
{
    program *program = calloc(1, sizeof *program);
    if (!program)
        return report_error(report, STATUS_IO, "%s: out of memory", file);
    program->output_front = program->output_base = -1;
    assembler assembler = {.program = program};
    lex_start(&assembler.lex, file, text->text, text->size, report);
    assembler.lex.line_map = text->lines;
    bool seen[S_COUNT] = {false};
    while (lex_line(&assembler.lex) && assembler.lex.errors < ERROR_MAX)
        read_statement(&assembler, seen);
    if (!assembler.lex.errors && (!seen[S_SCHEDULE] || !seen[S_OUTPUT])) {
        report_error(report, STATUS_REFUSED, "%s: has no '%s'", file, seen[S_SCHEDULE] ? "output" : "schedule");
        assembler.lex.errors++;
    }
    if (assembler.lex.errors) {
        program_destroy(program);
        return STATUS_REFUSED;
    }
    *result = program;
    return STATUS_OK;
}

status assemble_text_with(const char *file, const char *text, size_t size, const parameter *parameters,
                          int parameter_count, const report *report, program **result)
{
    *result = NULL;
    if (size > FILE_SIZE_MAX)
        return report_error(report, STATUS_REFUSED, "%s: a program is at most %d bytes", file, FILE_SIZE_MAX);
    if (size && memchr(text, 0, size))
        return report_error(report, STATUS_REFUSED, "%s: holds a NUL byte; a program is text", file);
    unrolled unrolled;
    if (!unroll_text(file, text, size, parameters, parameter_count, report, &unrolled))
        return STATUS_REFUSED;
    const status status = assemble_lines(file, &unrolled, report, result);
    unroll_free(&unrolled);
    return status;
}

status assemble_text(const char *file, const char *text, size_t size, const report *report, program **program)
{
    return assemble_text_with(file, text, size, NULL, 0, report, program);
}

status assemble_file(const char *path, const report *report, program **program)
{
    *program = NULL;
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    char *text = malloc(FILE_SIZE_MAX + 1);
    const size_t size = text ? fread(text, 1, FILE_SIZE_MAX + 1, file) : 0;
    const bool failed = !text || ferror(file);
    fclose(file);
    const status result = failed ? report_error(report, STATUS_IO, "%s: could not be read", path)
                                 : assemble_text(path, text, size, report, program);
    free(text);
    return result;
}

void program_destroy(program *program)
{
    free(program);
}
