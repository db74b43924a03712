// The assembler's parts, one file a block of the language: declarations in assemble.c, kernels in
// assemble_kernel.c, fixed-function passes in assemble_pass.c, the schedule in assemble_schedule.c.
// Each reads whole lines and returns false after an error was said.
#ifndef ROPSIM_ASSEMBLE_H
#define ROPSIM_ASSEMBLE_H

#include "lex.h"

typedef struct assembler {
    lexer lex;
    program *program;
    bool in_batches;  // the schedule's line stands inside `batches`
} assembler;

// Each reads the lines up to and with the block's `end`.
bool assemble_kernel(assembler *assembler, kernel_decl *kernel);
bool assemble_pass(assembler *assembler, kernel_decl *kernel);
bool assemble_schedule(assembler *assembler);

// The index of a declared name, taken from the line.
bool assemble_plane(assembler *assembler, int *index);
bool assemble_query(assembler *assembler, int *index);
bool assemble_blend(assembler *assembler, int *index);
bool assemble_format(assembler *assembler, format_class class, int *index);
// The colour a fragment brings, `color` or `premul`, as SOURCE_FRAGMENT_*.
bool assemble_fragment_color(assembler *assembler, int *source);
// p0 to p7, ! in front for the opposite: index in the low bits, negation in bit 3.
bool assemble_predicate(lexer *lexer, uint8_t *field);
// A value that both kernels and clears may name; false without a message if the next token is none.
bool assemble_value(assembler *assembler, value *value);

bool plane_is_color(const plane_decl *plane);
// Declared alike, so that their values have one format on every machine.
bool planes_match(const plane_decl *a, const plane_decl *b);

#endif
