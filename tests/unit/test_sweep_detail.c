// Sweeps at the levels traffic and cycle: the database holds the figures of `ropsim run --json`, machines are refused
// with reasons, and databases from before these columns go on.
#include "sweep_fixture.h"

#include "../../sim/sweep/sweep.h"

#include <jansson.h>

static const char peeling[] = "results: sweep.db\n"
                              "traces: record scene:knot,rings=24 size=40x40 samples=2\n"
                              "programs: [layer_peel, ideal_coherent_layer_peel]\n";

static sweep_totals run(sweep_fixture *f)
{
    sweep *sweep = NULL;
    sweep_totals totals = {0};
    const status status = sweep_open(f->file, &f->messages.report, &sweep);
    if (status != STATUS_OK)
        fail_msg("%s", f->messages.text);
    assert_int_equal(sweep_run(sweep, 2, &totals), STATUS_OK);
    sweep_close(sweep);
    return totals;
}

static void columns_have_names_of_their_own(void **state)
{
    (void)state;
    static const machine any;
    machine_value key;
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++) {
        const sweep_column column = sweep_get_column(i);
        for (int k = 0; k < i; k++)
            assert_string_not_equal(column.name, sweep_get_column(k).name);
        for (int k = 0; machine_get_value(&any, k, &key); k++)
            assert_string_not_equal(column.name, key.key);
    }
    assert_string_equal(sweep_get_column(SWEEP_STATISTICS_FROM + STAT_INDEX_cycles).name, "statistic_cycles");
    assert_string_equal(sweep_get_column(SWEEP_STATISTICS_FROM + STAT_INDEX_fragments).name, "fragments");
    assert_string_equal(sweep_get_column(SWEEP_DERIVED_FROM + DERIVED_INDEX_memory_bytes).name, "memory_bytes");
    assert_string_equal(sweep_get_column(sweep_half_width_of(STAT_drained_cycles)).name, "statistic_cycles_half_width");
    assert_string_equal(sweep_get_column(sweep_half_width_of(SWEEP_STATISTICS_FROM + STAT_INDEX_row_hits)).name, "row_hits_half_width");
    assert_int_equal(sweep_half_width_of(STAT_plane_bytes), -1);
}

// ---- Against ropsim run --json -------------------------------------------------------------------------

// What the command writes for one row of the database. `trace`: the one that the sweep recorded.
static json_t *run_command(const sweep_fixture *f, const char *program, const char *machine, const char *set,
                           const char *detail)
{
    char line[1024], path[256];
    snprintf(path, sizeof path, "%s/run.json", f->folder);
    snprintf(line, sizeof line, "%s run %s %s.traces/*.ropt --machine %s --set %s --detail %s --json %s >/dev/null",
             ROPSIM_COMMAND, program, f->database, machine, set, detail, path);
    assert_int_equal(system(line), 0);
    json_t *object = json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(object);
    return object;
}

static void compare(sqlite3_stmt *statement, int column, const json_t *value, const char *where)
{
    const char *name = sqlite3_column_name(statement, column);
    const int type = sqlite3_column_type(statement, column);
    bool same = false;
    if (!value || json_is_null(value))
        same = type == SQLITE_NULL;
    else if (json_is_integer(value))
        same = type == SQLITE_INTEGER && sqlite3_column_int64(statement, column) == json_integer_value(value);
    else if (json_is_real(value))
        same = type == SQLITE_FLOAT && sqlite3_column_double(statement, column) == json_real_value(value);
    if (!same)
        fail_msg("%s: %s is %s, not what the command says", where, name, sqlite3_column_text(statement, column));
}

// The word that `passes` give: where most cycles are.
static const char *longest_bound(const json_t *passes)
{
    int64_t cycles[RESOURCE_COUNT + 1] = {0};
    int longest = 0;
    for (size_t i = 0; i < json_array_size(passes); i++) {
        const json_t *pass = json_array_get(passes, i);
        for (int k = 0; k <= RESOURCE_COUNT; k++) {
            if (strcmp(clock_resource_names[k], json_string_value(json_object_get(pass, "bound_by"))) == 0)
                cycles[k] += json_integer_value(json_object_get(pass, "drained")) -
                             json_integer_value(json_object_get(pass, "start"));
        }
    }
    for (int k = 0; k <= RESOURCE_COUNT; k++)
        longest = cycles[k] > cycles[longest] ? k : longest;
    return clock_resource_names[longest];
}

