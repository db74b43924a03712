// Words and text: the opcode table's own rules, every row and every operand through text -> word -> text, every shipped
// program through text -> words -> text, and damaged words, which are refused and never crash.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "messages.h"

#include <dirent.h>
#include <stdlib.h>

// ---- The tables ------------------------------------------------------------------------------------------

static void test_table(void **state)
{
    (void)state;
    assert_true(OPCODE_COUNT <= 32);
    for (int i = 0; i < OPCODE_COUNT; i++) {
        for (int j = 0; j < i; j++)
            assert_string_not_equal(opcode_table[i].name, opcode_table[j].name);
        assert_true(opcode_table[i].cycles >= 1);
        assert_true(strlen(opcode_table[i].meaning) > 0);
        assert_null(strchr(opcode_table[i].meaning, '|'));  // it becomes a cell of a table
    }
    for (int i = 0; i < FORMAT_COUNT; i++) {
        for (int j = 0; j < i; j++)
            assert_string_not_equal(format_table[i].name, format_table[j].name);
        assert_true(format_table[i].bits % 8 == 0 && format_table[i].bits > 0);
    }
}

// Every field at every value, the others at both ends: no two instructions share a word, and each comes back.
static void test_fields(void **state)
{
    (void)state;
    for (int op = 0; op < OPCODE_COUNT; op++) {
        const opcode_row *row = &opcode_table[op];
        const operand_kind kinds[] = {row->d, row->a, row->b, row->c};
        static const int sizes[] = {32, 64, 64, 64};
        for (int field = 0; field < 4; field++) {
            for (int value = 0; value < sizes[field]; value++) {
                instruction in = {.op = (opcode)op, .guard = 7, .guard_negated = true}, out;
                uint8_t *const fields[] = {&in.d, &in.a, &in.b, &in.c};
                for (int other = 0; other < 4; other++)
                    *fields[other] = kinds[other] == OPERAND_NONE ? 0 : (uint8_t)(value % 2 ? sizes[other] - 1 : 0);
                *fields[field] = (uint8_t)value;
                const bool fits = kinds[field] != OPERAND_NONE || value == 0;
                assert_int_equal(word_decode(word_encode(in), &out), fits);
                if (fits)
                    assert_true(out.op == in.op && out.guard == 7 && out.guard_negated && out.d == in.d &&
                                out.a == in.a && out.b == in.b && out.c == in.c);
            }
        }
        for (int guard = 0; guard < 8; guard++) {
            for (int negated = 0; negated < 2; negated++) {
                const instruction in = {.op = (opcode)op, .guard = (uint8_t)guard, .guard_negated = negated};
                instruction out;
                assert_int_equal(word_decode(word_encode(in), &out), guard != 0 || !negated);  // @!p0 never holds
            }
        }
    }
    instruction out;
    for (uint32_t op = OPCODE_COUNT; op < 32; op++)
        assert_false(word_decode(op << 27, &out));
}

// Any word that decodes encodes to itself: so no bit is without meaning.
static void test_random_words(void **state)
{
    (void)state;
    uint64_t seed = 1;
    int good = 0;
    for (int i = 0; i < 2000000; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        const uint32_t word = (uint32_t)(seed >> 32);
        instruction out;
        if (word_decode(word, &out)) {
            good++;
            assert_int_equal(word_encode(out), word);
        }
    }
    assert_true(good > 1000);
}

// ---- Text and words --------------------------------------------------------------------------------------

static char *text_of(const program *program)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    assert_non_null(stream);
    assert_int_equal(disassemble_text(program, stream), STATUS_OK);
    fclose(stream);
    return text;
}

static program *assembled(const char *text)
{
    static messages said;
    program *program;
    messages_start(&said);
    if (assemble_text("text", text, strlen(text), &said.report, &program) != STATUS_OK)
        fail_msg("%s\n%s", said.text, text);
    return program;
}

