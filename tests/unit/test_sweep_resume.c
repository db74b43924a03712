// Sweeps that are killed: at random moments, again and again, and each time started anew, they end with the rows of one
// that ran through. And a run whose process is killed costs that run alone, which the next call does.
#include "sweep_fixture.h"

#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

// 2 traces x 3 programs x 2 machines x 2 x 3 settings.
static const char function_text[] = "results: sweep.db\n"
                                    "traces:\n"
                                    "  - record scene:knot,rings=64 size=96x96\n"
                                    "  - record scene:sheets,count=24,order=shuffled size=24x24\n"
                                    "programs: [layer_peel, coherent_layer_peel_a, ideal_coherent_layer_peel]\n"
                                    "machines: [g80, programmable]\n"
                                    "set:\n"
                                    "  depth_format: [z16, z24]\n"
                                    "  stencil_bits: 6..8\n";
// 1 trace x 3 levels x 2 programs x 2 machines x 3 settings.
static const char cycle_text[] = "results: sweep.db\n"
                                 "traces: record scene:knot,rings=24 size=48x48\n"
                                 "programs: [layer_peel, ideal_coherent_layer_peel]\n"
                                 "machines: [g80, tiled]\n"
                                 "detail: [cycle, function, traffic]\n"
                                 "set: {cache_misses_max: 1..4*2}\n";
enum { FUNCTION_COMBINATIONS = 72, CYCLE_COMBINATIONS = 36, KILLS_MAX = 20, JOBS = 2 };

static int run_whole(const char *file, int jobs)
{
    sweep *sweep = NULL;
    sweep_totals totals;
    status status = sweep_open(file, NULL, &sweep);
    if (status == STATUS_OK)
        status = sweep_run(sweep, jobs, &totals);
    sweep_close(sweep);
    return (int)status;
}

static pid_t start_sweep(const char *file, int jobs)
{
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0)
        _exit(run_whole(file, jobs));
    return pid;
}

static void kill_and_go_on(const char *file_text, int combinations)
{
    sweep_fixture whole, killed;
    sweep_fixture_start(&whole, file_text);
    sweep_fixture_start(&killed, file_text);
    struct timespec from, to;
    clock_gettime(CLOCK_MONOTONIC, &from);
    assert_int_equal(run_whole(whole.file, JOBS), STATUS_OK);
    clock_gettime(CLOCK_MONOTONIC, &to);
    const long whole_us = (to.tv_sec - from.tv_sec) * 1000000 + (to.tv_nsec - from.tv_nsec) / 1000;
    unsigned seed = (unsigned)getpid();
    int kills = 0, between = 0;
    print_message("seed %u\n", seed);
    for (bool ended = false; !ended;) {
        int how = 0;
        const pid_t pid = start_sweep(killed.file, JOBS);
        if (kills < KILLS_MAX) {
            usleep((useconds_t)(whole_us / 20 + rand_r(&seed) % (whole_us / 5 + 1)));
            kill(pid, SIGKILL);
        }
        assert_int_equal(waitpid(pid, &how, 0), pid);
        ended = WIFEXITED(how);
        if (ended)
            assert_int_equal(WEXITSTATUS(how), STATUS_OK);
        kills += !ended;
        if (!ended && access(killed.database, F_OK) == 0) {
            sqlite3 *database = sweep_fixture_open(killed.database);
            sqlite3_stmt *statement = NULL;
            // Killed before the tables were made, there are none.
            if (sqlite3_prepare_v2(database, "SELECT count(*) FROM runs", -1, &statement, NULL) == SQLITE_OK &&
                sqlite3_step(statement) == SQLITE_ROW) {
                const int count = sqlite3_column_int(statement, 0);
                between += count > 0 && count < combinations;
            }
            sqlite3_finalize(statement);
            sqlite3_close(database);
        }
    }
    print_message("%d kills, %d of them between the first and the last run\n", kills, between);
    assert_true(between >= 1);
    char *wanted = sweep_fixture_content(whole.database), *found = sweep_fixture_content(killed.database);
    assert_string_equal(found, wanted);
    assert_int_equal(sweep_fixture_number(killed.database, "SELECT count(*) FROM runs"), combinations);
    assert_int_equal(
        sweep_fixture_number(killed.database, "SELECT count(*) FROM planes WHERE run NOT IN (SELECT id FROM runs)"), 0);
    free(wanted);
    free(found);
    sweep_fixture_end(&whole);
    sweep_fixture_end(&killed);
}

static void killed_sweeps_go_on(void **state)
{
    (void)state;
    kill_and_go_on(function_text, FUNCTION_COMBINATIONS);
}

static void killed_sweeps_of_all_levels_go_on(void **state)
{
    (void)state;
    kill_and_go_on(cycle_text, CYCLE_COMBINATIONS);
}

static pid_t sweeping;  // the process that holds the database

static void die_in_worker(int signal)
{
    (void)signal;
    if (getpid() != sweeping)
        raise(SIGKILL);
}

// The first progress comes right after the first worker was started.
static void signal_once(void *user, const char *what, uint64_t done, uint64_t total)
{
    bool *sent = user;
    (void)what, (void)done, (void)total;
    if (!*sent)
        kill(0, SIGUSR1);
    *sent = true;
}

static int run_with_one_killed(const char *file, sweep_totals *totals)
{
    bool sent = false;
    const report report = {.progress = signal_once, .user = &sent};
    sweep *sweep = NULL;
    setpgid(0, 0);
    sweeping = getpid();
    signal(SIGUSR1, die_in_worker);
    status status = sweep_open(file, &report, &sweep);
    if (status == STATUS_OK)
        status = sweep_run(sweep, 1, totals);
    sweep_close(sweep);
    return (int)status;
}

static void a_killed_worker_is_a_failed_run(void **state)
{
    (void)state;
    sweep_fixture f;
    int how = 0;
    sweep_fixture_start(&f, "results: sweep.db\n"
                            "traces: record scene:sheets,count=64,order=shuffled size=64x64\n"
                            "programs: [layer_peel, ideal_coherent_layer_peel]\n"
                            "machines: programmable\n");
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid == 0) {
        sweep_totals totals;
        const int status = run_with_one_killed(f.file, &totals);
        _exit(status == STATUS_OK && totals.failed == 1 && totals.done == 1 ? 0 : 1);
    }
    assert_int_equal(waitpid(pid, &how, 0), pid);
    assert_true(WIFEXITED(how) && WEXITSTATUS(how) == 0);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE outcome = 'failed' AND"
                                                      " program = 'layer_peel' AND why LIKE '%signal 9%'"),
                     1);
    sweep *sweep = NULL;
    sweep_totals totals;
    assert_int_equal(sweep_open(f.file, NULL, &sweep), STATUS_OK);
    assert_int_equal(sweep_run(sweep, 1, &totals), STATUS_OK);
    assert_int_equal(totals.there, 1);
    assert_int_equal(totals.done, 1);
    sweep_close(sweep);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE outcome = 'done'"), 2);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs"), 2);
    sweep_fixture_end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(killed_sweeps_go_on),
        cmocka_unit_test(killed_sweeps_of_all_levels_go_on),
        cmocka_unit_test(a_killed_worker_is_a_failed_run),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
