// Outcomes as text: for people, and in the Test Anything Protocol (version 13).
#include "rtest.h"

#include <inttypes.h>
#include <string.h>

static int count_failed(const rtest_result *result)
{
    int failed = result->refused != NULL;
    for (int i = 0; i < result->outcome_count; i++)
        failed += result->outcomes[i].failures[0] != 0;
    return failed;
}

status trace_tests_print(const trace_tests *tests, FILE *out)
{
    const trace_test_totals *totals = &tests->totals;
    for (int i = 0; i < tests->count; i++) {
        const rtest_result *result = &tests->results[i];
        const int failed = count_failed(result), count = result->outcome_count;
        fprintf(out, "%s %s  %d run%s", failed ? "FAIL" : "ok  ", result->path, count, count == 1 ? "" : "s");
        if (result->blessed)
            fprintf(out, ", figures replaced: %d", result->blessed);
        fputc('\n', out);
        if (result->refused)
            fprintf(out, "    %s\n", result->refused);
        for (int k = 0; k < count; k++)
            if (result->outcomes[k].failures[0])
                fprintf(out, "  %s:\n%s", result->outcomes[k].name, result->outcomes[k].failures);
    }
    fprintf(out, "files: %" PRIu64 ", expectations: %" PRIu64 ", %.2f s\n", totals->files, totals->expectations,
            totals->seconds);
    if (totals->blessed)
        fprintf(out, "expected figures replaced by those seen: %" PRIu64 "; run the tests again\n", totals->blessed);
    fprintf(out, "%" PRIu64 " passed, %" PRIu64 " failed\n", totals->passed, totals->failed);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

static void print_comment(const char *text, FILE *out)
{
    for (const char *line = text; *line;) {
        const int length = (int)strcspn(line, "\n");
        fprintf(out, "# %.*s\n", length, line);
        line += length + (line[length] == '\n');
    }
}

static void print_tap_point(bool passed, uint64_t number, const char *path, int line, const char *name, FILE *out)
{
    fprintf(out, "%sok %" PRIu64 " - %s:%d ", passed ? "" : "not ", number, path, line);
    // A # would begin a directive.
    for (; *name; name++)
        fputc(*name == '#' ? '_' : *name, out);
    fputc('\n', out);
}

status trace_tests_print_tap(const trace_tests *tests, FILE *out)
{
    uint64_t number = 0;
    fprintf(out, "TAP version 13\n1..%" PRIu64 "\n", tests->totals.passed + tests->totals.failed);
    for (int i = 0; i < tests->count; i++) {
        const rtest_result *result = &tests->results[i];
        if (result->refused) {
            print_tap_point(false, ++number, result->path, 1, "is no test", out);
            print_comment(result->refused, out);
        }
        for (int k = 0; k < result->outcome_count; k++) {
            const rtest_outcome *outcome = &result->outcomes[k];
            print_tap_point(!outcome->failures[0], ++number, result->path, outcome->line, outcome->name, out);
            print_comment(outcome->failures, out);
        }
    }
    fprintf(out, "# %" PRIu64 " passed, %" PRIu64 " failed\n", tests->totals.passed, tests->totals.failed);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

status trace_tests_print_expectations(FILE *out)
{
    for (int i = 0; i < EXPECT_KIND_COUNT; i++)
        fprintf(out, "expect %s%s%s%s\n    %s\n", expect_rows[i].form == FORM_FLAG ? "[not] " : "", expect_rows[i].name,
                expect_rows[i].arguments[0] ? " " : "", expect_rows[i].arguments, expect_rows[i].meaning);
    fputs("\nRELATION is =, <, <=, > or >=; = where none stands. Behind the values: `sample S`, `tolerance T` (1e-5 "
          "for floats),\n"
          "`after pass N` or `after iteration N`. A depth may be near or far.\n",
          out);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