// text -> program -> words -> program -> text: all the same. Returns the canonical text.
static char *expect_identity(const char *text)
{
    program *first = assembled(text), *second, *decoded;
    char *canonical = text_of(first);
    second = assembled(canonical);
    char *again = text_of(second);
    assert_string_equal(canonical, again);
    uint32_t *words, *words_again;
    size_t count, count_again;
    assert_int_equal(program_encode(first, &words, &count), STATUS_OK);
    assert_int_equal(program_encode(second, &words_again, &count_again), STATUS_OK);
    assert_int_equal(count, count_again);
    assert_memory_equal(words, words_again, count * sizeof *words);
    static messages said;
    messages_start(&said);
    if (program_decode("words", words, count, &said.report, &decoded) != STATUS_OK)
        fail_msg("%s\n%s", said.text, canonical);
    char *from_words = text_of(decoded);
    assert_string_equal(canonical, from_words);
    free(words);
    free(words_again);
    free(again);
    free(from_words);
    program_destroy(first);
    program_destroy(second);
    program_destroy(decoded);
    return canonical;
}

static const char declarations[] = "program p\nplane z0, z1 depth\nplane s0 stencil\nplane u0 u8\nplane w0 u32\nplane "
                                   "x0 f32\nplane h0 z16\nplane c9 rgba\n"
                                   "plane half rgba16f\nquery q0\nquery q1\nblend b0 rgb add dst_alpha one alpha add "
                                   "zero one_minus_src_alpha composites\n"
                                   "blend b1 rgb min zero zero alpha reverse_subtract src_color dst_color\nlimit "
                                   "iterations 7\nlimit occlusion_ratio 0.25\n"
                                   "output half over c9\n";
enum { CHOICES_MAX = 20 };

// The texts that an operand may be; `color`: where the kind depends on it.
static int choices(operand_kind kind, bool color, bool destination, const char *out[CHOICES_MAX])
{
    static const char *const registers[] = {"r0", "r7", "r15"}, *const colors[] = {"c0", "c7"},
                             *const planes[] = {"z0", "x0", "h0"}, *const color_planes[] = {"c9", "half"},
                             *const queries[] = {"q0", "q1"}, *const blends[] = {"b0", "b1"},
                             *const components[] = {"r", "g", "b", "a"}, *const formats[] = {"z16", "z24", "z32f"},
                             *const labels[] = {"L99"}, *const predicates[] = {"p1", "p7", "p0", "!p0", "!p7"},
                             *const color_sources[] = {"c0", "c7", "color", "premul"},
                             *const sources[] = {
                                 "r0",         "r15", "z",       "z.z16",   "z.z24",         "z.z32f",      "primitive",
                                 "near",       "far", "far.z16", "far.z24", "far.z32f",      "stencil_max", "0",
                                 "4294967295", "1.5", "-0.0",    "1e-45",   "3.4028235e+38", "0.1"};
    const char *const *from = NULL;
    int count = 0;
#define CHOOSE(list) from = list, count = (int)(sizeof list / sizeof list[0])
    switch (kind) {
    case OPERAND_NONE: break;
    case OPERAND_REG: CHOOSE(registers); break;
    case OPERAND_COLOR: CHOOSE(colors); break;
    case OPERAND_ANY:
        if (color)
            CHOOSE(colors);
        else
            CHOOSE(registers);
        break;
    case OPERAND_PRED:
        CHOOSE(predicates);
        if (destination)
            count = 2;
        break;
    case OPERAND_SRC: CHOOSE(sources); break;
    case OPERAND_CSRC: CHOOSE(color_sources); break;
    case OPERAND_ASRC:
        if (color)
            CHOOSE(color_sources);
        else
            CHOOSE(sources);
        break;
    case OPERAND_PLANE:
        if (color)
            CHOOSE(color_planes);
        else
            CHOOSE(planes);
        break;
    case OPERAND_QUERY: CHOOSE(queries); break;
    case OPERAND_BLEND: CHOOSE(blends); break;
    case OPERAND_COMP: CHOOSE(components); break;
    case OPERAND_FORMAT: CHOOSE(formats); break;
    case OPERAND_LABEL: CHOOSE(labels); break;
    }
#undef CHOOSE
    for (int i = 0; i < count; i++)
        out[i] = from[i];
    return count;
}

