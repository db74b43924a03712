// The parts of the trace tests, in the order in which a test file goes through them:
//
//   PATH --rtest_find--> files --rtest_load--> lines of words --rtest_parse--> cases, each with its expectations
//   case --rtest_run_file--> results --rtest_check--> failures --rtest_bless--> the file with the figures seen
//
// docs/testing.md is the manual of the format.
#ifndef ROPSIM_RTEST_H
#define ROPSIM_RTEST_H

#include "../sim.h"

// ---- Test files as text (rtest_text.c) -----------------------------------------------------------------

enum { RTEST_BYTES_MAX = 16 << 20, RTEST_WORDS_MAX = 64 };

typedef struct rtest_word {
    const char *text;  // ends with a NUL; without its quotes
    size_t at;         // offset in the file of its first byte, quotes included
    int length, column;
} rtest_word;

typedef struct rtest_text {
    const char *path;
    const report *report;
    char *bytes;    // the file, with a NUL behind it
    char *scratch;  // a copy that words point into
    size_t size;
    size_t next;  // offset of the line to come
    int line;     // number of the current line, from 1
    rtest_word words[RTEST_WORDS_MAX];
    int word_count;
} rtest_text;

status rtest_load(const char *path, const report *report, rtest_text *text);
void rtest_unload(rtest_text *text);
// The next line that has a word; word_count 0: the end.
status rtest_next_line(rtest_text *text);
// Lines up to `end WORD`, which is passed over: their place in `bytes`.
status rtest_take_section(rtest_text *text, const char *word, size_t *begin, size_t *end);
// "path:line:column: " and a message; STATUS_REFUSED. Column 0: behind the last word.
status rtest_refuse(const rtest_text *text, int column, const char *format, ...) PRINTF_LIKE(3, 4);
// Strict readers of a word. They need the C locale in force.
status rtest_read_uint(const rtest_text *text, int word, uint64_t max, uint64_t *value);
status rtest_read_double(const rtest_text *text, int word, double *value);
// Makes \n in a word a newline, in place.
void rtest_unescape(rtest_text *text, int word);
// One more element of `size` bytes, zeroed; NULL: no memory.
void *rtest_add(void *array, int *count, size_t size);

// ---- Cases (rtest_parse.c, rtest_expect.c) -------------------------------------------------------------

typedef enum expect_kind {
#define EXPECT_COUNT(name, value, meaning) EXPECT_##name,
#define EXPECT_FIGURE(name, value, meaning) EXPECT_##name,
#define EXPECT_FLAG(name, value, meaning) EXPECT_##name,
#define EXPECT_BYTES(name, field, meaning) EXPECT_##name,
#define EXPECT_VALUES(name, arguments, meaning) EXPECT_##name,
#define EXPECT_TEXT(name, meaning) EXPECT_##name,
#include "expectations.def"
    EXPECT_KIND_COUNT
} expect_kind;

typedef enum expect_form { FORM_COUNT, FORM_FIGURE, FORM_FLAG, FORM_BYTES, FORM_VALUES, FORM_TEXT } expect_form;

typedef struct expect_row {
    const char *name;
    expect_form form;
    const char *arguments, *meaning;
} expect_row;

extern const expect_row expect_rows[EXPECT_KIND_COUNT];

typedef enum relation { RELATION_EQUAL, RELATION_LESS, RELATION_AT_MOST, RELATION_GREATER, RELATION_AT_LEAST } relation;

// The moment that an expectation looks at: the end, or right after a pass or an iteration.
typedef enum moment_kind { MOMENT_END, MOMENT_PASS, MOMENT_ITERATION } moment_kind;
typedef struct moment {
    moment_kind kind;
    uint64_t number;
} moment;

enum { RTEST_VALUES_MAX = 4, RTEST_FIGURE_SIZE = 32 };

typedef struct expectation {
    int line;
    expect_kind kind;
    bool negated;
    relation relation;
    const char *plane, *text;
    uint32_t x, y, sample;
    bool has_sample;
    uint64_t count;  // FORM_COUNT, FORM_BYTES
    double values[RTEST_VALUES_MAX];
    int value_count;
    rtest_word figures[RTEST_VALUES_MAX];  // the words that --bless may replace
    double tolerance;
    bool has_tolerance;
    moment moment;
} expectation;

// Text that stands in the file, or the name of a file.
typedef struct rtest_source {
    const char *name;  // NULL: in the file
    int line;          // of its keyword; the text begins in the line after it
    size_t begin, end;
} rtest_source;

enum { RTEST_PROGRAMS_MAX = 32, RTEST_REPLACE_MAX = 16, RTEST_SET_MAX = 32 };

typedef struct rtest_settings {
    const char *machine;
    const char *set[RTEST_SET_MAX];
    int set_count;
    uint64_t max_iterations, threads, vector_bytes;
    double occlusion_ratio;  // negative: the program's
} rtest_settings;

