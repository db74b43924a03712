// A kernel's lines in, instruction words out.
//
//     [@p1 | @!p1] OPCODE operand, operand...        one instruction
//   name:                                            a label, the target of skips above it
//   end
#include "assemble.h"

#include <string.h>

enum { LABEL_MAX = 64, SKIP_REACH = 63 };

typedef struct label {
    char name[NAME_SIZE];
    int at;
} label;

typedef struct kernel_reader {
    assembler *assembler;
    kernel_decl *kernel;
    label labels[LABEL_MAX];
    int label_count;
    struct { char name[NAME_SIZE]; token token; int word, line; } skips[WORD_MAX];
    int skip_count;
} kernel_reader;

// A token of the form <letter><0..count-1>.
static bool parse_register(token token, char letter, int count, uint8_t *index)
{
    uint64_t number;
    const struct token digits = {token.text + 1, token.length - 1, token.column};
    if (token.length < 2 || token.length > 3 || token.text[0] != letter || !lex_parse_uint(digits, &number) ||
        number >= (uint64_t)count)
        return false;
    *index = (uint8_t)number;
    return true;
}

bool assemble_predicate(lexer *lex, uint8_t *field)
{
    const bool negated = lex_accept(lex, "!");
    uint8_t index;
    if (!parse_register(lex_peek(lex), 'p', PREDICATE_COUNT, &index))
        return lex_error(lex, lex_peek(lex), "expected a predicate, p0 to p%d, with ! in front for its opposite",
                         PREDICATE_COUNT - 1);
    lex_take(lex);
    *field = (uint8_t)(index | negated << 3);
    return true;
}

static bool add_constant(assembler *assembler, value value, uint8_t *field)
{
    program *program = assembler->program;
    int i = 0;
    while (i < program->constant_count && memcmp(&program->constants[i], &value, sizeof value) != 0)
        i++;
    if (i == CONSTANT_MAX)
        return lex_error(&assembler->lex, lex_peek(&assembler->lex), "too many different constants; at most %d in a program",
                         CONSTANT_MAX);
    if (i == program->constant_count)
        program->constants[program->constant_count++] = value;
    *field = (uint8_t)(SOURCE_CONSTANT + i);
    return true;
}

// z, or z.FORMAT
static bool parse_depth_input(token token, uint8_t *field)
{
    if (lex_is(token, "z")) {
        *field = SOURCE_DEPTH;
        return true;
    }
    for (int i = 0; i < FORMAT_COUNT; i++) {
        char name[16];
        snprintf(name, sizeof name, "z.%s", format_table[i].name);
        if (format_table[i].class == FORMAT_CLASS_DEPTH && lex_is(token, name)) {
            *field = (uint8_t)(SOURCE_DEPTH_FORMAT + i);
            return true;
        }
    }
    return false;
}

static bool read_source(kernel_reader *reader, uint8_t *field, bool color)
{
    lexer *lex = &reader->assembler->lex;
    const token token = lex_peek(lex);
    uint8_t index;
    bool fragment_input = false;
    if (color) {
        if (parse_register(token, 'c', COLOR_COUNT, &index)) {
            *field = (uint8_t)(SOURCE_COLOR + index);
        } else if (lex_is(token, "color") || lex_is(token, "premul")) {
            *field = token.text[0] == 'c' ? SOURCE_FRAGMENT_COLOR : SOURCE_FRAGMENT_PREMUL;
            fragment_input = true;
        } else {
            return lex_error(lex, token, "expected a colour: c0 to c%d, color or premul", COLOR_COUNT - 1);
        }
    } else if (parse_register(token, 'r', REGISTER_COUNT, &index)) {
        *field = (uint8_t)(SOURCE_REGISTER + index);
    } else if (lex_is(token, "primitive")) {
        *field = SOURCE_PRIMITIVE;
        fragment_input = true;
    } else if (parse_depth_input(token, field)) {
        fragment_input = true;
    } else {
        value value;
        if (assemble_value(reader->assembler, &value))
            return add_constant(reader->assembler, value, field);
        return lex_error(lex, token,
                         "expected a value: r0 to r%d, z, z.FORMAT, primitive, near, far, far.FORMAT, stencil_max, "
                         "an integer or a float with a '.'",
                         REGISTER_COUNT - 1);
    }
    if (fragment_input && reader->kernel->fullscreen)
        return lex_error(lex, token, "a fullscreen kernel has no fragment");
    lex_take(lex);
    return true;
}

