// The inside of a sweep's store: shared by what prepares the tables and what reads and writes them.
#ifndef ROPSIM_SWEEP_STORE_H
#define ROPSIM_SWEEP_STORE_H

#include "sweep.h"

#include <sqlite3.h>

struct sweep_store {
    sqlite3 *database;
    sqlite3_stmt *find, *forget, *add, *add_plane;
    const report *report;
    char *path;
};

#define KEY_COLUMNS "version, detail, program_hash, trace_hash, machine_hash, max_iterations"

status store_fail(const sweep_store *store);  // reports what SQLite says
status store_execute(sweep_store *store, const char *text);

// A file that is there must be a sweep's, or empty. SQLite has not opened it yet.
status schema_check_file(const char *path, const report *report);
// Creates the tables, or adds the columns that they lack.
status schema_prepare(sweep_store *store);

#endif