// One line with the operands chosen, and its place in canonical text.
static void write_instruction(FILE *out, const char *guard, int op, const char *const operands[4])
{
    fprintf(out, "%s %s", guard, opcode_table[op].name);
    const char *separator = " ";
    for (int k = 0; k < 4; k++) {
        if (operands[k])
            fprintf(out, "%s%s", separator, operands[k]);
        separator = operands[k] ? ", " : separator;
    }
    fputc('\n', out);
}

static void expect_instruction(const char *guard, int op, const char *const operands[4])
{
    char *text = NULL, line[256];
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    assert_non_null(stream);
    fprintf(stream, "%skernel k\n", declarations);
    write_instruction(stream, guard, op, operands);
    fprintf(stream, "L99:\nend\nschedule\nend\n");
    fclose(stream);
    char *canonical = expect_identity(text);
    // The instruction reads as it was written; only the label has a name of its own.
    FILE *wanted = fmemopen(line, sizeof line, "w");
    const char *renamed[4];
    for (int k = 0; k < 4; k++)
        renamed[k] = operands[k] && strcmp(operands[k], "L99") == 0 ? "L1" : operands[k];
    write_instruction(wanted, guard, op, renamed);
    fclose(wanted);
    char *found = strstr(canonical, "kernel k\n") + strlen("kernel k\n"), squeezed[256];
    int length = 0;
    for (; *found != '\n'; found++)
        if (*found != ' ' || (length > 0 && squeezed[length - 1] != ' '))
            squeezed[length++] = *found;
    squeezed[length++] = '\n';
    squeezed[length] = 0;
    assert_string_equal(squeezed, line + (line[0] == ' '));
    free(text);
    free(canonical);
}

// Every row, colour and not, with every choice of each operand beside the first choice of the others, under each guard.
static void test_rows(void **state)
{
    (void)state;
    for (int op = 0; op < OPCODE_COUNT; op++) {
        const opcode_row *row = &opcode_table[op];
        const operand_kind kinds[] = {row->d, row->a, row->b, row->c};
        const bool either = row->d == OPERAND_ANY || row->a == OPERAND_ASRC;
        for (int color = 0; color <= (int)either; color++) {
            for (int varied = 0; varied < 4; varied++) {
                const char *list[4][CHOICES_MAX];
                int counts[4];
                for (int k = 0; k < 4; k++)
                    counts[k] = choices(kinds[k], color, k == 0, list[k]);
                for (int choice = 0; choice < counts[varied]; choice++) {
                    const char *operands[4];
                    for (int k = 0; k < 4; k++)
                        operands[k] = counts[k] == 0 ? NULL : list[k][k == varied ? choice : 0];
                    expect_instruction("", op, operands);
                    expect_instruction("@p1", op, operands);
                    expect_instruction("@!p7", op, operands);
                }
            }
        }
    }
}

// ---- Passes and schedules --------------------------------------------------------------------------------

static void test_states(void **state)
{
    (void)state;
    for (int i = 0; i < COMPARE_FUNCTION_COUNT * STENCIL_OPERATION_COUNT; i++) {
        const char *function = compare_function_names[i % COMPARE_FUNCTION_COUNT];
        const int o = i / COMPARE_FUNCTION_COUNT;
        char text[4096];
        snprintf(
            text, sizeof text,
            "%spass k\n clip z >= min(z0, z1)\n clip z = h0\n stencil s0 %s 255 15 %s %s %s write %d\n depth %s z0%s\n"
            " target c9 b1 color\n target half replace premul\n count q1\nend\nschedule\n clear z0 far.z24\n"
            " clear c9 background\n clear half 0 0.5 1 -0.0\n clear u0 3\n clear x0 0.125\n clear s0 stencil_max\n"
            " copy z0 z1\n swap half half\n repeat\n reset q0\n if q1\n draw sorted with k\n end\n"
            " draw unsorted with k\n while q0\nend\n",
            declarations, function, stencil_operation_names[o],
            stencil_operation_names[(o + 1) % STENCIL_OPERATION_COUNT],
            stencil_operation_names[(o + 2) % STENCIL_OPERATION_COUNT], i * 4, function, i % 2 ? " read_only" : "");
        char *canonical = expect_identity(text);
        assert_non_null(strstr(canonical, "clip z >= min(z0, z1)"));
        free(canonical);
    }
    for (int i = 0; i < BLEND_EQUATION_COUNT * BLEND_FACTOR_COUNT; i++) {
        char text[4096];
        snprintf(text, sizeof text,
                 "program p\nplane c rgba\nblend b rgb %s %s %s alpha %s %s %s\noutput c\nschedule\nend\n",
                 blend_equation_names[i % BLEND_EQUATION_COUNT], blend_factor_names[i / BLEND_EQUATION_COUNT],
                 blend_factor_names[(i + 3) % BLEND_FACTOR_COUNT], blend_equation_names[(i + 1) % BLEND_EQUATION_COUNT],
                 blend_factor_names[(i + 5) % BLEND_FACTOR_COUNT], blend_factor_names[(i + 7) % BLEND_FACTOR_COUNT]);
        free(expect_identity(text));
    }
    free(expect_identity("program p\nplane c rgba\nlimit occlusion_ratio -0.0\noutput c\nschedule\nend\n"));
}

