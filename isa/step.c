// One fragment and one instruction in; what the instruction read, compared and wrote out. The scalar form of
// execute.c, written a line an opcode to be read beside opcodes.def, and equal to it in every bit.
//
// Arithmetic that makes a NaN makes the one quiet NaN; moving, storing and min and max hand a NaN on as it is.
#include "bind.h"

#include "execute_math.h"
#include "float_bits.h"

#include <math.h>
#include <string.h>

typedef struct stepper {
    const bound_program *bound;
    const fragment_input *fragment;
    uint32_t (*planes)[4];
    fragment_state *state;
    stepped *out;
} stepper;

static bool predicate(const stepper *s, int field)
{
    const bool value = (field & 7) == 0 || s->state->predicates[field & 7];
    return value != (field >> 3 & 1);
}

// ---- Operands ------------------------------------------------------------------------------------------

static uint32_t scalar(const stepper *s, int source)
{
    if (source >= SOURCE_CONSTANT)
        return s->bound->constants[source - SOURCE_CONSTANT];
    if (source >= SOURCE_DEPTH) {
        const format format =
            source == SOURCE_DEPTH ? s->bound->limits.depth_format : (enum format)(source - SOURCE_DEPTH_FORMAT);
        return format_depth_to_code(format, s->fragment->depth, s->bound->reversed_depth);
    }
    return source == SOURCE_PRIMITIVE ? s->fragment->primitive : s->state->registers[source];
}

static void color(const stepper *s, int source, uint32_t value[4])
{
    const bool fragment = source == SOURCE_FRAGMENT_COLOR || source == SOURCE_FRAGMENT_PREMUL;
    const float *from = fragment ? s->fragment->rgba : s->state->colors[source - SOURCE_COLOR];
    for (int c = 0; c < 4; c++)
        value[c] = float_bits(source == SOURCE_FRAGMENT_PREMUL && c < 3 ? float_canonical(from[c] * from[3]) : from[c]);
}

// Whether the instruction's d or a is a colour where the opcode takes either kind.
static bool takes_color(const stepper *s, instruction i)
{
    const opcode_row *row = &opcode_table[i.op];
    if (row->d == OPERAND_PLANE || row->a == OPERAND_PLANE)
        return format_table[s->bound->plane_formats[row->d == OPERAND_PLANE ? i.d : i.a]].class == FORMAT_CLASS_COLOR;
    return i.d >= SOURCE_COLOR;
}

static void read_operand(const stepper *s, instruction i, operand_kind kind, int field, uint32_t value[4])
{
    if (kind == OPERAND_SRC || (kind == OPERAND_ASRC && !takes_color(s, i)))
        value[0] = scalar(s, field);
    else if (kind == OPERAND_CSRC || kind == OPERAND_ASRC)
        color(s, field, value);
    else if (kind == OPERAND_PRED)
        value[0] = predicate(s, field);
    else if (kind == OPERAND_PLANE)
        memcpy(value, s->planes[field], 4 * sizeof *value);
}

// ---- Destinations --------------------------------------------------------------------------------------

static void write_scalar(stepper *s, int d, uint32_t value)
{
    s->out->before[0] = s->state->registers[d];
    s->out->after[0] = s->state->registers[d] = value;
}

static void write_color(stepper *s, int d, const uint32_t value[4])
{
    float *to = s->state->colors[d - SOURCE_COLOR];
    for (int c = 0; c < 4; c++) {
        s->out->before[c] = float_bits(to[c]);
        to[c] = bits_float(s->out->after[c] = value[c]);
    }
}

static void write_any(stepper *s, instruction i, const uint32_t value[4])
{
    if (takes_color(s, i))
        write_color(s, i.d, value);
    else
        write_scalar(s, i.d, value[0]);
}

static void write_predicate(stepper *s, int d, bool value)
{
    s->out->before[0] = s->state->predicates[d];
    s->out->after[0] = s->state->predicates[d] = value;
}

static void write_plane(stepper *s, instruction i, const uint32_t value[4])
{
    uint32_t *const plane = s->planes[i.d];
    const int components = takes_color(s, i) ? 4 : 1;
    for (int c = 0; c < components; c++) {
        s->out->before[c] = plane[c];
        plane[c] = components == 1 ? value[c] & s->bound->plane_masks[i.d]
                                   : float_bits(format_round_component(s->bound->plane_formats[i.d], bits_float(value[c])));
        s->out->after[c] = plane[c];
    }
}

