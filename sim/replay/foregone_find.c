// A bound kernel in; out, as a tree of tests, when it writes nothing and what it executes then.
//
// The kernel's instructions are followed for all lanes of a batch at once. A predicate holds nowhere, everywhere, or nobody knows where.
// At a compare of values with known ranges the path forks: it may hold nowhere or everywhere. A path ends well if it comes to
// the kernel's end without a store and without an instruction whose lanes are not known.
#include "foregone.h"

#include <stdlib.h>
#include <string.h>

enum { EXECUTE = ~END_EXECUTE, FORKS_MAX = 8 };

typedef enum where { NOWHERE, EVERYWHERE, SOMEWHERE } where;

typedef struct path {
    where predicates[PREDICATE_COUNT];
    ranged registers[REGISTER_COUNT];
    int colors[COLOR_COUNT];  // plane that it was loaded from, plus 1; 0: none
    uint64_t executed[WORD_MAX / 64];
    int at, forks;
} path;

typedef struct finder {
    const bound_program *bound;
    const instruction *code;
    int count;
    format depth_format;
    struct foregone *out;
} finder;

static where opposite(where w)
{
    return w == SOMEWHERE ? SOMEWHERE : w == NOWHERE ? EVERYWHERE : NOWHERE;
}

static where both(where a, where b)
{
    if (a == NOWHERE || b == NOWHERE)
        return NOWHERE;
    return a == EVERYWHERE && b == EVERYWHERE ? EVERYWHERE : SOMEWHERE;
}

// A predicate as operands name it: bit 3 negates.
static where predicate(const path *path, int operand)
{
    const where w = operand & 7 ? path->predicates[operand & 7] : EVERYWHERE;
    return operand >> 3 ? opposite(w) : w;
}

static ranged value_of(const finder *f, const path *path, int source)
{
    if (source < REGISTER_COUNT)
        return path->registers[source];
    if (source >= SOURCE_CONSTANT)
        return (ranged){.kind = RANGED_CONSTANT, .constant = bound_constant(f->bound, source - SOURCE_CONSTANT)};
    const bool depth = source == SOURCE_DEPTH || source == SOURCE_DEPTH_FORMAT + (int)f->depth_format;
    return (ranged){.kind = depth ? RANGED_DEPTH : RANGED_UNKNOWN};
}

static ranged column(int plane, int channel)
{
    return (ranged){.kind = RANGED_COLUMNS, .columns = {(uint8_t)(4 * plane + channel)}, .count = 1};
}

static ranged least_of(ranged a, ranged b)
{
    if (a.kind != RANGED_COLUMNS || b.kind != RANGED_COLUMNS || a.count + b.count > LEAST_OF_MAX)
        return (ranged){0};
    memcpy(a.columns + a.count, b.columns, b.count);
    a.count = (uint8_t)(a.count + b.count);
    return a;
}

static bool is_color(const finder *f, int plane)
{
    return format_table[bound_plane_format(f->bound, plane)].class == FORMAT_CLASS_COLOR;
}

// What the instruction leaves in the register that it writes.
static void write_register(const finder *f, path *path, const instruction *i)
{
    const operand_kind kind = opcode_table[i->op].d;
    const bool loads = i->op == OP_ld || i->op == OP_tex;
    if (kind != OPERAND_REG && kind != OPERAND_COLOR && kind != OPERAND_ANY)
        return;
    if (i->d >= SOURCE_COLOR) {
        path->colors[i->d - SOURCE_COLOR] = loads ? i->a + 1 : 0;
        return;
    }
    ranged value = {0};
    if (loads && !is_color(f, i->a))
        value = column(i->a, 0);
    else if (i->op == OP_get && i->a >= SOURCE_COLOR && i->a < SOURCE_COLOR + COLOR_COUNT && path->colors[i->a - SOURCE_COLOR])
        value = column(path->colors[i->a - SOURCE_COLOR] - 1, i->b);
    else if (i->op == OP_mov)
        value = value_of(f, path, i->a);
    else if (i->op == OP_min)
        value = least_of(value_of(f, path, i->a), value_of(f, path, i->b));
    path->registers[i->d] = value;
}

