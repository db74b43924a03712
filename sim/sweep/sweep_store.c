// The database of a sweep: creates and checks it, finds runs by their key, adds a run in one transaction.
//
// SQLite's own rollback journal keeps it whole when the process is killed at any moment. What marks a database as ours
// is SQLite's application id; a file without it is not even opened by SQLite, which could write to it.
#include "sweep.h"

#include <errno.h>
#include <inttypes.h>
#include <jansson.h>
#include <sqlite3.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define APPLICATION_ID 1919905907  // "rops"
#define SCHEMA_VERSION 1
#define TEXT_OF(number) TEXT_OF_(number)
#define TEXT_OF_(number) #number
enum { BUSY_MILLISECONDS = 30000, APPLICATION_ID_AT = 68, HEADER_SIZE = 100 };

struct sweep_store {
    sqlite3 *database;
    sqlite3_stmt *find, *forget, *add, *add_plane;
    const report *report;
    char *path;
};

#define KEY_COLUMNS "version, detail, program_hash, trace_hash, machine_hash, max_iterations"
#define KEY_IS \
    "version = ?1 AND detail = ?2 AND program_hash = ?3 AND trace_hash = ?4 AND machine_hash = ?5" \
    " AND max_iterations = ?6"
enum { KEY_COLUMN_COUNT = 6, LABELS_FROM = 7, STATS_FROM = 13 };

static const char schema[] =
    "CREATE TABLE runs (id INTEGER PRIMARY KEY,"
    " version TEXT NOT NULL, detail TEXT NOT NULL, program_hash TEXT NOT NULL, trace_hash TEXT NOT NULL,"
    " machine_hash TEXT NOT NULL, max_iterations INTEGER NOT NULL,"
    " program TEXT NOT NULL, trace TEXT NOT NULL, machine TEXT NOT NULL,"
    " machine_keys TEXT NOT NULL CHECK (json_valid(machine_keys)),"
    " outcome TEXT NOT NULL CHECK (outcome IN ('done', 'refused', 'failed')), why TEXT"
#define SWEEP_COUNT(column, known, value) ", " #column " INTEGER"
#define SWEEP_REAL(column, known, value) ", " #column " REAL"
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
    ", UNIQUE (" KEY_COLUMNS ")) STRICT;"
    "CREATE TABLE planes (run INTEGER NOT NULL REFERENCES runs (id) ON DELETE CASCADE,"
    " number INTEGER NOT NULL, name TEXT NOT NULL, format TEXT NOT NULL,"
    " bytes_read INTEGER NOT NULL, bytes_written INTEGER NOT NULL, bytes_cleared INTEGER NOT NULL,"
    " texture_bytes_read INTEGER NOT NULL, PRIMARY KEY (run, number)) STRICT, WITHOUT ROWID;"
    "PRAGMA application_id = " TEXT_OF(APPLICATION_ID) "; PRAGMA user_version = " TEXT_OF(SCHEMA_VERSION);

static const char find_text[] = "SELECT outcome, why"
#define SWEEP_COUNT(column, known, value) ", " #column
#define SWEEP_REAL SWEEP_COUNT
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
                                " FROM runs WHERE " KEY_IS;

// One parameter a column, in their order.
static const char add_text[] =
    "INSERT OR IGNORE INTO runs (" KEY_COLUMNS ", program, trace, machine, machine_keys, outcome, why"
#define SWEEP_COUNT(column, known, value) ", " #column
#define SWEEP_REAL SWEEP_COUNT
#include "sweep_stats.def"
#undef SWEEP_COUNT
    ") VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?"
#define SWEEP_COUNT(column, known, value) ", ?"
#include "sweep_stats.def"
#undef SWEEP_COUNT
#undef SWEEP_REAL
    ")";

static status fail(const sweep_store *store)
{
    return report_error(store->report, STATUS_IO, "%s: %s", store->path, sqlite3_errmsg(store->database));
}

static status execute(sweep_store *store, const char *text)
{
    return sqlite3_exec(store->database, text, NULL, NULL, NULL) == SQLITE_OK ? STATUS_OK : fail(store);
}

