// A bound program: what bind.c makes and execute.c runs. Operands are settled to places, so that dispatch
// does nothing but add an offset to a base.
#ifndef ROPSIM_BIND_H
#define ROPSIM_BIND_H

#include "isa.h"

enum { LOWERED_MAX = WORD_MAX, BOUND_CONSTANT_MAX = 192 };

// Where an operand's 64 lanes start: a base of the dispatch, then an offset in words.
enum {
    BASE_STATE,      // the lanes' registers
    BASE_CONSTANT,   // constants, each spread over 64 lanes
    BASE_PRIMITIVE,
    BASE_DEPTH,      // BASE_DEPTH + format: the fragment's depth as a code of that format
    BASE_PLANE = BASE_DEPTH + FORMAT_COUNT,  // BASE_PLANE + plane: the plane itself
    BASE_COUNT = BASE_PLANE + PLANE_MAX,
};

// The lanes' registers, in words.
enum {
    STATE_REGISTERS = 0,
    STATE_COLORS = STATE_REGISTERS + REGISTER_COUNT * TILE_LANES,
    STATE_WORDS = STATE_COLORS + COLOR_COUNT * 4 * TILE_LANES,
};

// Operations of bound code that no word has; they follow the opcodes (shorten.c).
enum { BOUND_BLEND_IN_PLANE = OPCODE_COUNT };

typedef enum color_place { PLACE_STATE, PLACE_STRAIGHT, PLACE_PREMULTIPLIED } color_place;

typedef struct bound_source {
    uint8_t base;       // BASE_*
    uint8_t color;      // color_place, for a colour
    uint16_t offset;    // words
} bound_source;

typedef struct bound_instruction {
    uint8_t op;
    uint8_t guard;      // predicate
    bool guard_negated;
    bool masked;        // lanes outside the guard keep what d holds
    bool writes_predicate;
    bool under;         // a blend by front-to-back compositing
    bool color;         // ld, tex, st, mov of a colour
    bool a_negated, b_negated;  // predicate sources
    uint8_t d, a, b, c;         // as in `instruction`
    uint16_t d_offset;          // REG, COLOR: words into the state
    bound_source source_a, source_b;
} bound_instruction;

typedef struct bound_kernel {
    bound_instruction code[LOWERED_MAX];
    instruction words[LOWERED_MAX];
    uint8_t stages[LOWERED_MAX];           // pass_stage of each word
    uint32_t zero_registers, zero_colors;  // bit i: must start as zero, since it may be read before it is written
    int count;
    bool has_skip;
} bound_kernel;

struct bound_program {
    const program *source;
    rop_limits limits;
    bool reversed_depth;
    float background[4];
    format plane_formats[PLANE_MAX];
    uint32_t plane_masks[PLANE_MAX];
    uint32_t constants[BOUND_CONSTANT_MAX];
    int constant_count;
    bool constants_full;  // some pass needed one more
    bound_kernel *kernels;
    uint32_t (*constant_lanes)[TILE_LANES];
    uint32_t depth_formats;
    uint32_t sources;  // bit s: some kernel reads source s, below SOURCE_CONSTANT
};

// Whether an operand of this kind reads a value, or names a register to write.
static inline bool operand_is_source(operand_kind kind)
{
    return kind == OPERAND_SRC || kind == OPERAND_CSRC || kind == OPERAND_ASRC;
}

static inline bool operand_is_register(operand_kind kind)
{
    return kind == OPERAND_REG || kind == OPERAND_COLOR || kind == OPERAND_ANY;
}

// Lowers a declared pass to instructions and says of each which stage of the pass it belongs to, adding the constants
// it needs to `bound`. False: too long.
bool lower_pass(bound_program *bound, const pass_decl *pass, instruction *words, uint8_t *stages, int *count);
// Makes the bound kernel do less for the same outcome and the same counts.
void shorten_kernel(bound_kernel *kernel);
// The source operand of a constant with this value; shares equal ones.
uint8_t bind_constant(bound_program *bound, uint32_t bits);
uint32_t bind_value(const bound_program *bound, const value *value);

#endif
