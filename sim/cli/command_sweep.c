// `ropsim sweep`: runs what a sweep file's product lacks in its database, then prints tables, CSV, or the cheapest
// runs. Started by mpirun or srun, rank 0 does so, and the other ranks run for it.
#include "command.h"

#include "../sweeps.h"

#include <inttypes.h>
#include <string.h>
#include <unistd.h>

enum { COMMAND_SILENCE_MAX = 86400, COMMAND_TOP_MAX = 1000, COMMAND_TOP_DEFAULT = 10 };
enum {
    ROW_JOBS,
    ROW_NO_RUN,
    ROW_TABLE,
    ROW_CSV,
    ROW_CHEAPEST,
    ROW_BEST,
    ROW_TOP,
    ROW_BOUND,
    ROW_EXACT,
    ROW_DETAIL,
    ROW_SILENCE
};
static const command_option option_rows[] = {
    [ROW_JOBS] = {"jobs", 0, "N",
                  "runs at the same time (under mpirun: on each rank), in as many processes; default 1, at most 256"},
    [ROW_NO_RUN] = {"no-run", 0, NULL, "run nothing; print what is there"},
    [ROW_TABLE] = {"table", 0, NULL, "print the results as a Markdown table"},
    [ROW_CSV] = {"csv", 0, "FILE", "write the results as CSV, all statistics"},
    [ROW_CHEAPEST] = {"cheapest", 0, "COLUMN",
                      "print the run of each trace with the least in a column or machine key; bytes: plane_bytes,"
                      " passes: geometry_passes"},
    [ROW_BEST] = {"best", 0, "COLUMN[:most]",
                  "print the first runs of each trace, the least first; :most: the largest"},
    [ROW_TOP] = {"top", 0, "N", "with --best: so many of each trace; default 10"},
    [ROW_BOUND] = {"bound", 0, "COLUMN<=VALUE",
                   "with --cheapest or --best: among runs that meet it; also >=; may be repeated"},
    [ROW_EXACT] = {"exact", 0, NULL, "with --cheapest or --best: among exact images only"},
    [ROW_DETAIL] = {"detail", 0, "LEVEL",
                    "with --cheapest or --best: among runs of this level; default the deepest that FILE has"},
    [ROW_SILENCE] = {"silence", 0, "SECONDS",
                     "under mpirun: after so long a rank that says nothing is given up; default 60"},
    {0},
};

typedef struct sweep_words {
    const char *file, *csv;
    sweep_query cheapest, best;  // `column` NULL: not asked for
    const char *bounds[SWEEP_BOUNDS_MAX], *detail, *top;
    char best_column[NAME_SIZE];
    int bound_count;
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
    case ROW_CHEAPEST: words->cheapest.column = value; return true;
    case ROW_BEST: words->best.column = value; return true;
    case ROW_TOP: words->top = value; return command_uint("top", value, 1, COMMAND_TOP_MAX, &words->best.top);
    case ROW_DETAIL: words->detail = value; return true;
    case ROW_BOUND:
        if (words->bound_count == SWEEP_BOUNDS_MAX) {
            report_error(&command_report, STATUS_USAGE, "--bound may be given at most %d times", SWEEP_BOUNDS_MAX);
            return false;
        }
        words->bounds[words->bound_count++] = value;
        return true;
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
    bool first = words->no_run && !words->table;
    for (int i = 0; i < 2; i++) {
        const sweep_query *query = i == 0 ? &words->cheapest : &words->best;
        if (status != STATUS_OK || !query->column)
            continue;
        fputs(first ? "" : "\n", stdout);
        first = false;
        status = sweep_print_query(sweep, query, stdout);
    }
    if (status == STATUS_OK && words->csv)
        status = sweep_write_csv(sweep, words->csv);
    return status == STATUS_OK && !words->no_run && totals.failed > 0 ? STATUS_REFUSED : status;
}

static status open_and_run(sweep_ranks *ranks, const sweep_words *words)
{
    sweep *sweep = NULL;
    status status = sweep_open(words->file, &command_report, &sweep);
    // Before hours are spent on what cannot be answered.
    if (status == STATUS_OK && words->cheapest.column)
        status = sweep_check_query(sweep, &words->cheapest, &command_report);
    if (status == STATUS_OK && words->best.column)
        status = sweep_check_query(sweep, &words->best, &command_report);
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

// COLUMN:most is the largest first.
static void split_best(sweep_words *words)
{
    sweep_query *best = &words->best;
    const char *colon = best->column ? strchr(best->column, ':') : NULL;
    if (!colon || strcmp(colon, ":most") != 0)
        return;
    snprintf(words->best_column, sizeof words->best_column, "%.*s", (int)(colon - best->column), best->column);
    best->column = words->best_column;
    best->most = true;
}

static status finish_queries(sweep_words *words)
{
    sweep_query *queries[] = {&words->cheapest, &words->best};
    const bool any = words->cheapest.column || words->best.column;
    status status = STATUS_OK;
    if (words->exact && !any)
        return command_usage("sweep", "--exact goes with --cheapest or --best");
    if (words->bound_count > 0 && !any)
        return command_usage("sweep", "--bound goes with --cheapest or --best");
    if (words->detail && !any)
        return command_usage("sweep", "--detail goes with --cheapest or --best; which levels run is said in FILE");
    if (words->top && !words->best.column)
        return command_usage("sweep", "--top goes with --best");
    words->cheapest.top = 1;
    words->best.top = words->top ? words->best.top : COMMAND_TOP_DEFAULT;
    split_best(words);
    for (int i = 0; status == STATUS_OK && i < 2; i++) {
        queries[i]->exact = words->exact;
        queries[i]->bounds = words->bounds;
        queries[i]->bound_count = words->bound_count;
        queries[i]->detail = words->detail;
        if (queries[i]->column)
            status = sweep_check_query(NULL, queries[i], &command_report);
    }
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
    *ended = words->file ? finish_queries(words) : command_usage("sweep", "a sweep file is wanted");
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
