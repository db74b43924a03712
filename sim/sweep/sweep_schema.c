// The tables of a sweep's database: creates them, checks whose they are, and adds columns that they lack.
//
// What marks a database as ours is SQLite's application id; a file without it is not even opened by SQLite, which could
// write to it. Columns are only ever added, so databases go on across versions of ropsim, in both directions: an older
// one leaves columns empty that it does not know. SCHEMA_VERSION changes only with what an older one would get wrong.
#include "sweep_store.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define APPLICATION_ID 1919905907  // "rops"
#define SCHEMA_VERSION 1
#define TEXT_OF(number) TEXT_OF_(number)
#define TEXT_OF_(number) #number
enum { APPLICATION_ID_AT = 68, HEADER_SIZE = 100 };

// The columns of what comes of a run are added to these.
static const char schema[] =
    "CREATE TABLE runs (id INTEGER PRIMARY KEY,"
    " version TEXT NOT NULL, detail TEXT NOT NULL, program_hash TEXT NOT NULL, trace_hash TEXT NOT NULL,"
    " machine_hash TEXT NOT NULL, max_iterations INTEGER NOT NULL,"
    " program TEXT NOT NULL, trace TEXT NOT NULL, machine TEXT NOT NULL,"
    " machine_keys TEXT NOT NULL CHECK (json_valid(machine_keys)),"
    " outcome TEXT NOT NULL CHECK (outcome IN ('done', 'refused', 'failed')), why TEXT,"
    " UNIQUE (" KEY_COLUMNS ")) STRICT;"
    "CREATE TABLE planes (run INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,"
    " number INTEGER NOT NULL, name TEXT NOT NULL, format TEXT NOT NULL,"
    " bytes_read INTEGER NOT NULL, bytes_written INTEGER NOT NULL, bytes_cleared INTEGER NOT NULL,"
    " texture_bytes_read INTEGER NOT NULL, PRIMARY KEY (run, number)) STRICT, WITHOUT ROWID;"
    "PRAGMA application_id = " TEXT_OF(APPLICATION_ID) "; PRAGMA user_version = " TEXT_OF(SCHEMA_VERSION);

static const char *const kind_types[] = {
    [COLUMN_COUNT] = "INTEGER", [COLUMN_REAL] = "REAL", [COLUMN_RESOURCE] = "TEXT"};

static status read_pragma(sweep_store *store, const char *text, int64_t *value)
{
    sqlite3_stmt *statement = NULL;
    *value = 0;
    if (sqlite3_prepare_v2(store->database, text, -1, &statement, NULL) != SQLITE_OK)
        return store_fail(store);
    const int step = sqlite3_step(statement);
    if (step == SQLITE_ROW)
        *value = sqlite3_column_int64(statement, 0);
    const status status = step == SQLITE_ROW ? STATUS_OK : store_fail(store);
    sqlite3_finalize(statement);
    return status;
}

static status refuse_file(const char *path, const report *report)
{
    return report_error(
        report, STATUS_REFUSED,
        "%s: is there and is not the database of a sweep; name a new file or one that `ropsim sweep` made", path);
}

// A file that is there must be empty or carry our mark. With a journal beside it, what it holds is for SQLite to say.
status schema_check_file(const char *path, const report *report)
{
    unsigned char header[HEADER_SIZE];
    struct stat found;
    char journal[4096];
    if (stat(path, &found) != 0)
        return errno == ENOENT ? STATUS_OK : report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    if (!S_ISREG(found.st_mode))
        return refuse_file(path, report);
    if (snprintf(journal, sizeof journal, "%s-journal", path) >= (int)sizeof journal)
        return report_error(report, STATUS_REFUSED, "%s: the path is too long", path);
    if (found.st_size == 0 || access(journal, F_OK) == 0)
        return STATUS_OK;
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    const size_t size = fread(header, 1, sizeof header, file);
    fclose(file);
    uint32_t id = 0;
    for (int i = 0; size == sizeof header && i < 4; i++)
        id = id << 8 | header[APPLICATION_ID_AT + i];
    return id == APPLICATION_ID && memcmp(header, "SQLite format 3", 16) == 0 ? STATUS_OK : refuse_file(path, report);
}

// The type that `runs` has a column of; empty: it has none.
static status find_type(sweep_store *store, const char *column, char type[NAME_SIZE])
{
    sqlite3_stmt *statement = NULL;
    type[0] = 0;
    if (sqlite3_prepare_v2(store->database, "SELECT type FROM pragma_table_info('runs') WHERE name = ?1", -1,
                           &statement, NULL) != SQLITE_OK)
        return store_fail(store);
    sqlite3_bind_text(statement, 1, column, -1, SQLITE_TRANSIENT);
    const int step = sqlite3_step(statement);
    if (step == SQLITE_ROW)
        snprintf(type, NAME_SIZE, "%s", (const char *)sqlite3_column_text(statement, 0));
    const status status = step == SQLITE_ROW || step == SQLITE_DONE ? STATUS_OK : store_fail(store);
    sqlite3_finalize(statement);
    return status;
}

static status add_columns(sweep_store *store)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < SWEEP_COLUMN_COUNT; i++) {
        const sweep_column column = sweep_get_column(i);
        const char *wanted = kind_types[column.kind];
        char type[NAME_SIZE], text[3 * NAME_SIZE];
        status = find_type(store, column.name, type);
        snprintf(text, sizeof text, "ALTER TABLE runs ADD COLUMN \"%s\" %s", column.name, wanted);
        if (status == STATUS_OK && !type[0])
            status = store_execute(store, text);
        else if (status == STATUS_OK && strcmp(type, wanted) != 0)
            status = report_error(store->report, STATUS_REFUSED,
                                  "%s: its column %s is %s, but this command writes %s; name a new file", store->path,
                                  column.name, type, wanted);
    }
    return status;
}

static status check_version(sweep_store *store)
{
    int64_t id = 0, version = 0;
    status status = read_pragma(store, "PRAGMA application_id", &id);
    if (status == STATUS_OK && id != APPLICATION_ID)
        return refuse_file(store->path, store->report);
    if (status == STATUS_OK)
        status = read_pragma(store, "PRAGMA user_version", &version);
    if (status == STATUS_OK && version != SCHEMA_VERSION)
        return report_error(store->report, STATUS_REFUSED,
                            "%s: has tables of version %" PRId64 ", but this command writes version %d; use the ropsim"
                            " that made it, or name a new file",
                            store->path, version, SCHEMA_VERSION);
    return status;
}

// All in one transaction: of two sweeps that open a database at the same time, the second finds it done.
status schema_prepare(sweep_store *store)
{
    int64_t id = 0, tables = 0;
    status status = store_execute(store, "PRAGMA foreign_keys = ON; BEGIN IMMEDIATE");
    if (status == STATUS_OK)
        status = read_pragma(store, "PRAGMA application_id", &id);
    if (status == STATUS_OK)
        status = read_pragma(store, "SELECT count(*) FROM sqlite_schema", &tables);
    if (status == STATUS_OK && id == 0 && tables == 0)
        status = store_execute(store, schema);
    if (status == STATUS_OK)
        status = check_version(store);
    if (status == STATUS_OK)
        status = add_columns(store);
    return status == STATUS_OK ? store_execute(store, "COMMIT") : status;
}
