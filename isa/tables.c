// The tables of the .def files as arrays.
#include "isa.h"

const opcode_row opcode_table[OPCODE_COUNT] = {
#define OPCODE(name, d, a, b, c, unit, cycles, meaning) \
    {#name, OPERAND_##d, OPERAND_##a, OPERAND_##b, OPERAND_##c, UNIT_##unit, cycles, meaning},
#include "opcodes.def"
#undef OPCODE
};

const format_row format_table[FORMAT_COUNT] = {
#define FORMAT(name, class, bits, meaning) {#name, FORMAT_CLASS_##class, bits, meaning},
#include "formats.def"
#undef FORMAT
};

#define COMPARE_FUNCTION(name) #name,
const char *const compare_function_names[COMPARE_FUNCTION_COUNT] = {
#include "states.def"
};
#define STENCIL_OPERATION(name) #name,
const char *const stencil_operation_names[STENCIL_OPERATION_COUNT] = {
#include "states.def"
};
#define BLEND_FACTOR(name) #name,
const char *const blend_factor_names[BLEND_FACTOR_COUNT] = {
#include "states.def"
};
#define BLEND_EQUATION(name) #name,
const char *const blend_equation_names[BLEND_EQUATION_COUNT] = {
#include "states.def"
};

const char *const draw_class_names[CLASS_COUNT] = {"opaque", "transparent", "sorted"};