// ---- Blending ------------------------------------------------------------------------------------------

static void blend(stepper *s, instruction i)
{
    float source[4], destination[4], blended[4];
    uint32_t value[4];
    for (int c = 0; c < 4; c++) {
        source[c] = bits_float(s->out->a[c]);
        destination[c] = bits_float(s->out->b[c]);
    }
    blend_color(&s->bound->source->blends[i.c], source, destination, blended);
    for (int c = 0; c < 4; c++)
        value[c] = float_bits(blended[c]);
    write_color(s, i.d, value);
}

static void put_component(stepper *s, instruction i, uint32_t component)
{
    uint32_t value[4];
    memcpy(value, s->state->colors[i.d - SOURCE_COLOR], sizeof value);
    value[i.b] = component;
    write_color(s, i.d, value);
}

// ---- Dispatch ------------------------------------------------------------------------------------------

static void execute(stepper *s, instruction i)
{
    const uint32_t *const va = s->out->a, *const vb = s->out->b, a = va[0], b = vb[0];
    const float fa = bits_float(a), fb = bits_float(b);
    switch (i.op) {
    case OP_ld:
    case OP_tex:
    case OP_mov: write_any(s, i, va); break;
    case OP_st: write_plane(s, i, va); break;
    case OP_get: write_scalar(s, i.d, va[i.b]); break;
    case OP_put: put_component(s, i, a); break;
    case OP_eq: write_predicate(s, i.d, a == b); break;
    case OP_ne: write_predicate(s, i.d, a != b); break;
    case OP_lt: write_predicate(s, i.d, a < b); break;
    case OP_ge: write_predicate(s, i.d, a >= b); break;
    case OP_flt: write_predicate(s, i.d, fa < fb); break;
    case OP_fge: write_predicate(s, i.d, fa >= fb); break;
    case OP_pand: write_predicate(s, i.d, a && b); break;
    case OP_por: write_predicate(s, i.d, a || b); break;
    case OP_add: write_scalar(s, i.d, a + b); break;
    case OP_sub: write_scalar(s, i.d, a - b); break;
    case OP_and: write_scalar(s, i.d, a & b); break;
    case OP_xor: write_scalar(s, i.d, a ^ b); break;
    case OP_min: write_scalar(s, i.d, a < b ? a : b); break;
    case OP_max: write_scalar(s, i.d, a < b ? b : a); break;
    case OP_fadd: write_scalar(s, i.d, float_bits(float_canonical(fa + fb))); break;
    case OP_fsub: write_scalar(s, i.d, float_bits(float_canonical(fa - fb))); break;
    case OP_fmul: write_scalar(s, i.d, float_bits(float_canonical(fa * fb))); break;
    case OP_fdiv: write_scalar(s, i.d, float_bits(float_canonical(fa / fb))); break;
    case OP_fpow: write_scalar(s, i.d, execute_fpow(a, b)); break;
    case OP_ftou: write_scalar(s, i.d, execute_ftou(a)); break;
    case OP_utof: write_scalar(s, i.d, execute_utof(a)); break;
    case OP_ztof: write_scalar(s, i.d, execute_ztof((format)i.b, a, s->bound->reversed_depth)); break;
    case OP_blend: blend(s, i); break;
    case OP_skip: s->state->at = a ? s->out->at + i.b : s->state->at; break;
    case OP_count:
    case OPCODE_COUNT: break;
    }
}

bool step_instruction(const bound_program *bound, int kernel, const fragment_input *fragment, uint32_t (*planes)[4],
                      fragment_state *state, stepped *stepped)
{
    const bound_kernel *const code = &bound->kernels[kernel];
    if (state->at >= code->count)
        return false;
    const instruction i = code->words[state->at];
    const opcode_row *const row = &opcode_table[i.op];
    stepper s = {bound, fragment, planes, state, stepped};
    memset(stepped, 0, sizeof *stepped);
    stepped->instruction = i;
    stepped->at = state->at++;
    stepped->executed = predicate(&s, i.guard | i.guard_negated << 3);
    if (!stepped->executed) {
        if (row->d == OPERAND_PRED)
            write_predicate(&s, i.d, false);
        return true;
    }
    read_operand(&s, i, row->a, i.a, stepped->a);
    read_operand(&s, i, row->b, i.b, stepped->b);
    execute(&s, i);
    return true;
}