// One trace and one or more programs that must all give what is expected; no program: the trace is refused.
typedef struct rtest_case {
    int line;
    int trace;  // in rtest_file.traces
    rtest_source programs[RTEST_PROGRAMS_MAX];
    int program_count;
    struct {
        const char *what, *with;
    } replace[RTEST_REPLACE_MAX];
    int replace_count;
    rtest_settings settings;
    int first_expectation, expectation_count;
} rtest_case;

typedef struct rtest_file {
    rtest_text text;
    rtest_source *traces;
    int trace_count;
    rtest_case *cases;
    int case_count;
    expectation *expectations;
    int expectation_count;
} rtest_file;

status rtest_parse(const char *path, const report *report, rtest_file *file);
void rtest_free(rtest_file *file);  // what rtest_parse filled, also where it failed
// The current line, which begins with `expect`.
status rtest_parse_expectation(rtest_text *text, expectation *expectation);

// ---- Running (rtest_trace.c, rtest_program.c, rtest_run.c) ---------------------------------------------

// A folder's own path joined with a name, as test files name what lies beside them.
status rtest_beside(const char *test_path, const char *name, const report *report, char *path, size_t size);

// Messages of a run, kept. Lines of a temporary trace file are told as lines of the test file.
typedef struct rtest_messages {
    char text[8192];
    bool warned;
    const char *test_path, *temporary_path;
    const int *source_lines;  // of each line of the temporary file, from 1
    int source_line_count;
    report report;
} rtest_messages;

void rtest_messages_start(rtest_messages *messages, const char *test_path);

typedef struct rtest_trace {
    trace *trace;
    char *temporary_path;
    int *source_lines;
} rtest_trace;

status rtest_trace_open(const rtest_file *file, const rtest_source *source, rtest_messages *messages,
                        rtest_trace *trace);
void rtest_trace_close(rtest_trace *trace);
// Writes the fragments that a line `layers ...` stands for; `words` are those of the line.
status rtest_layers_write(const rtest_text *text, FILE *out, int *line_count);

enum { RTEST_PATH_SIZE = 4096 };
// `path`: the file where the program's text is, for messages.
status rtest_program_load(const rtest_file *file, const rtest_case *test, const rtest_source *source,
                          rtest_messages *messages, char path[RTEST_PATH_SIZE], program **program);

// Results of one program of a case.
typedef struct rtest_outcome {
    int line;
    char *name;      // "coherent_layer_peel_a on tiny"
    char *failures;  // "": passed
    int expectation_count;
    double seconds;
} rtest_outcome;

// A figure that --bless may write: the word, and what was seen in its place.
typedef struct rtest_blessing {
    rtest_word word;
    char seen[RTEST_FIGURE_SIZE];
    bool rounded;       // a float: what it rounds to counts, not its digits
    bool failed;        // some program did not see what is expected
    bool contradicted;  // two programs saw different figures
} rtest_blessing;

typedef struct rtest_result {
    const char *path;
    char *refused;  // why the file is no test; NULL: it is one
    rtest_outcome *outcomes;
    int outcome_count;
    rtest_blessing *blessings;
    int blessing_count;
    int blessed;  // figures replaced in the file
} rtest_result;

// Runs all cases of a file. Failures are in the result; STATUS_IO: memory ran out.
status rtest_run_file(const rtest_file *file, rtest_result *result);
void rtest_result_free(rtest_result *result);

// ---- Checking (rtest_check.c, rtest_sample.c, rtest_bless.c) -------------------------------------------

typedef struct rtest_seen {
    char words[RTEST_VALUES_MAX][RTEST_FIGURE_SIZE];
    int count;
    bool passed;
    bool looks_at_sample;  // a failure should show what happened at x, y, sample
    char problem[512];     // where the question itself makes no sense of this run; else ""
} rtest_seen;

void rtest_check(const expectation *expectation, const run_result *run, bool reversed_depth, rtest_seen *seen);
// The text of the file's line, without blanks at its ends.
void rtest_print_line(const rtest_text *text, int line, FILE *out);
// A run that a failure wants to tell about.
typedef struct rtest_scene {
    const program *program;
    const machine *machine;
    trace *trace;
    run_options options;
} rtest_scene;
// What happened at the sample that the expectation looks at: its fragments, and its history up to that moment.
void rtest_print_sample(const rtest_scene *scene, const expectation *expectation, FILE *out);
// Puts what was seen in the place of what was expected. Written aside and renamed.
status rtest_bless(const rtest_text *text, rtest_result *result, const report *report);

// ---- Suites (rtest_find.c, rtest_suite.c) --------------------------------------------------------------

// The test files of paths: files as they are, folders searched for *.rtest, sorted. Free each and the array.
status rtest_find(const char *const *paths, int path_count, const report *report, char ***files, int *file_count);

struct trace_tests {
    char **paths;
    rtest_result *results;
    int count;
    trace_test_totals totals;
};

#endif
