// The database of a sweep: finds runs by their key, adds a run in one transaction.
//
// SQLite's own rollback journal keeps it whole when the process is killed at any moment.
#include "sweep_store.h"

#include <jansson.h>
#include <stdlib.h>
#include <string.h>

enum { BUSY_MILLISECONDS = 30000 };

#define KEY_IS \
    "version = ?1 AND detail = ?2 AND program_hash = ?3 AND trace_hash = ?4 AND machine_hash = ?5" \
    " AND max_iterations = ?6"
enum { KEY_COLUMN_COUNT = 6, LABELS_FROM = 7, STATS_FROM = 13, FOUND_FROM = 2 };

status store_fail(const sweep_store *store)
{
    return report_error(store->report, STATUS_IO, "%s: %s", store->path, sqlite3_errmsg(store->database));
}

status store_execute(sweep_store *store, const char *text)
{
    return sqlite3_exec(store->database, text, NULL, NULL, NULL) == SQLITE_OK ? STATUS_OK : store_fail(store);
}

static status prepare(sweep_store *store, const char *text, sqlite3_stmt **statement)
{
    return sqlite3_prepare_v2(store->database, text, -1, statement, NULL) == SQLITE_OK ? STATUS_OK : store_fail(store);
}

static status prepare_find(sweep_store *store)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return report_error(store->report, STATUS_IO, "%s: out of memory", store->path);
    fputs("SELECT outcome, why", out);
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++)
        fprintf(out, ", \"%s\"", sweep_get_column(i).name);
    fputs(" FROM runs WHERE " KEY_IS, out);
    const bool written = fclose(out) == 0;
    const status status = written ? prepare(store, text, &store->find) : STATUS_IO;
    free(text);
    return status;
}

// One parameter a column, in their order.
static status prepare_add(sweep_store *store)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return report_error(store->report, STATUS_IO, "%s: out of memory", store->path);
    fputs("INSERT OR IGNORE INTO runs (" KEY_COLUMNS ", program, trace, machine, machine_keys, outcome, why", out);
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++)
        fprintf(out, ", \"%s\"", sweep_get_column(i).name);
    fputs(") VALUES (?", out);
    for (int i = 2; i < STATS_FROM + SWEEP_COLUMN_COUNT; i++)
        fputs(", ?", out);
    fputs(")", out);
    const bool written = fclose(out) == 0;
    const status status = written ? prepare(store, text, &store->add) : STATUS_IO;
    free(text);
    return status;
}

status store_open(const char *path, const report *report, sweep_store **store)
{
    *store = NULL;
    status status = schema_check_file(path, report);
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
        status = schema_prepare(new);
    }
    if (status == STATUS_OK)
        status = prepare_find(new);
    if (status == STATUS_OK)
        status = prepare(new, "DELETE FROM runs WHERE outcome = 'failed' AND " KEY_IS, &new->forget);
    if (status == STATUS_OK)
        status = prepare_add(new);
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
    bind_text(statement, 2, key->detail->name);
    bind_text(statement, 3, key->program->hash);
    bind_text(statement, 4, key->trace->hash);
    bind_text(statement, 5, key->variant->hash);
    sqlite3_bind_int64(statement, KEY_COLUMN_COUNT, (int64_t)key->max_iterations);
}

static sweep_value found_value(sqlite3_stmt *find, int column)
{
    const int at = FOUND_FROM + column;
    sweep_value value = {.known = sqlite3_column_type(find, at) != SQLITE_NULL};
    if (!value.known || sweep_column_kind(column) != COLUMN_RESOURCE) {
        value.count = sqlite3_column_int64(find, at);
        value.real = sqlite3_column_double(find, at);
        return value;
    }
    const char *word = (const char *)sqlite3_column_text(find, at);
    value.known = false;
    for (int i = 0; word && i <= RESOURCE_COUNT; i++) {
        if (strcmp(word, clock_resource_names[i]) == 0)
            value = (sweep_value){.known = true, .count = i};
    }
    return value;
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
        for (int i = 0; i < SWEEP_COLUMN_COUNT; i++)
            row->stats[i] = found_value(find, i);
    }
    const status status = *found || step == SQLITE_DONE ? STATUS_OK : store_fail(store);
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
    const status status = done ? STATUS_OK : store_fail(store);
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

static void bind_value(sqlite3_stmt *add, int at, column_kind kind, const sweep_value *value)
{
    if (!value->known)
        return;
    switch (kind) {
    case COLUMN_COUNT: sqlite3_bind_int64(add, at, value->count); break;
    case COLUMN_REAL: sqlite3_bind_double(add, at, value->real); break;
    case COLUMN_RESOURCE: bind_text(add, at, clock_resource_names[value->count]); break;
    }
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
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++)
        bind_value(add, STATS_FROM + i, sweep_column_kind(i), &row->stats[i]);
    status = run_once(store, add);
    return status == STATUS_OK && sqlite3_changes(store->database) > 0 ? add_planes(store, row) : status;
}

status store_add(sweep_store *store, const sweep_combination *key, const sweep_row *row)
{
    char *keys = machine_json(&key->variant->machine);
    if (!keys)
        return report_error(store->report, STATUS_IO, "out of memory");
    status status = store_execute(store, "BEGIN IMMEDIATE");
    if (status == STATUS_OK) {
        status = add_run(store, key, row, keys);
        if (status == STATUS_OK)
            status = store_execute(store, "COMMIT");
        if (status != STATUS_OK)
            sqlite3_exec(store->database, "ROLLBACK", NULL, NULL, NULL);
    }
    free(keys);
    return status;
}
