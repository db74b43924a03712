// The parts of a sweep: what is to run (the plan), what came of it (rows), where that is kept (the store).
#ifndef ROPSIM_SWEEP_H
#define ROPSIM_SWEEP_H

#include "sweep_file.h"

// ---- Columns: what is kept of a run (sweep_columns.c) ---------------------------------------------------

// The rows of sweep_stats.def. Behind them come all statistics, then all derived numbers of stats.def, in its order, then half the width of
// each statistic's interval.
typedef enum sweep_stat {
#define SWEEP_COUNT(column, level, known, value) STAT_##column,
#define SWEEP_REAL SWEEP_COUNT
#define SWEEP_RESOURCE SWEEP_COUNT
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
#undef SWEEP_RESOURCE
    SWEEP_STAT_COUNT
} sweep_stat;
enum {
    SWEEP_STATISTICS_FROM = SWEEP_STAT_COUNT,
    SWEEP_DERIVED_FROM = SWEEP_STATISTICS_FROM + STATISTIC_COUNT,
    SWEEP_HALF_WIDTHS_FROM = SWEEP_DERIVED_FROM + DERIVED_COUNT,
    SWEEP_COLUMN_COUNT = SWEEP_HALF_WIDTHS_FROM + STATISTIC_COUNT
};

typedef enum column_kind { COLUMN_COUNT, COLUMN_REAL, COLUMN_RESOURCE } column_kind;
typedef struct sweep_column {
    char name[NAME_SIZE];
    column_kind kind;
    detail_level level;  // the first at which it is known
} sweep_column;
// A row of stats.def whose name is that of another column or of a machine key has `statistic_` before it; a half width has `_half_width`
// behind it.
sweep_column sweep_get_column(int index);
// The column with the half width of a column that holds an estimate at the level sampled; -1: it has none.
int sweep_half_width_of(int index);
column_kind sweep_column_kind(int index);  // the same at once: names are compared with all others

// ---- Rows: what came of a run (sweep_row.c) ------------------------------------------------------------

typedef struct sweep_value {
    bool known;
    int64_t count;  // or, of a COLUMN_REAL,
    double real;
} sweep_value;

typedef enum sweep_outcome { OUTCOME_DONE, OUTCOME_REFUSED, OUTCOME_FAILED, OUTCOME_COUNT } sweep_outcome;
extern const char *const sweep_outcome_names[OUTCOME_COUNT];

// Without pointers, so that it goes through a pipe or a message as it is.
typedef struct sweep_row {
    sweep_outcome outcome;
    char why[SWEEP_WHY_SIZE];  // unless done
    sweep_value stats[SWEEP_COLUMN_COUNT];
    plane_result planes[PLANE_MAX];
    int plane_count;
} sweep_row;

// `detail`: NULL at the level function.
void sweep_row_fill(sweep_row *row, const run_result *result, const detail_result *detail);
// A report's `say` whose `user` is char[SWEEP_WHY_SIZE]: errors are put one behind the other.
void sweep_keep_reason(void *why, severity severity, const char *text);

// ---- The plan: what is to run (sweep_plan.c) -----------------------------------------------------------

typedef struct sweep_trace {
    const char *label;  // as the file has it
    char *path;
    char hash[33];
    double work;  // fragments times their mean number over a sample: about fragments times passes
} sweep_trace;

typedef struct sweep_program {
    const char *label;  // as the file has it
    char *path;
    program *program;
    char hash[33];  // XXH3-128 of its words
} sweep_program;

typedef struct sweep_variant {
    machine machine;
    char hash[33];
    uint32_t settings;  // index into the product of all settings
} sweep_variant;

// Everything of one run; its key is all but the labels.
typedef struct sweep_combination {
    const sweep_trace *trace;
    const sweep_program *program;
    const sweep_variant *variant;
    const sweep_level *detail;
    uint64_t max_iterations;
} sweep_combination;

typedef struct sweep_store sweep_store;

struct sweep {
    const report *report;
    sweep_file file;
    sweep_trace *traces;
    sweep_program *programs;
    sweep_variant *variants;
    uint64_t trace_count, program_count, variant_count;
    sweep_store *store;
};

