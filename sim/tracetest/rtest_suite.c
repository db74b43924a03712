// Files of tests in, all their outcomes out. Threads take whole files; results stay in the order of the files.
#include "rtest.h"

#include <locale.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { THREADS_MAX = 256 };

typedef struct suite {
    trace_tests *tests;
    const trace_test_options *options;
    const report *report;
    atomic_int next, done;
    atomic_int failed;  // a status
    pthread_mutex_t speaking;
} suite;

// Keeps the first thing that parsing says: why the file is no test.
static void keep_refusal(void *user, severity severity, const char *text)
{
    char **refused = user;
    if (severity == SEVERITY_ERROR && !*refused)
        *refused = strdup(text);
}

static status run_one(suite *suite, const char *path, rtest_result *result)
{
    const report parsing = {.say = keep_refusal, .user = &result->refused};
    rtest_file file;
    result->path = path;
    status status = rtest_parse(path, &parsing, &file);
    if (status != STATUS_OK) {
        rtest_free(&file);
        return result->refused ? STATUS_OK : STATUS_IO;
    }
    status = rtest_run_file(&file, result);
    if (status == STATUS_OK && suite->options->bless) {
        pthread_mutex_lock(&suite->speaking);
        status = rtest_bless(&file.text, result, suite->report);
        pthread_mutex_unlock(&suite->speaking);
    }
    rtest_free(&file);
    return status;
}

static void *work(void *context)
{
    suite *suite = context;
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const locale_t before = c ? uselocale(c) : (locale_t)0;
    for (int i; c && (i = atomic_fetch_add(&suite->next, 1)) < suite->tests->count;) {
        const status status = run_one(suite, suite->tests->paths[i], &suite->tests->results[i]);
        if (status != STATUS_OK)
            atomic_store(&suite->failed, (int)status);
        const int done = atomic_fetch_add(&suite->done, 1) + 1;
        pthread_mutex_lock(&suite->speaking);
        report_progress(suite->report, "testing", (uint64_t)done, (uint64_t)suite->tests->count);
        pthread_mutex_unlock(&suite->speaking);
    }
    if (!c)
        atomic_store(&suite->failed, (int)STATUS_IO);
    if (c)
        uselocale(before);
    if (c)
        freelocale(c);
    return NULL;
}

static void work_in_threads(suite *suite, int threads)
{
    pthread_t ids[THREADS_MAX];
    int started = 0;
    threads = threads > THREADS_MAX ? THREADS_MAX : threads;
    for (; started < threads - 1 && started < suite->tests->count; started++)
        if (pthread_create(&ids[started], NULL, work, suite) != 0)
            break;
    work(suite);
    for (int i = 0; i < started; i++)
        pthread_join(ids[i], NULL);
}

static void add_totals(trace_tests *tests)
{
    trace_test_totals *totals = &tests->totals;
    totals->files = (uint64_t)tests->count;
    for (int i = 0; i < tests->count; i++) {
        const rtest_result *result = &tests->results[i];
        totals->failed += result->refused != NULL;
        totals->blessed += (uint64_t)result->blessed;
        for (int k = 0; k < result->outcome_count; k++) {
            const bool passed = !result->outcomes[k].failures[0];
            totals->passed += passed;
            totals->failed += !passed;
            totals->expectations += (uint64_t)result->outcomes[k].expectation_count;
        }
    }
}

status trace_tests_run(const char *const *paths, int path_count, const trace_test_options *options,
                       const report *report, trace_tests **result)
{
    struct timespec start, end;
    *result = NULL;
    trace_tests *tests = calloc(1, sizeof *tests);
    if (!tests)
        return report_error(report, STATUS_IO, "out of memory");
    status status = rtest_find(paths, path_count, report, &tests->paths, &tests->count);
    if (status == STATUS_OK && !(tests->results = calloc((size_t)tests->count + 1, sizeof *tests->results)))
        status = report_error(report, STATUS_IO, "out of memory");
    if (status != STATUS_OK) {
        trace_tests_destroy(tests);
        return status;
    }
    suite suite = {.tests = tests, .options = options, .report = report, .speaking = PTHREAD_MUTEX_INITIALIZER};
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    clock_gettime(CLOCK_MONOTONIC, &start);
    work_in_threads(&suite, options->threads > 0 ? options->threads : (int)processors);
    clock_gettime(CLOCK_MONOTONIC, &end);
    if (atomic_load(&suite.failed)) {
        trace_tests_destroy(tests);
        return report_error(report, (enum status)atomic_load(&suite.failed), "the tests could not be run to their end");
    }
    add_totals(tests);
    tests->totals.seconds = (double)(end.tv_sec - start.tv_sec) + 1e-9 * (double)(end.tv_nsec - start.tv_nsec);
    *result = tests;
    return STATUS_OK;
}

void trace_tests_destroy(trace_tests *tests)
{
    if (!tests)
        return;
    for (int i = 0; i < tests->count; i++) {
        if (tests->results)
            rtest_result_free(&tests->results[i]);
        free(tests->paths[i]);
    }
    free(tests->results);
    free(tests->paths);
    free(tests);
}

const trace_test_totals *trace_tests_totals(const trace_tests *tests)
{
    return &tests->totals;
}