static int16_t follow(finder *f, path path);

// The next test looks at them.
static void note_columns(finder *f, const ranged *value)
{
    for (int i = 0; i < value->count; i++)
        f->out->tests_of[value->columns[i] / 4] |= 1ull << f->out->test_count;
}

static int16_t fork_at(finder *f, const path *before, ranged a, ranged b)
{
    const instruction *i = &f->code[before->at];
    if (before->forks == FORKS_MAX)
        return EXECUTE;
    foregone_test test = {.op = i->op, .a = a, .b = b};
    for (int holds = 0; holds < 2; holds++) {
        path path = *before;
        path.at++;
        path.forks++;
        path.predicates[i->d] = holds ? EVERYWHERE : NOWHERE;
        test.next[holds] = follow(f, path);
    }
    if ((test.next[0] == EXECUTE && test.next[1] == EXECUTE) || f->out->test_count == FOREGONE_TEST_MAX)
        return EXECUTE;
    note_columns(f, &a);
    note_columns(f, &b);
    f->out->tests[f->out->test_count] = test;
    return (int16_t)f->out->test_count++;
}

static int16_t end(finder *f, const path *path)
{
    if (f->out->end_count == FOREGONE_END_MAX)
        return EXECUTE;
    memcpy(f->out->ends[f->out->end_count].executed, path->executed, sizeof path->executed);
    return (int16_t)~f->out->end_count++;
}

// Where the instruction's predicate holds, if it is not a compare of ranges.
static where logic(const path *path, const instruction *i)
{
    const where a = predicate(path, i->a), b = predicate(path, i->b);
    if (i->op == OP_pand)
        return both(a, b);
    return i->op == OP_por ? opposite(both(opposite(a), opposite(b))) : SOMEWHERE;
}

static int16_t follow(finder *f, path path)
{
    for (; path.at < f->count; path.at++) {
        const instruction *i = &f->code[path.at];
        const bool writes_predicate = opcode_table[i->op].d == OPERAND_PRED;
        const where lanes = predicate(&path, i->guard | i->guard_negated << 3);
        if (lanes == SOMEWHERE || (lanes == EVERYWHERE && i->op == OP_st))
            return EXECUTE;
        if (lanes == NOWHERE) {
            if (writes_predicate)
                path.predicates[i->d] = NOWHERE;
            continue;
        }
        path.executed[path.at / 64] |= 1ull << path.at % 64;
        if (i->op == OP_skip) {
            const where taken = predicate(&path, i->a);
            if (taken == SOMEWHERE)
                return EXECUTE;
            path.at += taken == EVERYWHERE ? i->b - 1 : 0;
        } else if (i->op == OP_eq || i->op == OP_ne || i->op == OP_lt || i->op == OP_ge) {
            const ranged a = value_of(f, &path, i->a), b = value_of(f, &path, i->b);
            if (a.kind && b.kind)
                return fork_at(f, &path, a, b);
            path.predicates[i->d] = SOMEWHERE;
        } else if (writes_predicate) {
            path.predicates[i->d] = logic(&path, i);
        } else {
            write_register(f, &path, i);
        }
    }
    return end(f, &path);
}

format foregone_format(const bound_program *bound, format machine)
{
    const uint32_t formats = bound_depth_formats(bound);
    return formats >> machine & 1 || !formats ? machine : (format)__builtin_ctz(formats);
}

struct foregone *foregone_find(const program *program, const bound_program *bound, format depth_format)
{
    struct foregone *trees = calloc((size_t)program->kernel_count + 1, sizeof *trees);
    for (int k = 0; trees && k < program->kernel_count; k++) {
        finder f = {.bound = bound, .depth_format = depth_format, .out = &trees[k]};
        f.code = bound_instructions(bound, k, &f.count);
        trees[k].end_count = END_EXECUTE + 1;
        trees[k].root = follow(&f, (path){0});
    }
    return trees;
}