static bool read_component(lexer *lex, uint8_t *field)
{
    static const char *const names[] = {"r", "g", "b", "a"};
    int index;
    if (!lex_lookup(lex, "component", names, 4, &index))
        return false;
    *field = (uint8_t)index;
    return true;
}

static bool read_register(lexer *lex, uint8_t *field, bool color)
{
    uint8_t index;
    if (!parse_register(lex_peek(lex), color ? 'c' : 'r', color ? COLOR_COUNT : REGISTER_COUNT, &index))
        return lex_error(lex, lex_peek(lex), color ? "expected a colour register, c0 to c%d" : "expected a register, r0 to r%d",
                         (color ? COLOR_COUNT : REGISTER_COUNT) - 1);
    lex_take(lex);
    *field = (uint8_t)(color ? SOURCE_COLOR + index : index);
    return true;
}

static bool read_skip_target(kernel_reader *reader, uint8_t *field)
{
    lexer *lex = &reader->assembler->lex;
    const token at = lex_peek(lex);
    *field = 0;
    if (!lex_name(lex, "a label", reader->skips[reader->skip_count].name))
        return false;
    reader->skips[reader->skip_count].token = at;
    reader->skips[reader->skip_count].line = lex->line;
    reader->skips[reader->skip_count].word = reader->kernel->word_count;  // counted once its instruction stands
    return true;
}

static bool read_operand(kernel_reader *reader, operand_kind kind, bool color, uint8_t *field)
{
    assembler *assembler = reader->assembler;
    lexer *lex = &assembler->lex;
    int index;
    bool good = false;
    switch (kind) {
    case OPERAND_NONE: return true;
    case OPERAND_REG: return read_register(lex, field, false);
    case OPERAND_COLOR: return read_register(lex, field, true);
    case OPERAND_ANY: return read_register(lex, field, color);
    case OPERAND_PRED: return assemble_predicate(lex, field);
    case OPERAND_SRC: return read_source(reader, field, false);
    case OPERAND_CSRC: return read_source(reader, field, true);
    case OPERAND_ASRC: return read_source(reader, field, color);
    case OPERAND_COMP: return read_component(lex, field);
    case OPERAND_LABEL: return read_skip_target(reader, field);
    case OPERAND_PLANE: good = assemble_plane(assembler, &index); break;
    case OPERAND_QUERY: good = assemble_query(assembler, &index); break;
    case OPERAND_BLEND: good = assemble_blend(assembler, &index); break;
    case OPERAND_FORMAT: good = assemble_format(assembler, FORMAT_CLASS_DEPTH, &index); break;
    }
    if (good)
        *field = (uint8_t)index;
    return good;
}

// Whether the operands of a ld, tex, st or mov are colours: the plane says so, else the first operand. The plane is the
// first or the third word from here; other words of the line may be spelt as a plane's name.
static bool operands_are_color(const kernel_reader *reader, const opcode_row *row)
{
    const lexer *lex = &reader->assembler->lex;
    const program *program = reader->assembler->program;
    const int at = lex->at + (row->a == OPERAND_PLANE ? 2 : 0);
    if ((row->d == OPERAND_PLANE || row->a == OPERAND_PLANE) && at < lex->token_count) {
        for (int p = 0; p < program->plane_count; p++)
            if (lex_is(lex->tokens[at], program->planes[p].name))
                return plane_is_color(&program->planes[p]);
    }
    uint8_t index;
    return parse_register(lex_peek(lex), 'c', COLOR_COUNT, &index);
}