// Whether a column is half an interval's width: it is what the JSON says of the level sampled, and NULL of all others.
static bool compare_half_width(sqlite3_stmt *statement, int column, const char *stem, const json_t *object, const char *detail)
{
    static const char ending[] = "_half_width";
    char of[NAME_SIZE];
    const size_t length = strlen(stem);
    if (length < sizeof ending || strcmp(stem + length - (sizeof ending - 1), ending) != 0)
        return false;
    snprintf(of, sizeof of, "%.*s", (int)(length - (sizeof ending - 1)), stem);
    json_t *half = json_object_get(json_object_get(object, "half_widths"), of);
    assert_int_equal(half != NULL, strncmp(detail, "sampled", 7) == 0);
    compare(statement, column, half, detail);
    return true;
}

// Every column that the JSON has under its name: those of the result, then statistics, derived numbers and half widths.
static int compare_row(sqlite3_stmt *statement, json_t *object, const char *detail)
{
    json_t *counts = json_object_get(object, "statistics"), *numbers = json_object_get(object, "derived");
    int compared = 0;
    for (int i = 0; i < sqlite3_column_count(statement); i++) {
        const char *name = sqlite3_column_name(statement, i);
        const char *stem = strncmp(name, "statistic_", 10) == 0 ? name + 10 : name;
        compared += compare_half_width(statement, i, stem, object, detail);
        for (int k = 0; k < STATISTIC_COUNT; k++) {
            if (strcmp(stem, statistic_rows[k].name) == 0 && (stem != name || strcmp(name, "cycles") != 0)) {
                compare(statement, i, json_object_get(counts, stem), detail);
                compared++;
            }
        }
        for (int k = 0; k < DERIVED_COUNT; k++) {
            if (strcmp(name, derived_rows[k].name) == 0) {
                compare(statement, i, json_object_get(numbers, name), detail);
                compared++;
            }
        }
        if (strcmp(name, "geometry_passes") == 0 || strcmp(name, "cycles") == 0 ||
            strcmp(name, "drained_cycles") == 0 || strcmp(name, "bound_cycles") == 0)
            compare(statement, i, json_object_get(object, name), detail);
        if (strcmp(name, "bound_by") == 0 && json_object_get(object, "cycles"))
            assert_string_equal((const char *)sqlite3_column_text(statement, i),
                                longest_bound(json_object_get(object, "passes")));
        else if (strcmp(name, "bound_by") == 0)
            assert_int_equal(sqlite3_column_type(statement, i), SQLITE_NULL);
    }
    return compared;
}

static void rows_hold_what_the_command_says(void **state)
{
    (void)state;
    sweep_fixture f;
    char text[512];
    snprintf(text, sizeof text,
             "%smachines: [programmable, tiled]\ndetail: [function, traffic, cycle, sampled, \"sampled,seed=3,window=32,every=4\"]\n"
             "set: {cache_misses_max: [2]}\n",
             peeling);
    sweep_fixture_start(&f, text);
    const sweep_totals totals = run(&f);
    assert_int_equal(totals.combinations, 20);
    assert_int_equal(totals.done, 20);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE detail = 'sampled,every=4,window=32,seed=3'"), 4);
    sqlite3 *database = sweep_fixture_open(f.database);
    sqlite3_stmt *statement = NULL;
    assert_int_equal(sqlite3_prepare_v2(database, "SELECT program, machine, detail, * FROM runs", -1, &statement, NULL),
                     SQLITE_OK);
    int rows = 0;
    for (; sqlite3_step(statement) == SQLITE_ROW; rows++) {
        const char *detail = (const char *)sqlite3_column_text(statement, 2);
        const bool more = strcmp(detail, "sampled,every=4,window=32,seed=3") == 0;
        detail = more ? "sampled --sample-every 4 --sample-window 32 --seed 3" : detail;
        json_t *object = run_command(&f, (const char *)sqlite3_column_text(statement, 0),
                                     (const char *)sqlite3_column_text(statement, 1), "cache_misses_max=2", detail);
        assert_int_equal(compare_row(statement, object, detail), 2 * STATISTIC_COUNT + 1 + DERIVED_COUNT);
        json_decref(object);
    }
    assert_int_equal(rows, 20);
    sqlite3_finalize(statement);
    sqlite3_close(database);
    // A second level's lines are written back after the last fragment.
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE detail = 'cycle' AND"
                                                      " drained_cycles = statistic_cycles AND cycles > 0"),
                     4);
    sweep_fixture_end(&f);
}

