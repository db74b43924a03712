// One fragment through the words of one kernel or shader, as opcodes.def tells it. All registers start at zero.
#include "twin.h"

#include "../../isa/execute_math.h"

#include <math.h>
#include <string.h>

typedef struct lane {
    twin *twin;
    uint64_t sample;
    const twin_fragment *fragment;
    uint32_t r[REGISTER_COUNT], c[COLOR_COUNT][4];
    bool p[PREDICATE_COUNT];
} lane;

static uint32_t scalar(const lane *l, int source)
{
    const program *program = l->twin->program;
    if (source >= SOURCE_CONSTANT)
        return twin_value(l->twin, &program->constants[source - SOURCE_CONSTANT]);
    if (source < SOURCE_COLOR)
        return l->r[source];
    if (source == SOURCE_PRIMITIVE)
        return l->fragment->primitive;
    const format format =
        source == SOURCE_DEPTH ? l->twin->limits->depth_format : (enum format)(source - SOURCE_DEPTH_FORMAT);
    return twin_depth_code(format, l->fragment->depth, l->twin->image->reversed_depth);
}

static void color(const lane *l, int source, uint32_t rgba[4])
{
    if (source == SOURCE_FRAGMENT_COLOR || source == SOURCE_FRAGMENT_PREMUL)
        twin_color(l->fragment, source, rgba);
    else
        memcpy(rgba, l->c[source - SOURCE_COLOR], 4 * sizeof *rgba);
}

static bool is_color(int operand)
{
    return operand >= SOURCE_COLOR && operand <= SOURCE_FRAGMENT_PREMUL;
}

static bool predicate(const lane *l, int field)
{
    return l->p[field & 7] != (field >> 3);
}

static void load(lane *l, instruction i, twin_access access)
{
    twin_load(l->twin, i.a, l->sample, access, is_color(i.d) ? l->c[i.d - SOURCE_COLOR] : &l->r[i.d]);
}

static void store(lane *l, instruction i)
{
    uint32_t value[4];
    if (is_color(i.a))
        color(l, i.a, value);
    else
        value[0] = scalar(l, i.a);
    twin_store(l->twin, i.d, l->sample, value);
}

static bool compare(opcode op, uint32_t a, uint32_t b)
{
    switch (op) {
    case OP_eq: return a == b;
    case OP_ne: return a != b;
    case OP_lt: return a < b;
    case OP_ge: return a >= b;
    case OP_flt: return twin_float(a) < twin_float(b);
    case OP_fge: return twin_float(a) >= twin_float(b);
    default: return false;
    }
}

static uint32_t float_to_uint(float value)
{
    if (isnan(value) || value < 0.0f)
        return 0;
    return value >= 4294967296.0f ? UINT32_MAX : (uint32_t)value;
}

static uint32_t compute(const lane *l, instruction i)
{
    const uint32_t a = scalar(l, i.a), b = i.op == OP_ftou || i.op == OP_utof || i.op == OP_ztof ? 0 : scalar(l, i.b);
    const float x = twin_float(a), y = twin_float(b);
    switch (i.op) {
    case OP_add: return a + b;
    case OP_sub: return a - b;
    case OP_and: return a & b;
    case OP_xor: return a ^ b;
    case OP_min: return a < b ? a : b;
    case OP_max: return a > b ? a : b;
    case OP_fadd: return twin_bits(x + y);
    case OP_fsub: return twin_bits(x - y);
    case OP_fmul: return twin_bits(x * y);
    case OP_fdiv: return twin_bits(x / y);
    case OP_fpow: return execute_fpow(a, b);  // within 1 ulp is all that the manual promises: the series is shared
    case OP_ftou: return float_to_uint(x);
    case OP_utof: return twin_bits((float)a);
    case OP_ztof: return twin_bits(twin_code_depth((format)i.b, a, l->twin->image->reversed_depth));
    default: return 0;
    }
}

// Executes an instruction whose guard holds; returns how many words to go on.
static int execute(lane *l, instruction i)
{
    uint32_t value[4], other[4];
    switch (i.op) {
    case OP_ld: load(l, i, TWIN_READ); break;
    case OP_tex: load(l, i, TWIN_TEXTURE); break;
    case OP_st: store(l, i); break;
    case OP_mov:
        if (is_color(i.d))
            color(l, i.a, l->c[i.d - SOURCE_COLOR]);
        else
            l->r[i.d] = scalar(l, i.a);
        break;
    case OP_get:
        color(l, i.a, value);
        l->r[i.d] = value[i.b];
        break;
    case OP_put: l->c[i.d - SOURCE_COLOR][i.b] = scalar(l, i.a); break;
    case OP_eq:
    case OP_ne:
    case OP_lt:
    case OP_ge:
    case OP_flt:
    case OP_fge: l->p[i.d] = compare(i.op, scalar(l, i.a), scalar(l, i.b)); break;
    case OP_pand: l->p[i.d] = predicate(l, i.a) && predicate(l, i.b); break;
    case OP_por: l->p[i.d] = predicate(l, i.a) || predicate(l, i.b); break;
    case OP_blend:
        color(l, i.a, value);
        color(l, i.b, other);
        twin_blend(l->twin, i.c, value, other, l->c[i.d - SOURCE_COLOR]);
        break;
    case OP_count: l->twin->queries[i.d]++; break;
    case OP_skip: return predicate(l, i.a) ? i.b : 1;
    default: l->r[i.d] = compute(l, i); break;
    }
    return 1;
}

static void run(lane *l, const kernel_decl *kernel)
{
    l->p[0] = true;
    for (int at = 0; at < kernel->word_count;) {
        instruction i;
        word_decode(kernel->words[at], &i);
        if (l->p[i.guard] != i.guard_negated) {
            at += execute(l, i);
            continue;
        }
        if (opcode_table[i.op].d == OPERAND_PRED)  // a compare whose guard is false writes false
            l->p[i.d] = false;
        at++;
    }
}

void twin_kernel(twin *twin, const kernel_decl *kernel, uint64_t sample, const twin_fragment *fragment)
{
    lane l = {.twin = twin, .sample = sample, .fragment = fragment};
    run(&l, kernel);
}

bool twin_shader(twin *twin, const pass_decl *pass, uint64_t sample, const twin_fragment *fragment,
                 uint32_t colors[COLOR_COUNT][4])
{
    lane l = {.twin = twin, .sample = sample, .fragment = fragment};
    run(&l, &twin->program->kernels[pass->shader]);
    memcpy(colors, l.c, sizeof l.c);
    return l.p[pass->keep] != pass->keep_negated;
}