enum { SWEEP_RUNS_MAX = 100000 };
// The plan alone, for a process that serves another's sweep: nothing is recorded, traces have no hash, there is no
// store.
status sweep_open_plan(const char *path, const report *report, sweep **sweep);
// Combinations come by traces, then levels, programs and variants, the last fastest.
sweep_combination sweep_get(const sweep *sweep, uint64_t index);
uint64_t sweep_count(const sweep *sweep);
// "stencil_bits=4 depth_format=z16"; empty without settings. Cut to fit.
void sweep_settings_text(const sweep *sweep, const sweep_variant *variant, char *text, size_t size);

// A path as the sweep file has it, relative to the file's folder. Free with free().
char *sweep_path(const sweep_file *file, const char *path);
// The trace of a line `record SCENE...`, recorded to `path`.
status sweep_record(const sweep_file *file, const sweep_word *line, const char *path, const report *report);

// ---- Runs, one after the other in one process (sweep_share.c) ------------------------------------------

// What a result of the function level depends on, beside the trace.
typedef struct sweep_made {
    char program_hash[33];
    uint64_t max_iterations;
    bool deeper;  // with what a deeper level needs of it
    machine machine;
} sweep_made;

// What runs share: kept of one run for the next. Starts as zeros, and stays where it is.
typedef struct sweep_share {
    report report;  // of the run at hand, into its row; what is kept reports there, too
    trace *trace;   // NULL: nothing is kept
    stamps *stamps;
    run_result *function;
    sweep_made made;
    struct {
        uint64_t opened, read, replayed;
    } counts;  // how often each of the three was made
} sweep_share;

void sweep_share_run(sweep_share *share, const sweep *sweep, const sweep_combination *run, sweep_row *row);
void sweep_share_drop(sweep_share *share);  // frees all that is kept

// ---- Pools: places that take runs and give rows back ---------------------------------------------------

typedef enum sweep_slot_state {
    SLOT_IDLE,
    SLOT_BUSY,
    SLOT_ENDED,   // `row` is there; whoever takes it makes the slot idle
    SLOT_LOST,    // went away with its run, which came to nothing; whoever sees it closes the slot
    SLOT_CLOSED,  // takes no run: not there yet, or no more
} sweep_slot_state;

// Room for one run.
typedef struct sweep_slot {
    sweep_slot_state state;
    uint64_t index;  // of the combination
    sweep_row row;
} sweep_slot;

// The first member of what implements it.
typedef struct sweep_pool sweep_pool;
struct sweep_pool {
    sweep_slot *slots;
    int slot_count;
    status (*start)(sweep_pool *pool, int slot, uint64_t index);  // makes an idle slot busy
    status (*wait)(sweep_pool *pool, int milliseconds);           // until something happened, or so long
    void (*close)(sweep_pool *pool);                              // drops what is on its way, and frees
};

// Processes of this machine, `jobs` of them, each with one run at a time (sweep_processes.c).
status processes_open(const sweep *sweep, int jobs, sweep_pool **pool);
// Runs what is missing, and closes the pool (sweep_run.c).
status sweep_run_in(sweep *sweep, sweep_pool *pool, sweep_totals *totals);

// ---- Tables (sweep_print.c) ----------------------------------------------------------------------------

void print_cell(const char *text, FILE *out);
// The cells of all tables: trace, program, machine, settings; passes, fragments, bytes, error.
#define LABELS_HEADING "| trace | program | machine | settings |"
#define LABELS_RULE "|---|---|---|---|"
#define FIGURES_HEADING " geometry passes | fragments replayed | plane MB | largest error |"
#define FIGURES_RULE "---:|---:|---:|---:|"
void print_labels(const sweep *sweep, const sweep_combination *run, FILE *out);
void print_figures(const sweep_row *row, FILE *out);
// Of an estimate of this column " ± " and half its interval's width, divided by `unit`; of all else nothing.
void print_half_width(const sweep_row *row, int column, double unit, int decimals, FILE *out);

// ---- The store: an SQLite database (sweep_store.c) -----------------------------------------------------

// Creates it, or opens one that a sweep created, adding the columns that it lacks; anything else is refused and left as
// it is.
status store_open(const char *path, const report *report, sweep_store **store);
void store_close(sweep_store *store);  // NULL is fine
// Whether a run is there, and what came of it; `row` without its planes.
status store_find(sweep_store *store, const sweep_combination *key, bool *found, sweep_row *row);
// One transaction. A failed run is replaced; any other that is there stays.
status store_add(sweep_store *store, const sweep_combination *key, const sweep_row *row);

#endif
