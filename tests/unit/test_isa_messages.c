// What the assembler refuses and what it says: over a hundred texts beside their messages, and the limits of the
// language.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "messages.h"

#include <stdlib.h>

// Lines 1 to 8 of a kernel or pass under test; its first line is line 10.
#define DECLARATIONS \
    "program p\nplane z0 depth\nplane h0 z16\nplane s0 stencil\nplane col rgba\nquery q\n" \
    "blend b rgb add one zero alpha add one zero\noutput col\n"
#define TEXT(text) text
#define KERNEL(lines) DECLARATIONS "kernel k\n" lines "end\nschedule\nend\n"
#define FULLSCREEN(lines) DECLARATIONS "kernel k fullscreen\n" lines "end\nschedule\nend\n"
#define PASS(lines) DECLARATIONS "pass k\n" lines "end\nschedule\nend\n"
#define SCHEDULE(lines) DECLARATIONS "kernel k\nend\nkernel f fullscreen\nend\nschedule\n" lines "end\n"

#define LINES_4(line) line line line line
#define LINES_9(line) LINES_4(line) LINES_4(line) line
#define LINES_16(line) LINES_4(line) LINES_4(line) LINES_4(line) LINES_4(line)
#define LINES_17(line) LINES_16(line) line
#define LINES_63(line) \
    LINES_16(line) LINES_16(line) LINES_16(line) LINES_4(line) LINES_4(line) LINES_4(line) line line line
#define LETTERS_64 "nnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnnn"

static const struct error_case {
    const char *text, *messages;
} cases[] = {
#define CASE(text, messages) {text, messages},
#include "assemble_errors_frame.def"
#include "assemble_errors_kernel.def"
#undef CASE
};

static void test_messages(void **state)
{
    (void)state;
    static messages said;
    int failures = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        program *program;
        messages_start(&said);
        const status status = assemble_text("p.rop", cases[i].text, strlen(cases[i].text), &said.report, &program);
        if (status == STATUS_REFUSED && !program && strcmp(said.text, cases[i].messages) == 0)
            continue;
        failures++;
        print_error("--- text:\n%s--- said:\n%s--- expected:\n%s", cases[i].text, said.text, cases[i].messages);
        program_destroy(program);
    }
    assert_int_equal(failures, 0);
}

// ---- Limits: as many as there may be, then one more ------------------------------------------------------

typedef struct text {
    char *bytes;
    size_t size;
    FILE *stream;
} text;

static void text_open(text *t)
{
    t->stream = open_memstream(&t->bytes, &t->size);
    assert_non_null(t->stream);
}

static status text_assemble(text *t, messages *said, program **program)
{
    fclose(t->stream);
    messages_start(said);
    const status status = assemble_text("p.rop", t->bytes, t->size, &said->report, program);
    free(t->bytes);
    return status;
}

// `count` lines, each made of `format` with its number, inside the block `open` .. `close` (both may be empty).
static void expect_limit(const char *open, const char *format, const char *close, int count, const char *message)
{
    static messages said;
    for (int extra = 0; extra < 2; extra++) {
        text t;
        program *program;
        text_open(&t);
        fprintf(t.stream, DECLARATIONS "%s", open);
        for (int i = 0; i < count + extra; i++) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
            fprintf(t.stream, format, i, i);
#pragma GCC diagnostic pop
        }
        fprintf(t.stream, "%s", close);
        const status status = text_assemble(&t, &said, &program);
        if (status != (extra ? STATUS_REFUSED : STATUS_OK) || (extra && !strstr(said.text, message)))
            fail_msg("%d of '%s': %s", count + extra, format, said.text);
        program_destroy(program);
    }
}

static void test_limits(void **state)
{
    (void)state;
    const char *end = "schedule\nend\n", *kernel_end = "end\nschedule\nend\n";
    expect_limit("", "plane x%d depth\n", end, PLANE_MAX - 4, "too many planes; at most 32");
    expect_limit("", "query x%d\n", end, QUERY_MAX - 1, "too many queries; at most 8");
    expect_limit("", "blend x%d rgb add one zero alpha add one zero\n", end, BLEND_MAX - 1,
                 "too many blend states; at most 32");
    expect_limit("", "kernel x%d\nend\n", end, KERNEL_MAX, "too many kernels; at most 64");
    expect_limit("", "pass x%d\nend\n", end, KERNEL_MAX, "too many kernels; at most 64");
    expect_limit("kernel k\n", "mov r0, %d\n", kernel_end, CONSTANT_MAX,
                 "too many different constants; at most 32 in a program");
    expect_limit("kernel k\n", "count q # %d\n", kernel_end, WORD_MAX, "a kernel has at most 256 instructions");
    expect_limit("kernel k\n", "skip p1, l%d\nl%d:\n", kernel_end, 64, "too many labels; at most 64");
    expect_limit("schedule\n", "reset q # %d\n", "end\n", STEP_MAX, "too many steps; at most 1024");
}

// A skip is refused like any other instruction when it is one too many, and is not dropped in silence.
static void test_skip_too_many(void **state)
{
    (void)state;
    static messages said;
    text t;
    program *program;
    text_open(&t);
    fprintf(t.stream, DECLARATIONS "kernel k\n");
    for (int i = 0; i < WORD_MAX; i++)
        fprintf(t.stream, "count q\n");
    fprintf(t.stream, "skip p1, done\ndone:\nend\nschedule\nend\n");
    assert_int_equal(text_assemble(&t, &said, &program), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "p.rop:266:1: a kernel has at most 256 instructions"));
}

