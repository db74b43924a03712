// Sweeps (sim/sweep): runs of many combinations into a database, by processes of this machine or under MPI, and what is
// the best of them. docs/sweep.md describes the files, the database and how a sweep goes on.
#ifndef ROPSIM_SWEEPS_H
#define ROPSIM_SWEEPS_H

#include "levels.h"

// Every combination of the traces, programs, machines and settings that a sweep file names, run once each into an SQLite
// database: docs/sweep.md. What the machine refuses is an outcome, not an error.
enum { SWEEP_JOBS_MAX = 256 };
typedef struct sweep sweep;
typedef struct sweep_totals { uint64_t combinations, there, done, refused, failed; } sweep_totals;

// Reads the file and what it names, records its scenes, opens or creates its database. `report` must outlive the sweep.
status sweep_open(const char *path, const report *report, sweep **sweep);
void sweep_close(sweep *sweep);  // NULL is fine
// Runs what is not in the database, `jobs` at a time in as many processes; the caller has no other thread running.
// Whatever ends this process, what was done stays and the next call goes on.
status sweep_run(sweep *sweep, int jobs, sweep_totals *totals);

// A sweep under MPI: of the ranks that mpirun or srun started, rank 0 opens the sweep and runs it, and the others serve it.
// All read the same file, so they need the same paths: a shared file system.
typedef struct sweep_launch { int rank, count; } sweep_launch;  // count 1: started alone, MPI is not asked for
typedef struct sweep_ranks sweep_ranks;
sweep_launch sweep_get_launch(void);
// Starts MPI. STATUS_REFUSED if it was not built in or is not the one that started the ranks. `silence`: seconds after which a
// rank that says nothing is given up, at least SWEEP_SILENCE_MIN.
enum { SWEEP_SILENCE_MIN = 4, SWEEP_SILENCE_DEFAULT = 60 };
status sweep_ranks_open(const report *report, int silence, sweep_ranks **ranks);
// Waits for all ranks to call it, and frees. If rank 0 gave one up, it ends all by force instead, and this process with
// `status`: whatever is to be printed has been. A rank whose serving failed waits for nobody: it should exit with `status`,
// by which mpirun ends the others. NULL is fine.
void sweep_ranks_close(sweep_ranks *ranks, status status);
// As sweep_run, `jobs` runs at a time on each rank but 0. Only rank 0 may call it.
status sweep_run_on_ranks(sweep *sweep, sweep_ranks *ranks, int jobs, sweep_totals *totals);
// On the other ranks: replays what rank 0 hands out until that closes. Rank 0 is told what goes wrong, and reports it.
status sweep_serve(const char *path, sweep_ranks *ranks, int jobs);
// What is there of this sweep, in the file's order.
status sweep_print(sweep *sweep, FILE *out);                    // a Markdown table
status sweep_write_csv(sweep *sweep, const char *path);         // all statistics
// For each trace the first `top` runs that meet all bounds, in the order of a column: a Markdown table. Columns are those of
// the table `runs` that hold numbers, or machine keys that do. Runs of one level of detail are compared.
typedef struct sweep_query {
    const char *column;
    bool most;                  // the largest first, not the smallest
    bool exact;                 // among exact images only
    const char *const *bounds;  // `COLUMN<=VALUE` or `COLUMN>=VALUE`
    int bound_count;
    const char *detail;         // as in the sweep file; NULL: the deepest that the sweep has
    uint64_t top;
} sweep_query;
enum { SWEEP_BOUNDS_MAX = 16 };
// STATUS_USAGE if it cannot be answered: unknown columns, bounds of another form, a column that is known from a deeper level on.
// `sweep` NULL: the words alone.
status sweep_check_query(const sweep *sweep, const sweep_query *query, const report *report);
status sweep_print_query(sweep *sweep, const sweep_query *query, FILE *out);

#endif