static bool read_instruction(kernel_reader *reader)
{
    lexer *lex = &reader->assembler->lex;
    kernel_decl *kernel = reader->kernel;
    instruction instruction = {0};
    const token start = lex_peek(lex);
    if (kernel->word_count == WORD_MAX)
        return lex_error(lex, start, "a kernel has at most %d instructions", WORD_MAX);
    if (lex_accept(lex, "@")) {
        uint8_t field;
        if (!assemble_predicate(lex, &field))
            return false;
        instruction.guard = field & 7;
        instruction.guard_negated = field >> 3;
        if (field == 8)
            return lex_error(lex, start, "@!p0 never holds");
    }
    const char *names[OPCODE_COUNT];
    for (int i = 0; i < OPCODE_COUNT; i++)
        names[i] = opcode_table[i].name;
    int op;
    if (!lex_lookup(lex, "opcode", names, OPCODE_COUNT, &op))
        return false;
    instruction.op = (opcode)op;
    const opcode_row *row = &opcode_table[op];
    if (kernel->is_shader && (op == OP_ld || op == OP_st || op == OP_count))
        return lex_error(lex, start, "a shader cannot %s: it reads planes by tex and leaves the rest to its pass", row->name);
    const bool color = operands_are_color(reader, row);
    const struct { operand_kind kind; uint8_t *field; } operands[] = {
        {row->d, &instruction.d}, {row->a, &instruction.a}, {row->b, &instruction.b}, {row->c, &instruction.c}};
    bool first = true;
    for (int i = 0; i < 4; i++) {
        if (operands[i].kind == OPERAND_NONE)
            continue;
        if (!first && !lex_expect(lex, ","))
            return false;
        first = false;
        const token at = lex_peek(lex);
        if (!read_operand(reader, operands[i].kind, color, operands[i].field))
            return false;
        if (i == 0 && row->d == OPERAND_PRED && (instruction.d == 0 || instruction.d > 7))
            return lex_error(lex, at, "a predicate that is written is p1 to p%d", PREDICATE_COUNT - 1);
    }
    if (!lex_finish(lex))
        return false;
    reader->skip_count += instruction.op == OP_skip;
    kernel->word_lines[kernel->word_count] = lex->line;
    kernel->words[kernel->word_count++] = word_encode(instruction);
    return true;
}

static bool read_label(kernel_reader *reader)
{
    lexer *lex = &reader->assembler->lex;
    const token at = lex_peek(lex);
    if (reader->label_count == LABEL_MAX)
        return lex_error(lex, at, "too many labels; at most %d in a kernel", LABEL_MAX);
    label *label = &reader->labels[reader->label_count];
    if (!lex_name(lex, "a label", label->name) || !lex_expect(lex, ":") || !lex_finish(lex))
        return false;
    for (int i = 0; i < reader->label_count; i++)
        if (strcmp(reader->labels[i].name, label->name) == 0)
            return lex_error(lex, at, "label '%s' is there already", label->name);
    label->at = reader->kernel->word_count;
    reader->label_count++;
    return true;
}

static bool resolve_skips(kernel_reader *reader)
{
    lexer *lex = &reader->assembler->lex;
    for (int i = 0; i < reader->skip_count; i++) {
        int target = -1;
        for (int j = 0; j < reader->label_count; j++)
            if (strcmp(reader->labels[j].name, reader->skips[i].name) == 0)
                target = reader->labels[j].at;
        const int word = reader->skips[i].word, distance = target - word;
        const char *const problem = target < 0        ? "is not in this kernel"
                                    : distance < 1    ? "is above: a skip goes forward, so that every kernel ends"
                                    : distance > SKIP_REACH ? "is too far: a skip reaches at most 63 words ahead"
                                                            : NULL;
        if (problem)
            return lex_error_in_line(lex, reader->skips[i].line, reader->skips[i].token, "label '%s' %s",
                                     reader->skips[i].name, problem);
        instruction instruction;
        word_decode(reader->kernel->words[word], &instruction);
        instruction.b = (uint8_t)distance;
        reader->kernel->words[word] = word_encode(instruction);
    }
    return true;
}

bool assemble_kernel(assembler *assembler, kernel_decl *kernel)
{
    lexer *lex = &assembler->lex;
    kernel_reader reader = {.assembler = assembler, .kernel = kernel};
    while (lex_line(lex)) {
        if (lex_accept(lex, "end"))
            return lex_finish(lex) && resolve_skips(&reader);
        const bool is_label = lex->token_count >= 2 && lex_is(lex->tokens[1], ":");
        if (is_label)
            read_label(&reader);
        else
            read_instruction(&reader);
        if (lex->errors >= ERROR_MAX)
            return false;
    }
    return lex_error(lex, lex_peek(lex), "kernel '%s' of line %d has no 'end'", kernel->name, kernel->line);
}