// ---- Refusals ------------------------------------------------------------------------------------------

static void machines_are_refused_with_the_reason(void **state)
{
    (void)state;
    sweep_fixture f;
    char text[512];
    // What contradicts itself is refused as `ropsim run` does, at every level; storage on the chip is asked for by the
    // memory model alone.
    snprintf(text, sizeof text,
             "%smachines: tiled\ndetail: [function, traffic, cycle]\n"
             "set: {line_bytes: [48, 64], on_chip_bits: 8, on_chip_overflow: refuse}\n",
             peeling);
    sweep_fixture_start(&f, text);
    const sweep_totals totals = run(&f);
    assert_int_equal(totals.combinations, 12);
    assert_int_equal(totals.done, 2);
    assert_int_equal(totals.refused, 10);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE outcome = 'refused' AND"
                                                      " machine_keys ->> 'line_bytes' = 48 AND"
                                                      " why LIKE '%line_bytes is 48, but must be a power of two%'"),
                     6);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE outcome = 'refused' AND"
                                                      " machine_keys ->> 'line_bytes' = 64 AND detail <> 'function' AND"
                                                      " why LIKE '%keeps 8 on the chip (on_chip_bits)%' AND"
                                                      " geometry_passes IS NULL"),
                     4);
    assert_int_equal(run(&f).there, 12);
    sweep_fixture_end(&f);
}

static void levels_are_read_strictly(void **state)
{
    (void)state;
    static const struct { const char *word, *name, *why; } rows[] = {
        {"cycle", "cycle", NULL},
        {"sampled", "sampled", NULL},
        {"sampled,every=16,window=512,seed=1", "sampled", NULL},
        {"sampled,seed=18446744073709551615,every=4096", "sampled,every=4096,seed=18446744073709551615", NULL},
        {"sampled,window=16", "sampled,window=16", NULL},
        {"sample", NULL, "did you mean `sampled`?"},
        {"cycle,every=4", NULL, "only `sampled` takes more than its name"},
        {"sampled,", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=1", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=4097", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=-4", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=4x", NULL, "`,every=N` from 2 to 4096"},
        {"sampled,every=4,every=4", NULL, "once each"},
        {"sampled,ever=4", NULL, "once each"},
        {"sampled,window=15", NULL, "`,window=STAMPS` from 16 to 262144"},
        {"sampled,seed=18446744073709551616", NULL, "`,seed=N`"},
        {"", NULL, "must be function, traffic, cycle or sampled"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char why[SWEEP_WHY_SIZE] = "";
        sweep_level level;
        assert_int_equal(sweep_read_level(rows[i].word, &level, why), rows[i].name != NULL);
        if (rows[i].name)
            assert_string_equal(level.name, rows[i].name);
        else if (!strstr(why, rows[i].why))
            fail_msg("%s: %s", rows[i].word, why);
    }
}

// ---- Databases of other versions -----------------------------------------------------------------------

// The columns of `runs` when sweeps knew the function level alone.
static const char *const first_columns[] = {"id",
                                            "version",
                                            "detail",
                                            "program_hash",
                                            "trace_hash",
                                            "machine_hash",
                                            "max_iterations",
                                            "program",
                                            "trace",
                                            "machine",
                                            "machine_keys",
                                            "outcome",
                                            "why",
                                            "width",
                                            "height",
                                            "samples",
                                            "geometry_passes",
                                            "passes_transparent",
                                            "passes_sorted",
                                            "fullscreen_passes",
                                            "iterations",
                                            "iteration_limit_reached",
                                            "fragments_in_trace",
                                            "fragments_replayed",
                                            "fragments_composited",
                                            "deepest_sample",
                                            "list_kept",
                                            "list_lost",
                                            "list_entry_bytes",
                                            "plane_bytes",
                                            "exact",
                                            "error_max_abs",
                                            "error_rmse",
                                            "error_psnr_db",
                                            "error_samples_wrong",
                                            "wall_seconds",
                                            "fragments_per_second"};
enum { FIRST_COLUMNS = sizeof first_columns / sizeof *first_columns };

static void drop_later_columns(const char *path)
{
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++) {
        const sweep_column column = sweep_get_column(i);
        char text[256];
        bool first = false;
        for (int k = 0; k < FIRST_COLUMNS; k++)
            first = first || strcmp(column.name, first_columns[k]) == 0;
        snprintf(text, sizeof text, "ALTER TABLE runs DROP COLUMN \"%s\"", column.name);
        if (!first)
            sweep_fixture_execute(path, text);
    }
    assert_int_equal(sweep_fixture_number(path, "SELECT count(*) FROM pragma_table_info('runs')"), FIRST_COLUMNS);
}

