// Sweeps of three ranks on this machine, as mpirun starts them: they leave the rows that one process leaves, also if
// mpirun or a rank is killed again and again and the sweep is started anew each time.
#include "sweep_fixture.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

// 2 traces x 3 programs x 2 machines x 2 x 3 settings.
static const char file_text[] = "results: sweep.db\n"
                                "traces:\n"
                                "  - record scene:knot,rings=64 size=96x96\n"
                                "  - record scene:sheets,count=24,order=shuffled size=24x24\n"
                                "programs: [layer_peel, coherent_layer_peel_a, ideal_coherent_layer_peel]\n"
                                "machines: [g80, programmable]\n"
                                "set:\n"
                                "  depth_format: [z16, z24]\n"
                                "  stencil_bits: 6..8\n";
enum { COMBINATIONS = 72, KILLS_MAX = 8, RANKS_MAX = 8 };

static void need_mpirun(void)
{
    if (system("mpirun --version >/dev/null 2>&1") != 0 || access(ROPSIM_MPI, R_OK) != 0) {
        print_message("skipped: mpirun is not installed, or MPI is not built in\n");
        skip();
    }
}

static pid_t start_ranks(const char *file)
{
    const pid_t pid = fork();
    assert_true(pid >= 0);
    if (pid > 0)
        return pid;
    const int nothing = open("/dev/null", O_WRONLY);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    setenv("ASAN_OPTIONS", "detect_leaks=0", 1);  // MPI's are not ours to free
    execlp("mpirun", "mpirun", "--oversubscribe", "--mca", "btl", "self,vader", "-n", "3", ROPSIM_COMMAND, "sweep",
           file, (char *)NULL);
    _exit(127);
}

static void run_alone(const char *file)
{
    sweep *sweep = NULL;
    sweep_totals totals;
    assert_int_equal(sweep_open(file, NULL, &sweep), STATUS_OK);
    assert_int_equal(sweep_run(sweep, 1, &totals), STATUS_OK);
    sweep_close(sweep);
}

// 0 also before the tables were made.
static int rows_there(const char *path)
{
    int count = 0;
    sqlite3_stmt *statement = NULL;
    if (access(path, F_OK) != 0)
        return 0;
    sqlite3 *database = sweep_fixture_open(path);
    sqlite3_busy_timeout(database, 10000);
    if (sqlite3_prepare_v2(database, "SELECT count(*) FROM runs", -1, &statement, NULL) == SQLITE_OK &&
        sqlite3_step(statement) == SQLITE_ROW)
        count = sqlite3_column_int(statement, 0);
    sqlite3_finalize(statement);
    sqlite3_close(database);
    return count;
}

// mpirun itself, or one of the processes that it started.
static pid_t choose_victim(pid_t mpirun, unsigned *seed)
{
    char path[64];
    int pids[RANKS_MAX] = {mpirun}, count = 1;
    snprintf(path, sizeof path, "/proc/%d/task/%d/children", mpirun, mpirun);
    FILE *file = fopen(path, "r");
    while (file && count < RANKS_MAX && fscanf(file, "%d", &pids[count]) == 1)
        count++;
    if (file)
        fclose(file);
    return pids[rand_r(seed) % (unsigned)count];
}

static bool has_ended(pid_t pid)
{
    siginfo_t info = {0};
    return waitid(P_PID, (id_t)pid, &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid == pid;
}

static void assert_same_content(const sweep_fixture *found, const sweep_fixture *wanted, int combinations)
{
    char *a = sweep_fixture_content(found->database), *b = sweep_fixture_content(wanted->database);
    assert_string_equal(a, b);
    assert_int_equal(rows_there(found->database), combinations);
    free(a);
    free(b);
}

static void leave_the_same_rows(const char *text, int combinations)
{
    sweep_fixture alone, shared;
    int how = 0;
    need_mpirun();
    sweep_fixture_start(&alone, text);
    sweep_fixture_start(&shared, text);
    run_alone(alone.file);
    const pid_t pid = start_ranks(shared.file);
    assert_int_equal(waitpid(pid, &how, 0), pid);
    assert_true(WIFEXITED(how) && WEXITSTATUS(how) == 0);
    assert_same_content(&shared, &alone, combinations);
    sweep_fixture_end(&alone);
    sweep_fixture_end(&shared);
}

static void ranks_leave_the_rows_of_one_process(void **state)
{
    (void)state;
    leave_the_same_rows(file_text, COMBINATIONS);
    leave_the_same_rows("results: sweep.db\n"
                        "traces: record scene:knot,rings=16 size=32x32\n"
                        "programs: layer_peel\n"
                        "machines: [g80, tiled]\n"
                        "detail: [function, traffic, cycle]\n",
                        6);
}

static void killed_ranks_go_on(void **state)
{
    (void)state;
    sweep_fixture alone, killed;
    unsigned seed = (unsigned)getpid();
    int kills = 0, between = 0;
    need_mpirun();
    print_message("seed %u\n", seed);
    sweep_fixture_start(&alone, file_text);
    sweep_fixture_start(&killed, file_text);
    run_alone(alone.file);
    for (bool ended = false; !ended;) {
        int how = 0;
        const pid_t pid = start_ranks(killed.file);
        // By turns at any moment, also before MPI has started, and once some rows more are there.
        const int wanted = rows_there(killed.database) + 1 + (int)(rand_r(&seed) % 8);
        if (kills % 2 == 1)
            usleep(rand_r(&seed) % 1000000);
        while (kills < KILLS_MAX && kills % 2 == 0 && rows_there(killed.database) < wanted && !has_ended(pid))
            usleep(1000);
        if (kills < KILLS_MAX && !has_ended(pid))
            kill(choose_victim(pid, &seed), SIGKILL);
        assert_int_equal(waitpid(pid, &how, 0), pid);
        ended = WIFEXITED(how) && WEXITSTATUS(how) == STATUS_OK;
        kills += !ended;
        assert_true(kills <= KILLS_MAX);
        const int rows = rows_there(killed.database);
        between += !ended && rows > 0 && rows < COMBINATIONS;
    }
    print_message("%d kills, %d of them between the first and the last run\n", kills, between);
    assert_true(between >= 1);
    assert_same_content(&killed, &alone, COMBINATIONS);
    assert_int_equal(
        sweep_fixture_number(killed.database, "SELECT count(*) FROM planes WHERE run NOT IN (SELECT id FROM runs)"), 0);
    sweep_fixture_end(&alone);
    sweep_fixture_end(&killed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ranks_leave_the_rows_of_one_process),
        cmocka_unit_test(killed_ranks_go_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
