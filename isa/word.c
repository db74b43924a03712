// The instruction word, drawn once and derived from the drawing:
//
//    31    27 26 25  23 22    18 17     12 11      6 5       0
//   +--------+--+------+--------+---------+---------+---------+
//   | opcode |! | guard|   d    |    a    |    b    |    c    |
//   +--------+--+------+--------+---------+---------+---------+
//      5      1    3       5         6         6         6
//
// A predicate source sits in the low three bits of its field, its negation in bit 3.
#include "isa.h"

enum {
    C_BITS = 6, B_BITS = 6, A_BITS = 6, D_BITS = 5, GUARD_BITS = 3, NEGATED_BITS = 1, OPCODE_BITS = 5,
    C_AT = 0,
    B_AT = C_AT + C_BITS,
    A_AT = B_AT + B_BITS,
    D_AT = A_AT + A_BITS,
    GUARD_AT = D_AT + D_BITS,
    NEGATED_AT = GUARD_AT + GUARD_BITS,
    OPCODE_AT = NEGATED_AT + NEGATED_BITS,
};
_Static_assert(OPCODE_AT + OPCODE_BITS == 32, "the word is 32 bits");
_Static_assert(OPCODE_COUNT <= 1 << OPCODE_BITS, "the opcode field holds every row");

uint32_t word_encode(instruction i)
{
    return (uint32_t)i.op << OPCODE_AT | (uint32_t)i.guard_negated << NEGATED_AT | (uint32_t)i.guard << GUARD_AT |
           (uint32_t)i.d << D_AT | (uint32_t)i.a << A_AT | (uint32_t)i.b << B_AT | (uint32_t)i.c << C_AT;
}

static uint8_t field(uint32_t word, int at, int bits)
{
    return (uint8_t)(word >> at & ((1u << bits) - 1));
}

bool word_decode(uint32_t word, instruction *instruction)
{
    const uint8_t op = field(word, OPCODE_AT, OPCODE_BITS);
    if (op >= OPCODE_COUNT)
        return false;
    instruction->op = (opcode)op;
    instruction->guard_negated = field(word, NEGATED_AT, NEGATED_BITS);
    instruction->guard = field(word, GUARD_AT, GUARD_BITS);
    instruction->d = field(word, D_AT, D_BITS);
    instruction->a = field(word, A_AT, A_BITS);
    instruction->b = field(word, B_AT, B_BITS);
    instruction->c = field(word, C_AT, C_BITS);
    const opcode_row *row = &opcode_table[op];
    return (row->d != OPERAND_NONE || instruction->d == 0) && (row->a != OPERAND_NONE || instruction->a == 0) &&
           (row->b != OPERAND_NONE || instruction->b == 0) && (row->c != OPERAND_NONE || instruction->c == 0) &&
           !(instruction->guard == 0 && instruction->guard_negated);
}
