// `ropsim sweep`: runs what a sweep file's product lacks in its database, then prints tables, CSV, or the cheapest
// runs.
#include "command.h"

#include <inttypes.h>
#include <string.h>

enum { ROW_JOBS, ROW_NO_RUN, ROW_TABLE, ROW_CSV, ROW_CHEAPEST, ROW_EXACT };
static const command_option option_rows[] = {
    [ROW_JOBS] = {"jobs", 0, "N", "runs at the same time, each a process; default 1, at most 256"},
    [ROW_NO_RUN] = {"no-run", 0, NULL, "run nothing; print what is there"},
    [ROW_TABLE] = {"table", 0, NULL, "print the results as a Markdown table"},
    [ROW_CSV] = {"csv", 0, "FILE", "write the results as CSV, all statistics"},
    [ROW_CHEAPEST] = {"cheapest", 0, "bytes|passes",
                      "print the run of each trace with the fewest plane bytes or geometry passes"},
    [ROW_EXACT] = {"exact", 0, NULL, "with --cheapest: among exact images only"},
    {0},
};

typedef struct sweep_words {
    const char *file, *csv, *cheapest;
    bool table, exact, no_run;
    int jobs;
} sweep_words;

static bool take_word(int option, const char *value, sweep_words *words)
{
    uint64_t jobs = 0;
    switch (option) {
    case ROW_JOBS:
        if (!command_uint("jobs", value, 1, SWEEP_JOBS_MAX, &jobs))
            return false;
        words->jobs = (int)jobs;
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

static status run_sweep(sweep *sweep, const sweep_words *words)
{
    sweep_totals totals;
    status status = STATUS_OK;
    if (!words->no_run) {
        status = sweep_run(sweep, words->jobs, &totals);
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

int command_sweep(int argc, char **argv)
{
    sweep_words words = {.jobs = 1};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR || !take_word(option, line.value, &words))
            return STATUS_USAGE;
    }
    if (!words.file)
        return (int)command_usage("sweep", "a sweep file is wanted");
    if (words.exact && !words.cheapest)
        return (int)command_usage("sweep", "--exact goes with --cheapest");
    sweep *sweep = NULL;
    status status = sweep_open(words.file, &command_report, &sweep);
    if (status == STATUS_OK)
        status = run_sweep(sweep, &words);
    sweep_close(sweep);
    return (int)status;
}