static status read_pragma(sweep_store *store, const char *text, int64_t *value)
{
    sqlite3_stmt *statement = NULL;
    *value = 0;
    if (sqlite3_prepare_v2(store->database, text, -1, &statement, NULL) != SQLITE_OK)
        return fail(store);
    const int step = sqlite3_step(statement);
    if (step == SQLITE_ROW)
        *value = sqlite3_column_int64(statement, 0);
    const status status = step == SQLITE_ROW ? STATUS_OK : fail(store);
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
static status check_file(const char *path, const report *report)
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

// Creates the tables in one transaction if there is nothing yet.
static status prepare_schema(sweep_store *store)
{
    int64_t id, tables, version;
    status status = execute(store, "PRAGMA foreign_keys = ON; BEGIN IMMEDIATE");
    if (status == STATUS_OK)
        status = read_pragma(store, "PRAGMA application_id", &id);
    if (status == STATUS_OK)
        status = read_pragma(store, "SELECT count(*) FROM sqlite_schema", &tables);
    if (status == STATUS_OK && id == 0 && tables == 0)
        status = execute(store, schema);
    if (status == STATUS_OK)
        status = execute(store, "COMMIT");
    if (status == STATUS_OK)
        status = read_pragma(store, "PRAGMA application_id", &id);
    if (status == STATUS_OK && id != APPLICATION_ID)
        return refuse_file(store->path, store->report);
    if (status == STATUS_OK)
        status = read_pragma(store, "PRAGMA user_version", &version);
    if (status == STATUS_OK && version != SCHEMA_VERSION)
        return report_error(store->report, STATUS_REFUSED,
                            "%s: has tables of version %" PRId64 ", but this command writes version %d", store->path,
                            version, SCHEMA_VERSION);
    return status;
}

static status prepare(sweep_store *store, const char *text, sqlite3_stmt **statement)
{
    return sqlite3_prepare_v2(store->database, text, -1, statement, NULL) == SQLITE_OK ? STATUS_OK : fail(store);
}

status store_open(const char *path, const report *report, sweep_store **store)
{
    *store = NULL;
    status status = check_file(path, report);
    if (status != STATUS_OK)
        return status;
    sweep_store *new = calloc(1, sizeof *new);
    if (!new)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    new->report = report;
    new->path = strdup(path);
    if (!new->path ||
        sqlite3_open_v2(path, &new->database, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, NULL) != SQLITE_OK)
        status = report_error(report, STATUS_IO, "%s: %s", path,
                              new->database ? sqlite3_errmsg(new->database) : "out of memory");
    if (status == STATUS_OK) {
        sqlite3_busy_timeout(new->database, BUSY_MILLISECONDS);
        status = prepare_schema(new);
    }
    if (status == STATUS_OK)
        status = prepare(new, find_text, &new->find);
    if (status == STATUS_OK)
        status = prepare(new, "DELETE FROM runs WHERE outcome = 'failed' AND " KEY_IS, &new->forget);
    if (status == STATUS_OK)
        status = prepare(new, add_text, &new->add);
    if (status == STATUS_OK)
        status = prepare(new, "INSERT INTO planes VALUES (?, ?, ?, ?, ?, ?, ?, ?)", &new->add_plane);
    if (status == STATUS_OK)
        *store = new;
    else
        store_close(new);
    return status;
}

void store_close(sweep_store *store)
{
    if (!store)
        return;
    sqlite3_finalize(store->find);
    sqlite3_finalize(store->forget);
    sqlite3_finalize(store->add);
    sqlite3_finalize(store->add_plane);
    sqlite3_close(store->database);
    free(store->path);
    free(store);
}

static void bind_text(sqlite3_stmt *statement, int at, const char *text)
{
    sqlite3_bind_text(statement, at, text, -1, SQLITE_TRANSIENT);
}

static void bind_key(sqlite3_stmt *statement, const sweep_combination *key)
{
    bind_text(statement, 1, ROPSIM_VERSION);
    bind_text(statement, 2, "function");
    bind_text(statement, 3, key->program->hash);
    bind_text(statement, 4, key->trace->hash);
    bind_text(statement, 5, key->variant->hash);
    sqlite3_bind_int64(statement, KEY_COLUMN_COUNT, (int64_t)key->max_iterations);
}

status store_find(sweep_store *store, const sweep_combination *key, bool *found, sweep_row *row)
{
    sqlite3_stmt *find = store->find;
    *row = (sweep_row){0};
    bind_key(find, key);
    const int step = sqlite3_step(find);
    *found = step == SQLITE_ROW;
    if (*found) {
        const char *outcome = (const char *)sqlite3_column_text(find, 0);
        const char *why = (const char *)sqlite3_column_text(find, 1);
        for (int i = 0; i < OUTCOME_COUNT; i++) {
            if (outcome && strcmp(outcome, sweep_outcome_names[i]) == 0)
                row->outcome = (sweep_outcome)i;
        }
        snprintf(row->why, sizeof row->why, "%s", why ? why : "");
        for (int i = 0; i < SWEEP_STAT_COUNT; i++)
            row->stats[i] = (sweep_value){sqlite3_column_type(find, 2 + i) != SQLITE_NULL,
                                          sqlite3_column_int64(find, 2 + i), sqlite3_column_double(find, 2 + i)};
    }
    const status status = *found || step == SQLITE_DONE ? STATUS_OK : fail(store);
    sqlite3_reset(find);
    return status;
}

// Every key of the machine with its value, integers and booleans as such.
static char *machine_json(const machine *machine)
{
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    if (!file)
        return NULL;
    machine_print(machine, file);
    fclose(file);
    json_t *object = json_object();
    char *rest = NULL;
    for (char *line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
        char *value = strstr(line, ": ");
        if (line[0] == '#' || !value)
            continue;
        *value = 0;
        value += 2;
        const bool digits = strspn(value, "0123456789") == strlen(value);
        const bool yes = strcmp(value, "true") == 0, no = strcmp(value, "false") == 0;
        json_object_set_new(object, line,
                            digits      ? json_integer(strtoll(value, NULL, 10))
                            : yes || no ? json_boolean(yes)
                                        : json_string(value));
    }
    free(text);
    char *json = json_dumps(object, JSON_COMPACT);
    json_decref(object);
    return json;
}

static status run_once(sweep_store *store, sqlite3_stmt *statement)
{
    const bool done = sqlite3_step(statement) == SQLITE_DONE;
    const status status = done ? STATUS_OK : fail(store);
    sqlite3_reset(statement);
    return status;
}

static status add_planes(sweep_store *store, const sweep_row *row)
{
    const int64_t run = sqlite3_last_insert_rowid(store->database);
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < row->plane_count; i++) {
        const plane_result *plane = &row->planes[i];
        const uint64_t bytes[] = {plane->bytes_read, plane->bytes_written, plane->bytes_cleared,
                                  plane->texture_bytes_read};
        sqlite3_bind_int64(store->add_plane, 1, run);
        sqlite3_bind_int(store->add_plane, 2, i);
        bind_text(store->add_plane, 3, plane->name);
        bind_text(store->add_plane, 4, format_table[plane->format].name);
        for (int k = 0; k < 4; k++)
            sqlite3_bind_int64(store->add_plane, 5 + k, (int64_t)bytes[k]);
        status = run_once(store, store->add_plane);
    }
    return status;
}