// ---- Programs --------------------------------------------------------------------------------------------

// Calls `visit` for each file of programs/.
static int each_program(void (*visit)(const char *path))
{
    DIR *folder = opendir(ROPSIM_SOURCE "/programs");
    assert_non_null(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(folder));) {
        const size_t length = strlen(entry->d_name);
        char path[4096];
        if (length < 4 || strcmp(entry->d_name + length - 4, ".rop") != 0)
            continue;
        snprintf(path, sizeof path, ROPSIM_SOURCE "/programs/%s", entry->d_name);
        visit(path);
        count++;
    }
    closedir(folder);
    return count;
}

static program *program_of(const char *path)
{
    program *program;
    assert_int_equal(assemble_file(path, NULL, &program), STATUS_OK);
    return program;
}

static void visit_identity(const char *path)
{
    program *program = program_of(path);
    char *canonical = text_of(program), *again = expect_identity(canonical);
    assert_string_equal(canonical, again);
    assert_non_null(strstr(path, program->name));  // named as its file
    free(canonical);
    free(again);
    program_destroy(program);
}

static void test_programs(void **state)
{
    (void)state;
    assert_true(each_program(visit_identity) >= 4);
}

// Words that are not the encoder's are refused, or stand for another program, whose words they then are.
static void expect_refused_or_other(const uint32_t *words, size_t count)
{
    program *program;
    if (program_decode("words", words, count, NULL, &program) != STATUS_OK) {
        assert_null(program);
        return;
    }
    uint32_t *again;
    size_t count_again;
    assert_int_equal(program_encode(program, &again, &count_again), STATUS_OK);
    assert_int_equal(count_again, count);
    assert_memory_equal(again, words, count * sizeof *words);
    free(again);
    program_destroy(program);
}

static void visit_damage(const char *path)
{
    program *program = program_of(path), *decoded;
    uint32_t *words;
    size_t count;
    assert_int_equal(program_encode(program, &words, &count), STATUS_OK);
    for (size_t length = 0; length < count; length++) {
        assert_int_equal(program_decode("words", words, length, NULL, &decoded), STATUS_REFUSED);
        assert_null(decoded);
    }
    static const uint32_t flips[] = {1, 1u << 4, 1u << 8, 1u << 15, 1u << 20, 1u << 27, 1u << 31, UINT32_MAX};
    for (size_t at = 0; at < count; at++) {
        for (size_t f = 0; f < sizeof flips / sizeof flips[0]; f++) {
            words[at] ^= flips[f];
            expect_refused_or_other(words, count);
            words[at] ^= flips[f];
        }
    }
    uint32_t *longer = realloc(words, (count + 1) * sizeof *words);
    assert_non_null(longer);
    longer[count] = 0;
    assert_int_equal(program_decode("words", longer, count + 1, NULL, &decoded), STATUS_REFUSED);
    free(longer);
    program_destroy(program);
}

static void test_damage(void **state)
{
    (void)state;
    assert_true(each_program(visit_damage) >= 4);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),  cmocka_unit_test(test_fields), cmocka_unit_test(test_random_words),
        cmocka_unit_test(test_rows),   cmocka_unit_test(test_states), cmocka_unit_test(test_programs),
        cmocka_unit_test(test_damage),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
