// Sweeps that are killed: at random moments, again and again, and each time started anew, they end with the rows of one
// that ran through. And a worker that is killed costs the run that it had alone, which the next call does; without one,
// nothing.
#include "sweep_fixture.h"

#include "../../sim/sweep/sweep.h"

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

static void assert_same_rows(const sweep_fixture *killed, const sweep_fixture *whole, int combinations)
{
    char *wanted = sweep_fixture_content(whole->database), *found = sweep_fixture_content(killed->database);
    assert_string_equal(found, wanted);
    assert_int_equal(sweep_fixture_number(killed->database, "SELECT count(*) FROM runs"), combinations);
    assert_int_equal(
        sweep_fixture_number(killed->database, "SELECT count(*) FROM planes WHERE run NOT IN (SELECT id FROM runs)"),
        0);
    free(wanted);
    free(found);
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
    long least_us = whole_us / 20;  // longer after a kill before any run: a loaded machine may take so long to begin
    int kills = 0, between = 0, before = 0;
    print_message("seed %u\n", seed);
    for (bool ended = false; !ended;) {
        int how = 0;
        const pid_t pid = start_sweep(killed.file, JOBS);
        if (kills < KILLS_MAX) {
            usleep((useconds_t)(least_us + rand_r(&seed) % (whole_us / 5 + 1)));
            kill(pid, SIGKILL);
        }
        assert_int_equal(waitpid(pid, &how, 0), pid);
        ended = WIFEXITED(how);
        if (ended)
            assert_int_equal(WEXITSTATUS(how), STATUS_OK);
        kills += !ended;
        int count = 0;
        if (!ended && access(killed.database, F_OK) == 0) {
            sqlite3 *database = sweep_fixture_open(killed.database);
            sqlite3_stmt *statement = NULL;
            // Killed before the tables were made, there are none.
            if (sqlite3_prepare_v2(database, "SELECT count(*) FROM runs", -1, &statement, NULL) == SQLITE_OK &&
                sqlite3_step(statement) == SQLITE_ROW) {
                count = sqlite3_column_int(statement, 0);
                between += count > 0 && count < combinations;
            }
            sqlite3_finalize(statement);
            sqlite3_close(database);
        }
        least_us += count == before ? whole_us / 10 : 0;
        before = count;
    }
    print_message("%d kills, %d of them between the first and the last run\n", kills, between);
    assert_true(between >= 1);
    assert_same_rows(&killed, &whole, combinations);
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

// ---- Workers -------------------------------------------------------------------------------------------

static int workers_of(pid_t sweep, pid_t workers[JOBS])
{
    char path[64];
    int count = 0;
    snprintf(path, sizeof path, "/proc/%d/task/%d/children", sweep, sweep);
    FILE *file = fopen(path, "r");
    while (file && count < JOBS && fscanf(file, "%d", &workers[count]) == 1)
        count++;
    if (file)
        fclose(file);
    return count;
}

static void kill_workers(void)
{
    pid_t workers[JOBS];
    siginfo_t info;
    for (int i = workers_of(getpid(), workers) - 1; i >= 0; i--) {
        kill(workers[i], SIGKILL);
        waitid(P_PID, (id_t)workers[i], &info, WEXITED | WNOWAIT);  // the sweep is to reap it
    }
}

// What the progress of a sweep with workers of ours sees, and does.
typedef struct watch {
    bool kill;  // all workers, each time that a run has ended
    uint64_t ended;
    pid_t worker;      // the last one seen
    int worker_count;  // so many others came one after the other
} watch;

static void watch_workers(void *user, const char *what, uint64_t done, uint64_t total)
{
    watch *w = user;
    pid_t workers[JOBS];
    (void)what, (void)total;
    if (workers_of(getpid(), workers) > 0 && workers[0] != w->worker) {
        w->worker = workers[0];
        w->worker_count++;
    }
    if (w->kill && done > w->ended)
        kill_workers();
    w->ended = done;
}

static sweep_totals run_watched(const char *file, int jobs, watch *watch)
{
    const report report = {.progress = watch_workers, .user = watch};
    sweep *sweep = NULL;
    sweep_totals totals;
    assert_int_equal(sweep_open(file, NULL, &sweep), STATUS_OK);
    sweep->report = &report;  // of the runs alone
    assert_int_equal(sweep_run(sweep, jobs, &totals), STATUS_OK);
    sweep_close(sweep);
    return totals;
}

static void a_worker_lives_on(void **state)
{
    (void)state;
    sweep_fixture f;
    watch watch = {0};
    sweep_fixture_start(&f, cycle_text);
    const sweep_totals totals = run_watched(f.file, 1, &watch);
    assert_int_equal(totals.done + totals.refused, CYCLE_COMBINATIONS);
    assert_int_equal(watch.worker_count, 1);
    sweep_fixture_end(&f);
}

static void a_worker_killed_between_runs_costs_nothing(void **state)
{
    (void)state;
    sweep_fixture f;
    watch watch = {.kill = true};
    sweep_fixture_start(&f, cycle_text);
    const sweep_totals totals = run_watched(f.file, 1, &watch);
    assert_int_equal(totals.failed, 0);
    assert_int_equal(totals.done + totals.refused, CYCLE_COMBINATIONS);
    assert_int_equal(watch.worker_count, CYCLE_COMBINATIONS);
    sweep_fixture_end(&f);
}

// One has nothing to do any more, the other is in the middle of its run.
static void an_idle_worker_leaves_no_row(void **state)
{
    (void)state;
    sweep_fixture f;
    watch watch = {.kill = true};
    sweep_fixture_start(&f, "results: sweep.db\n"
                            "traces:\n"
                            "  - record scene:knot,rings=8 size=8x8\n"
                            "  - record scene:sheets,count=64,order=shuffled size=192x192\n"
                            "programs: layer_peel\n"
                            "machines: programmable\n"
                            "detail: cycle\n");
    const sweep_totals totals = run_watched(f.file, JOBS, &watch);
    assert_int_equal(totals.done, 1);
    assert_int_equal(totals.failed, 1);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs"), 2);
    assert_int_equal(run_whole(f.file, JOBS), STATUS_OK);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE outcome = 'done'"), 2);
    sweep_fixture_end(&f);
}

static void killed_workers_lose_nothing(void **state)
{
    (void)state;
    sweep_fixture whole, killed;
    unsigned seed = (unsigned)getpid();
    int how, kills = 0;
    print_message("seed %u\n", seed);
    sweep_fixture_start(&whole, cycle_text);
    sweep_fixture_start(&killed, cycle_text);
    assert_int_equal(run_whole(whole.file, JOBS), STATUS_OK);
    const pid_t pid = start_sweep(killed.file, JOBS);
    while (waitpid(pid, &how, WNOHANG) == 0) {
        pid_t workers[JOBS];
        usleep((useconds_t)(rand_r(&seed) % 50000));
        const int count = kills < KILLS_MAX ? workers_of(pid, workers) : 0;
        kills += count > 0 && kill(workers[rand_r(&seed) % (unsigned)count], SIGKILL) == 0;
    }
    assert_true(WIFEXITED(how) && WEXITSTATUS(how) == STATUS_OK);
    print_message("%d kills, %d runs failed\n", kills,
                  (int)sweep_fixture_number(killed.database, "SELECT count(*) FROM runs WHERE outcome = 'failed'"));
    assert_true(kills > 0);
    assert_int_equal(run_whole(killed.file, JOBS), STATUS_OK);
    assert_same_rows(&killed, &whole, CYCLE_COMBINATIONS);
    sweep_fixture_end(&whole);
    sweep_fixture_end(&killed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(killed_sweeps_go_on),
        cmocka_unit_test(killed_sweeps_of_all_levels_go_on),
        cmocka_unit_test(a_killed_worker_is_a_failed_run),
        cmocka_unit_test(a_worker_lives_on),
        cmocka_unit_test(a_worker_killed_between_runs_costs_nothing),
        cmocka_unit_test(an_idle_worker_leaves_no_row),
        cmocka_unit_test(killed_workers_lose_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
