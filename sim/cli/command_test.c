// `ropsim test`: runs trace tests; prints one line a file and failures in full, or TAP; writes JUnit XML.
#include "command.h"

#include <stdlib.h>

enum { ROW_THREADS, ROW_TAP, ROW_JUNIT, ROW_BLESS, ROW_EXPECTATIONS };
static const command_option option_rows[] = {
    [ROW_THREADS] = {"threads", 0, "N", "test files at once; default 0: one a processor"},
    [ROW_TAP] = {"tap", 0, NULL, "print in the Test Anything Protocol"},
    [ROW_JUNIT] = {"junit", 0, "FILE", "write the outcomes as JUnit XML as well"},
    [ROW_BLESS] = {"bless", 0, NULL, "replace expected figures that were not met by those seen, in the test files"},
    [ROW_EXPECTATIONS] = {"expectations", 0, NULL, "list what a test can expect, and end"},
    {0},
};

typedef struct test_words {
    const char **paths;
    int path_count;
    trace_test_options options;
    const char *junit;
    bool tap, expectations;
} test_words;

// Takes all words; STATUS_OK, or the exit code in *code.
static bool take_words(int argc, char **argv, test_words *words, status *code)
{
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        *code = option == COMMAND_HELP ? STATUS_OK : STATUS_USAGE;
        switch (option) {
        case COMMAND_HELP:
        case COMMAND_ERROR: return false;
        case COMMAND_OPERAND: words->paths[words->path_count++] = line.value; break;
        case ROW_THREADS:
            if (!command_threads(line.value, &words->options.threads))
                return false;
            break;
        case ROW_TAP: words->tap = true; break;
        case ROW_JUNIT: words->junit = line.value; break;
        case ROW_BLESS: words->options.bless = true; break;
        case ROW_EXPECTATIONS: words->expectations = true; break;
        default: break;
        }
    }
    return true;
}

static status run_tests(const test_words *words)
{
    trace_tests *tests = NULL;
    status status = trace_tests_run(words->paths, words->path_count, &words->options, &command_report, &tests);
    if (status != STATUS_OK)
        return status;
    status = words->tap ? trace_tests_print_tap(tests, stdout) : trace_tests_print(tests, stdout);
    if (status == STATUS_OK && words->junit)
        status = trace_tests_write_junit(tests, words->junit, &command_report);
    if (status == STATUS_OK && trace_tests_totals(tests)->failed > 0)
        status = STATUS_REFUSED;
    trace_tests_destroy(tests);
    return status;
}

int command_test(int argc, char **argv)
{
    status status = STATUS_OK;
    test_words words = {.paths = calloc((size_t)argc + 1, sizeof *words.paths)};
    if (!words.paths)
        return (int)report_error(&command_report, STATUS_IO, "out of memory");
    if (take_words(argc, argv, &words, &status)) {
        if (words.expectations)
            status = trace_tests_print_expectations(stdout);
        else if (words.path_count == 0)
            status = command_usage("test", "test files or folders of them are wanted");
        else
            status = run_tests(&words);
    }
    free(words.paths);
    return (int)status;
}