static void older_databases_get_the_columns_that_they_lack(void **state)
{
    (void)state;
    sweep_fixture f;
    char text[512];
    snprintf(text, sizeof text, "%smachines: [programmable, g80]\n", peeling);
    sweep_fixture_start(&f, text);
    run(&f);
    char *before = sweep_fixture_content(f.database);
    drop_later_columns(f.database);
    // A run of another version of ropsim is kept beside ours, with a column that we do not know.
    sweep_fixture_execute(f.database, "ALTER TABLE runs ADD COLUMN of_tomorrow REAL;"
                                      "UPDATE runs SET version = '0.0.1', of_tomorrow = 5 WHERE outcome = 'refused'");
    assert_int_equal(run(&f).there, 3);
    sweep_fixture_execute(f.database,
                          "DELETE FROM runs WHERE of_tomorrow = 5; ALTER TABLE runs DROP COLUMN of_tomorrow");
    char *after = sweep_fixture_content(f.database);
    assert_string_equal(after, before);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM pragma_table_info('runs')"),
                     13 + SWEEP_COLUMN_COUNT);
    // And it takes runs of deeper levels.
    snprintf(text, sizeof text, "%smachines: [programmable, g80]\ndetail: [function, cycle]\n", peeling);
    sweep_fixture_write(&f, text);
    const sweep_totals totals = run(&f);
    assert_int_equal(totals.there, 4);
    assert_int_equal(totals.done, 3);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM runs WHERE drained_cycles > 0"), 3);
    free(before);
    free(after);
    sweep_fixture_end(&f);
}

static void columns_of_another_type_are_refused(void **state)
{
    (void)state;
    sweep_fixture f;
    char text[512];
    sweep *sweep = NULL;
    snprintf(text, sizeof text, "%smachines: programmable\n", peeling);
    sweep_fixture_start(&f, text);
    run(&f);
    sweep_fixture_execute(f.database, "ALTER TABLE runs DROP COLUMN row_hits; ALTER TABLE runs DROP COLUMN turnarounds;"
                                      "ALTER TABLE runs ADD COLUMN row_hits TEXT");
    assert_int_equal(sweep_open(f.file, &f.messages.report, &sweep), STATUS_REFUSED);
    assert_non_null(strstr(f.messages.text, "its column row_hits is TEXT, but this command writes INTEGER"));
    // Refused as a whole: nothing was added.
    assert_int_equal(
        sweep_fixture_number(f.database, "SELECT count(*) FROM pragma_table_info('runs') WHERE name = 'turnarounds'"),
        0);
    sweep_fixture_end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(columns_have_names_of_their_own),
        cmocka_unit_test(rows_hold_what_the_command_says),
        cmocka_unit_test(machines_are_refused_with_the_reason),
        cmocka_unit_test(levels_are_read_strictly),
        cmocka_unit_test(older_databases_get_the_columns_that_they_lack),
        cmocka_unit_test(columns_of_another_type_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
