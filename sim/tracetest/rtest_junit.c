// Outcomes as JUnit XML: a testsuite a file, a testcase a run.
#include "rtest.h"

#include <inttypes.h>

// Bytes that XML 1.0 cannot hold become `?`.
static void print_escaped(const char *text, FILE *out)
{
    for (; *text; text++) {
        switch (*text) {
        case '<': fputs("&lt;", out); break;
        case '>': fputs("&gt;", out); break;
        case '&': fputs("&amp;", out); break;
        case '"': fputs("&quot;", out); break;
        default: fputc((unsigned char)*text < ' ' && *text != '\n' && *text != '\t' ? '?' : *text, out);
        }
    }
}

static void print_case(const char *path, int line, const char *name, double seconds, const char *failures, FILE *out)
{
    fputs("    <testcase classname=\"", out);
    print_escaped(path, out);
    fprintf(out, "\" name=\"line %d: ", line);
    print_escaped(name, out);
    fprintf(out, "\" time=\"%.6f\"", seconds);
    if (!failures[0]) {
        fputs("/>\n", out);
        return;
    }
    fputs(">\n      <failure message=\"expected something else\">", out);
    print_escaped(failures, out);
    fputs("</failure>\n    </testcase>\n", out);
}

static void print_suite(const rtest_result *result, FILE *out)
{
    int failed = result->refused != NULL;
    double seconds = 0;
    for (int k = 0; k < result->outcome_count; k++) {
        failed += result->outcomes[k].failures[0] != 0;
        seconds += result->outcomes[k].seconds;
    }
    fputs("  <testsuite name=\"", out);
    print_escaped(result->path, out);
    fprintf(out, "\" tests=\"%d\" failures=\"%d\" time=\"%.6f\">\n", result->outcome_count + (result->refused != NULL),
            failed, seconds);
    if (result->refused)
        print_case(result->path, 1, "is no test", 0, result->refused, out);
    for (int k = 0; k < result->outcome_count; k++) {
        const rtest_outcome *outcome = &result->outcomes[k];
        print_case(result->path, outcome->line, outcome->name, outcome->seconds, outcome->failures, out);
    }
    fputs("  </testsuite>\n", out);
}

status trace_tests_write_junit(const trace_tests *tests, const char *path, const report *report)
{
    aside *aside = NULL;
    FILE *out = NULL;
    const status status = aside_open(path, report, &aside, &out);
    if (status != STATUS_OK)
        return status;
    fprintf(out,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"%" PRIu64 "\" failures=\"%" PRIu64
            "\" time=\"%.6f\">\n",
            tests->totals.passed + tests->totals.failed, tests->totals.failed, tests->totals.seconds);
    for (int i = 0; i < tests->count; i++)
        print_suite(&tests->results[i], out);
    fputs("</testsuites>\n", out);
    return aside_finish(aside);
}
