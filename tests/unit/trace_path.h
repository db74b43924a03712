// The path of a trace file of a test's own: cmocka_run_group_tests(tests, trace_path_make, trace_path_remove).
#ifndef ROPSIM_TRACE_PATH_H
#define ROPSIM_TRACE_PATH_H

#include <stdlib.h>
#include <unistd.h>

static char trace_path[] = "/tmp/ropsim_test_XXXXXX.ropt";

static int trace_path_make(void **state)
{
    (void)state;
    const int file = mkstemps(trace_path, 5);
    return file < 0 ? -1 : close(file);
}

static int trace_path_remove(void **state)
{
    (void)state;
    return unlink(trace_path);
}

#endif
