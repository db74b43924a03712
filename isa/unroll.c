// Parameters and unrolled loops: text with them in, plain program text out, and for each line of it the line it
// came from. Nothing that follows knows of them.
//
//   param NAME DEFAULT LEAST..MOST      a number that the user may set: PROGRAM,NAME=VALUE
//   for NAME in FROM..TO                the lines up to `endfor`, once for each NAME = FROM ... TO - 1
//   {EXPRESSION}                        anywhere else: its value; numbers and names with + - *, left to right
#include "unroll.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

enum { NAMES_MAX = 32, DEPTH_MAX = 8, OUTPUT_MAX = 4 << 20, VALUE_MAX = 1000000, TURNS_MAX = 1 << 20 };

typedef struct binding { char name[NAME_SIZE]; long value; } binding;

typedef struct unroller {
    lexer lex;                   // for messages; stands on the line being read
    const char *text, *end;
    binding names[NAMES_MAX];
    int name_count;
    const parameter *parameters;
    int parameter_count;
    bool used[NAMES_MAX];
    bool unclosed;               // the text ended inside a loop
    unrolled *out;
    size_t capacity, line_capacity;
    int turns;                   // of all loops: one without lines adds nothing to the output
} unroller;

static bool at_line(unroller *u, const char *line, const char *end, int number)
{
    lex_start(&u->lex, u->lex.file, line, (size_t)(end - line), u->lex.report);
    u->lex.line = number - 1;
    return lex_line(&u->lex);
}

static bool fail_at(unroller *u, token token, const char *message)
{
    lex_error(&u->lex, token, "%s", message);
    u->out->failed = true;
    return false;
}

static bool find_name(const unroller *u, const char *text, int length, long *value)
{
    for (int i = u->name_count - 1; i >= 0; i--) {
        if ((int)strlen(u->names[i].name) == length && memcmp(u->names[i].name, text, (size_t)length) == 0) {
            *value = u->names[i].value;
            return true;
        }
    }
    return false;
}

// TERM [+-* TERM]...; stops at the end of the text.
static bool evaluate(const unroller *u, const char *text, int length, long *value)
{
    const char *at = text, *end = text + length;
    char operator= '+';
    *value = 0;
    for (bool first = true; at < end || first; first = false) {
        while (at < end && *at == ' ')
            at++;
        if (!first) {
            if (at == end || !strchr("+-*", *at))
                return false;
            operator= *at++;
            while (at < end && *at == ' ')
                at++;
        }
        const char *start = at;
        while (at < end && (isalnum((unsigned char)*at) || *at == '_'))
            at++;
        const token token = {start, (int)(at - start), 1};
        uint64_t number;
        long term;
        if (lex_parse_uint(token, &number) && number <= VALUE_MAX)
            term = (long)number;
        else if (start == at || !find_name(u, start, (int)(at - start), &term))
            return false;
        *value = operator== '+' ? *value + term : operator== '-' ? *value - term : *value * term;
        if (*value > VALUE_MAX || *value < -VALUE_MAX)
            return false;
        while (at < end && *at == ' ')
            at++;
    }
    return true;
}

static bool append(unroller *u, const char *text, size_t length)
{
    unrolled *out = u->out;
    if (out->size + length + 1 > u->capacity) {
        const size_t capacity = 2 * (out->size + length) + 4096;
        char *grown = capacity <= 2 * OUTPUT_MAX ? realloc(out->text, capacity) : NULL;
        if (!grown)
            return fail_at(u, lex_peek(&u->lex), "unrolled, the program is larger than 4 MiB");
        out->text = grown;
        u->capacity = capacity;
    }
    memcpy(out->text + out->size, text, length);
    out->size += length;
    return true;
}

static bool end_line(unroller *u, int number)
{
    unrolled *out = u->out;
    if ((size_t)out->line_count == u->line_capacity) {
        const size_t capacity = 2 * u->line_capacity + 256;
        int *grown = realloc(out->lines, capacity * sizeof *grown);
        if (!grown)
            return fail_at(u, lex_peek(&u->lex), "out of memory");
        out->lines = grown;
        u->line_capacity = capacity;
    }
    out->lines[out->line_count++] = number;
    return append(u, "\n", 1);
}

// Copies a line with every {EXPRESSION} replaced. A comment is copied as it is.
static bool copy_line(unroller *u, const char *line, const char *end, int number)
{
    for (const char *at = line; at < end;) {
        const char *open = memchr(at, '{', (size_t)(end - at)), *comment = memchr(at, '#', (size_t)(end - at));
        if (!open || (comment && comment < open))
            return append(u, at, (size_t)(end - at)) && end_line(u, number);
        const char *close = memchr(open, '}', (size_t)(end - open));
        long value;
        const token token = {open, 1, (int)(open - line) + 1};
        if (!close || !evaluate(u, open + 1, (int)(close - open - 1), &value))
            return fail_at(u, token, "expected {NUMBER}, {NAME} or a sum, difference or product of such");
        char digits[24];
        const int length = snprintf(digits, sizeof digits, "%ld", value);
        if (!append(u, at, (size_t)(open - at)) || !append(u, digits, (size_t)length))
            return false;
        at = close + 1;
    }
    return end_line(u, number);
}

