// `ropsim sweep`: runs what a sweep file's product lacks in its database, then prints tables, CSV, or the cheapest
// runs. Started by mpirun or srun, rank 0 does so, and the other ranks run for it.
#include "command.h"

#include <inttypes.h>
#include <string.h>
#include <unistd.h>

enum { COMMAND_SILENCE_MAX = 86400 };
enum { ROW_JOBS, ROW_NO_RUN, ROW_TABLE, ROW_CSV, ROW_CHEAPEST, ROW_EXACT, ROW_SILENCE };
static const command_option option_rows[] = {
    [ROW_JOBS] = {"jobs", 0, "N",
                  "runs at the same time (under mpirun: on each rank), each a process; default 1, at most 256"},
    [ROW_NO_RUN] = {"no-run", 0, NULL, "run nothing; print what is there"},
    [ROW_TABLE] = {"table", 0, NULL, "print the results as a Markdown table"},
    [ROW_CSV] = {"csv", 0, "FILE", "write the results as CSV, all statistics"},
    [ROW_CHEAPEST] = {"cheapest", 0, "bytes|passes",
                      "print the run of each trace with the fewest plane bytes or geometry passes"},
    [ROW_EXACT] = {"exact", 0, NULL, "with --cheapest: among exact images only"},
    [ROW_SILENCE] = {"silence", 0, "SECONDS",
                     "under mpirun: after so long a rank that says nothing is given up; default 60"},
    {0},
};

typedef struct sweep_words {
    const char *file, *csv, *cheapest;
    bool table, exact, no_run;
    int jobs, silence;
} sweep_words;

static bool take_word(int option, const char *value, sweep_words *words)
{
    uint64_t number = 0;
    switch (option) {
    case ROW_JOBS:
        if (!command_uint("jobs", value, 1, SWEEP_JOBS_MAX, &number))
            return false;
        words->jobs = (int)number;
        return true;
    case ROW_SILENCE:
        if (!command_uint("silence", value, SWEEP_SILENCE_MIN, COMMAND_SILENCE_MAX, &number))
            return false;
        words->silence = (int)number;
        return true;
    case ROW_NO_RUN: words->no_run = true; return true;
    case ROW_TABLE: words->table = true; return true;
    case ROW_CSV: words->csv = value; return true;
    case ROW_EXACT: words->exact = true; return true;
    case ROW_CHEAPEST:
        words->cheapest = value;
        if (strcmp(value, "bytes") == 0 || strcmp(value, "passes") == 0)
            return true;
        report_error(&command_report, STATUS_USAGE, "--cheapest is `%s`, but must be bytes or passes", value);
        return false;
    default:
        if (words->file) {
            command_usage("sweep", "one sweep file at a time");
            return false;
        }
        words->file = value;
        return true;
    }
}

static status run_sweep(sweep *sweep, sweep_ranks *ranks, const sweep_words *words)
{
    sweep_totals totals;
    status status = STATUS_OK;
    if (!words->no_run) {
        status =
            ranks ? sweep_run_on_ranks(sweep, ranks, words->jobs, &totals) : sweep_run(sweep, words->jobs, &totals);
        if (status == STATUS_OK)
            printf("%" PRIu64 " runs: %" PRIu64 " were there, %" PRIu64 " done, %" PRIu64
                   " refused by the machine, %" PRIu64 " failed\n",
                   totals.combinations, totals.there, totals.done, totals.refused, totals.failed);
    }
    if (status == STATUS_OK && words->table) {
        fputs(words->no_run ? "" : "\n", stdout);
        status = sweep_print(sweep, stdout);
    }
    if (status == STATUS_OK && words->cheapest) {
        fputs(words->no_run && !words->table ? "" : "\n", stdout);
        status = sweep_print_cheapest(
            sweep, strcmp(words->cheapest, "bytes") == 0 ? SWEEP_COST_BYTES : SWEEP_COST_PASSES, words->exact, stdout);
    }
    if (status == STATUS_OK && words->csv)
        status = sweep_write_csv(sweep, words->csv);
    return status == STATUS_OK && !words->no_run && totals.failed > 0 ? STATUS_REFUSED : status;
}

static status open_and_run(sweep_ranks *ranks, const sweep_words *words)
{
    sweep *sweep = NULL;
    status status = sweep_open(words->file, &command_report, &sweep);
    if (status == STATUS_OK)
        status = run_sweep(sweep, ranks, words);
    sweep_close(sweep);
    return status;
}

// One of several ranks.
static status share_sweep(const sweep_launch *launch, const sweep_words *words)
{
    sweep_ranks *ranks = NULL;
    status status = sweep_ranks_open(&command_report, words->silence, &ranks);
    if (status != STATUS_OK) {
        // mpirun ends all with the first that fails: rank 0, which is refused as well, is to speak before that.
        sleep(launch->rank > 0);
        return status;
    }
    status = launch->rank == 0 ? open_and_run(ranks, words) : sweep_serve(words->file, ranks, words->jobs);
    fflush(stdout);  // what was found is out before ranks wait for each other
    sweep_ranks_close(ranks, status);
    return status;
}

static bool take_words(int argc, char **argv, sweep_words *words, status *ended)
{
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        *ended = option == COMMAND_HELP ? STATUS_OK : STATUS_USAGE;
        if (option == COMMAND_HELP || option == COMMAND_ERROR || !take_word(option, line.value, words))
            return false;
    }
    *ended = !words->file                       ? command_usage("sweep", "a sweep file is wanted")
             : words->exact && !words->cheapest ? command_usage("sweep", "--exact goes with --cheapest")
                                                : STATUS_OK;
    return *ended == STATUS_OK;
}

int command_sweep(int argc, char **argv)
{
    const sweep_launch launch = sweep_get_launch();
    sweep_words words = {.jobs = 1, .silence = SWEEP_SILENCE_DEFAULT};
    status ended;
    if (launch.rank > 0 && !command_silence())
        return STATUS_IO;
    // All ranks have the same words, and rank 0 says what is wrong with them: the others end quietly and well.
    if (!take_words(argc, argv, &words, &ended))
        return launch.rank > 0 ? STATUS_OK : (int)ended;
    return (int)(launch.count > 1 ? share_sweep(&launch, &words) : open_and_run(NULL, &words));
}