// Refused skips do not take the room of others: 19 of them, then a kernel full of good ones.
static void test_refused_skips(void **state)
{
    (void)state;
    static messages said;
    text t;
    program *program;
    text_open(&t);
    fprintf(t.stream, DECLARATIONS "kernel k\n");
    for (int i = 0; i < 19; i++)
        fprintf(t.stream, "skip p1, done junk\n");
    for (int i = 0; i < WORD_MAX; i++)
        fprintf(t.stream, "skip p1, done\n");
    fprintf(t.stream, "end\nschedule\nend\n");
    assert_int_equal(text_assemble(&t, &said, &program), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "label 'done' is not in this kernel"));
}

// After twenty messages there is nothing new to learn.
static void test_twenty_messages(void **state)
{
    (void)state;
    static messages said;
    text t;
    program *program;
    text_open(&t);
    for (int i = 0; i < 100; i++)
        fprintf(t.stream, "nonsense %d\n", i);
    assert_int_equal(text_assemble(&t, &said, &program), STATUS_REFUSED);
    assert_int_equal(said.count, 20);
}

static void test_bytes(void **state)
{
    (void)state;
    static messages said;
    static char huge[(1 << 20) + 1];
    program *program;
    messages_start(&said);
    assert_int_equal(assemble_text("p.rop", "program p\n\0", 11, &said.report, &program), STATUS_REFUSED);
    assert_string_equal(said.text, "p.rop: holds a NUL byte; a program is text\n");

    // A program of 1 MiB exactly, most of it a comment, stands; a byte more is refused.
    const char program_text[] = DECLARATIONS "schedule\nend\n#";
    memset(huge, '-', sizeof huge);
    memcpy(huge, program_text, sizeof program_text - 1);
    assert_int_equal(assemble_text("p.rop", huge, sizeof huge - 1, NULL, &program), STATUS_OK);
    program_destroy(program);
    messages_start(&said);
    assert_int_equal(assemble_text("p.rop", huge, sizeof huge, &said.report, &program), STATUS_REFUSED);
    assert_string_equal(said.text, "p.rop: a program is at most 1048576 bytes\n");

    // One word of a MiB: the message shows its beginning.
    memset(huge, 'x', sizeof huge);
    messages_start(&said);
    assert_int_equal(assemble_text("p.rop", huge, sizeof huge - 1, &said.report, &program), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "p.rop:1:1: expected a statement"));
    assert_true(strlen(said.text) < 512);

    // A line of many words: the caret stops at the end of what is shown.
    for (size_t i = 0; i < 512; i++)
        huge[i] = i % 2 ? ' ' : 'y';
    memcpy(huge, "program p ", 10);
    messages_start(&said);
    assert_int_equal(assemble_text("p.rop", huge, 512, &said.report, &program), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "p.rop:1:135: too many words in one line; at most 64"));

    // Carriage returns are white space; the last line needs no end.
    const char dos[] = "program p\r\nplane c rgba\r\noutput c\r\nschedule\r\nend";
    assert_int_equal(assemble_text("p.rop", dos, sizeof dos - 1, NULL, &program), STATUS_OK);
    program_destroy(program);
    assert_int_equal(assemble_text("p.rop", NULL, 0, NULL, &program), STATUS_REFUSED);
    assert_null(program);
}

// Nested loops without a line in them write nothing, but end all the same.
static void test_idle_loops(void **state)
{
    (void)state;
    static messages said;
    static const char source[] = "program p\nfor a in 0..1000000\nfor b in 0..1000000\nendfor\nendfor\n";
    program *program;
    messages_start(&said);
    assert_int_equal(assemble_text("p.rop", source, sizeof source - 1, &said.report, &program), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "the loops have more than 1048576 turns in all"));
}

// A loop that the text leaves open is named where it starts, whatever the last line is.
static void test_open_loops(void **state)
{
    (void)state;
    static messages said;
    static const char *const ends[] = {"", "\n", "# a comment\n", "plane z{i} depth\n", "for j in 0..2\nendfor\n\n"};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++) {
        char source[128];
        const int size = snprintf(source, sizeof source, "program p\n  for i in 0..2\n%s", ends[i]);
        program *program;
        messages_start(&said);
        assert_int_equal(assemble_text("p.rop", source, (size_t)size, &said.report, &program), STATUS_REFUSED);
        assert_string_equal(said.text, "p.rop:2:7: this 'for' has no 'endfor'\n      for i in 0..2\n          ^\n");
    }
}

static void test_files(void **state)
{
    (void)state;
    static messages said;
    program *program;
    messages_start(&said);
    assert_int_equal(assemble_file("/nonexistent/p.rop", &said.report, &program), STATUS_IO);
    assert_string_equal(said.text, "/nonexistent/p.rop: No such file or directory\n");
    assert_null(program);
    messages_start(&said);
    assert_int_equal(assemble_file("/", &said.report, &program), STATUS_IO);
    assert_string_equal(said.text, "/: could not be read\n");
    program_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_messages),        cmocka_unit_test(test_limits),
        cmocka_unit_test(test_skip_too_many),   cmocka_unit_test(test_refused_skips),
        cmocka_unit_test(test_twenty_messages), cmocka_unit_test(test_bytes),
        cmocka_unit_test(test_idle_loops),      cmocka_unit_test(test_open_loops),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
