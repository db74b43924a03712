// For tests of sweeps: a folder for sweep files and databases, and what a database holds as one text.
#ifndef ROPSIM_TEST_SWEEP_FIXTURE_H
#define ROPSIM_TEST_SWEEP_FIXTURE_H

#include "messages.h"
#include "../../sim/sweeps.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <sqlite3.h>
#include <stdlib.h>

typedef struct sweep_fixture {
    char folder[64], file[128], database[128];
    messages messages;
} sweep_fixture;

// `text`: of the sweep file, whose results are `sweep.db`.
static inline void sweep_fixture_write(sweep_fixture *f, const char *text)
{
    FILE *file = fopen(f->file, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static inline void sweep_fixture_start(sweep_fixture *f, const char *text)
{
    strcpy(f->folder, "/tmp/ropsim_sweep_XXXXXX");
    assert_non_null(mkdtemp(f->folder));
    snprintf(f->file, sizeof f->file, "%s/sweep.yaml", f->folder);
    snprintf(f->database, sizeof f->database, "%s/sweep.db", f->folder);
    messages_start(&f->messages);
    sweep_fixture_write(f, text);
}

static inline void sweep_fixture_end(sweep_fixture *f)
{
    char line[128];
    snprintf(line, sizeof line, "rm -rf %s", f->folder);
    assert_int_equal(system(line), 0);
}

static inline sqlite3 *sweep_fixture_open(const char *path)
{
    sqlite3 *database = NULL;
    assert_int_equal(sqlite3_open_v2(path, &database, SQLITE_OPEN_READWRITE, NULL), SQLITE_OK);
    return database;
}

static inline void sweep_fixture_execute(const char *path, const char *text)
{
    sqlite3 *database = sweep_fixture_open(path);
    char *error = NULL;
    if (sqlite3_exec(database, text, NULL, NULL, &error) != SQLITE_OK)
        fail_msg("%s: %s", text, error);
    sqlite3_close(database);
}

static inline int64_t sweep_fixture_number(const char *path, const char *query)
{
    sqlite3 *database = sweep_fixture_open(path);
    sqlite3_stmt *statement = NULL;
    assert_int_equal(sqlite3_prepare_v2(database, query, -1, &statement, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_step(statement), SQLITE_ROW);
    const int64_t number = sqlite3_column_int64(statement, 0);
    sqlite3_finalize(statement);
    sqlite3_close(database);
    return number;
}

// Every column of every row but numbers of rows and times, in the order of the keys. Free with free().
static inline char *sweep_fixture_content(const char *path)
{
    static const char *const queries[] = {
        "SELECT * FROM runs ORDER BY trace_hash, program_hash, machine_hash, detail",
        "SELECT p.*, r.program_hash, r.trace_hash, r.machine_hash, r.detail FROM planes p JOIN runs r ON r.id = p.run"
        " ORDER BY r.trace_hash, r.program_hash, r.machine_hash, r.detail, p.number",
    };
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    sqlite3 *database = sweep_fixture_open(path);
    assert_non_null(out);
    for (int q = 0; q < 2; q++) {
        sqlite3_stmt *statement = NULL;
        assert_int_equal(sqlite3_prepare_v2(database, queries[q], -1, &statement, NULL), SQLITE_OK);
        while (sqlite3_step(statement) == SQLITE_ROW) {
            for (int i = 0; i < sqlite3_column_count(statement); i++) {
                const char *name = sqlite3_column_name(statement, i);
                const char *value = (const char *)sqlite3_column_text(statement, i);
                if (strcmp(name, "id") != 0 && strcmp(name, "run") != 0 && !strstr(name, "wall_seconds") &&
                    strcmp(name, "fragments_per_second") != 0)
                    fprintf(out, "%s=%s|", name, value ? value : "NULL");
            }
            fputc('\n', out);
        }
        sqlite3_finalize(statement);
    }
    sqlite3_close(database);
    fclose(out);
    return text;
}

#endif