// FROM..TO as the rest of the line, each an expression.
static bool read_range(unroller *u, long *from, long *to)
{
    const token first = lex_peek(&u->lex);
    const char *line_end = u->lex.line_text + u->lex.line_length, *comment = memchr(first.text, '#', (size_t)(line_end - first.text));
    const char *end = comment ? comment : line_end;
    while (end > first.text && isspace((unsigned char)end[-1]))
        end--;
    for (const char *at = first.text; at + 1 < end; at++)
        if (at[0] == '.' && at[1] == '.')
            return evaluate(u, first.text, (int)(at - first.text), from) && evaluate(u, at + 2, (int)(end - at - 2), to)
                       ? true
                       : fail_at(u, first, "expected FROM..TO, each a number, a name or a sum, difference or product of such");
    return fail_at(u, first, "expected FROM..TO");
}

static bool bind_name(unroller *u, const char name[NAME_SIZE], long value)
{
    if (u->name_count == NAMES_MAX)
        return fail_at(u, lex_peek(&u->lex), "too many names; at most 32");
    memcpy(u->names[u->name_count].name, name, NAME_SIZE);
    u->names[u->name_count++].value = value;
    return true;
}

static bool read_param(unroller *u)
{
    char name[NAME_SIZE];
    uint64_t preset;
    long least, most;
    if (!lex_name(&u->lex, "a parameter's name", name) || !lex_uint(&u->lex, "its default", VALUE_MAX, &preset)) {
        u->out->failed = true;
        return false;
    }
    const token range = lex_peek(&u->lex);
    if (!read_range(u, &least, &most))
        return false;
    long value = (long)preset;
    for (int i = 0; i < u->parameter_count; i++) {
        if (strcmp(u->parameters[i].name, name) == 0) {
            value = u->parameters[i].value;
            u->used[i] = true;
        }
    }
    if (value < least || value > most) {
        lex_error(&u->lex, range, "parameter %s is %ld, but must be from %ld to %ld", name, value, least, most);
        u->out->failed = true;
        return false;
    }
    return bind_name(u, name, value);
}

static const char *line_end(const unroller *u, const char *line)
{
    const char *end = memchr(line, '\n', (size_t)(u->end - line));
    return end ? end : u->end;
}

static bool fail_at_loop(unroller *u, int number, token at, const char *message)
{
    lex_error_in_line(&u->lex, number, at, "%s", message);
    u->out->failed = true;
    return false;
}

// Copies lines from `*line` on, up to `endfor` or, at depth 0, the end of the text.
static bool copy_lines(unroller *u, const char **line, int *number, int depth);

// `for` stands at *line. Leaves *line behind its `endfor`.
static bool copy_loop(unroller *u, const char **line, int *number, int depth)
{
    char name[NAME_SIZE];
    long from, to;
    const token at = lex_peek(&u->lex);
    if (depth == DEPTH_MAX)
        return fail_at(u, at, "loops are nested more than 8 deep");
    if (!lex_name(&u->lex, "the loop's name", name) || !lex_expect(&u->lex, "in")) {
        u->out->failed = true;
        return false;
    }
    if (!read_range(u, &from, &to))
        return false;
    const int loop_number = *number;
    const char *body = line_end(u, *line);
    body = body < u->end ? body + 1 : body;
    const int body_number = *number + 1;
    const size_t size = u->out->size;
    const int lines = u->out->line_count;
    const bool never = from >= to;
    if (!bind_name(u, name, from))
        return false;
    for (long i = from; i < to || i == from; i++) {
        if (++u->turns > TURNS_MAX)
            return fail_at_loop(u, loop_number, at, "the loops have more than 1048576 turns in all");
        u->names[u->name_count - 1].value = i;
        *line = body;
        *number = body_number;
        if (!copy_lines(u, line, number, depth + 1)) {
            if (u->unclosed)
                fail_at_loop(u, loop_number, at, "this 'for' has no 'endfor'");
            u->unclosed = false;
            return false;
        }
    }
    u->name_count--;
    if (never) {  // read once to find its end, and taken back
        u->out->size = size;
        u->out->line_count = lines;
    }
    return true;
}

static bool copy_lines(unroller *u, const char **line, int *number, int depth)
{
    for (; *line < u->end; ++*number) {
        const char *end = line_end(u, *line), *next = end < u->end ? end + 1 : end;
        const bool any = at_line(u, *line, end, *number);
        if (any && lex_accept(&u->lex, "endfor")) {
            if (depth == 0)
                return fail_at(u, lex_peek(&u->lex), "'endfor' without 'for'");
            *line = next;
            ++*number;
            return true;
        }
        if (any && lex_accept(&u->lex, "for")) {
            if (!copy_loop(u, line, number, depth))
                return false;
            --*number;  // the loop above counts this line
            continue;
        }
        const bool param = any && lex_accept(&u->lex, "param");
        if (param ? !read_param(u) || !end_line(u, *number) : !copy_line(u, *line, end, *number))
            return false;
        *line = next;
    }
    u->unclosed = depth > 0;
    return depth == 0;
}

bool unroll_text(const char *file, const char *text, size_t size, const parameter *parameters, int parameter_count,
                 const report *report, unrolled *out)
{
    memset(out, 0, sizeof *out);
    unroller u = {.text = text, .end = size ? text + size : text, .parameters = parameters, .parameter_count = parameter_count, .out = out};
    lex_start(&u.lex, file, text, size, report);
    const char *line = text;
    int number = 1;
    bool good = parameter_count <= NAMES_MAX && copy_lines(&u, &line, &number, 0);
    for (int i = 0; good && i < parameter_count; i++) {
        if (!u.used[i]) {
            report_error(report, STATUS_REFUSED, "%s: has no parameter '%s'", file, parameters[i].name);
            good = false;
        }
    }
    if (!good)
        unroll_free(out);
    return good;
}

void unroll_free(unrolled *unrolled)
{
    free(unrolled->text);
    free(unrolled->lines);
    memset(unrolled, 0, sizeof *unrolled);
}