static status add_run(sweep_store *store, const sweep_combination *key, const sweep_row *row, const char *keys)
{
    sqlite3_stmt *add = store->add;
    const char *labels[] = {key->program->label, key->trace->label, key->variant->machine.name, keys,
                            sweep_outcome_names[row->outcome]};
    bind_key(store->forget, key);
    status status = run_once(store, store->forget);
    if (status != STATUS_OK)
        return status;
    sqlite3_clear_bindings(add);
    bind_key(add, key);
    for (int i = 0; i < 5; i++)
        bind_text(add, LABELS_FROM + i, labels[i]);
    if (row->outcome != OUTCOME_DONE)
        bind_text(add, STATS_FROM - 1, row->why);
    for (int i = 0; i < SWEEP_STAT_COUNT; i++) {
        if (row->stats[i].known && sweep_stat_rows[i].real)
            sqlite3_bind_double(add, STATS_FROM + i, row->stats[i].real);
        else if (row->stats[i].known)
            sqlite3_bind_int64(add, STATS_FROM + i, row->stats[i].count);
    }
    status = run_once(store, add);
    return status == STATUS_OK && sqlite3_changes(store->database) > 0 ? add_planes(store, row) : status;
}

status store_add(sweep_store *store, const sweep_combination *key, const sweep_row *row)
{
    char *keys = machine_json(&key->variant->machine);
    if (!keys)
        return report_error(store->report, STATUS_IO, "out of memory");
    status status = execute(store, "BEGIN IMMEDIATE");
    if (status == STATUS_OK) {
        status = add_run(store, key, row, keys);
        if (status == STATUS_OK)
            status = execute(store, "COMMIT");
        if (status != STATUS_OK)
            sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
    }
    free(keys);
    return status;
}
