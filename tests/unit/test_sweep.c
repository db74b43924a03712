// Sweeps: what a file stands for, what comes of its runs, what is not repeated, and files and databases that are
// refused.
#include "sweep_fixture.h"

#define HEAD "results: sweep.db\ntraces: four.rtxt\nprograms: layer_peel\n"
static const char trace_text[] = "ropsim-trace 1\nsize 2 1\ndraw a transparent\n"
                                 "f 0 0 0.2 1 0 0 0.5 0\nf 0 0 0.4 0 1 0 0.5 1\nf 1 0 0.3 0 0 1 0.5 2\n";

static void start(sweep_fixture *f, const char *text)
{
    char path[256];
    sweep_fixture_start(f, text);
    snprintf(path, sizeof path, "%s/four.rtxt", f->folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(trace_text, file);
    fclose(file);
}

static sweep_totals run(sweep_fixture *f, int jobs)
{
    sweep *sweep = NULL;
    sweep_totals totals = {0};
    assert_int_equal(sweep_open(f->file, &f->messages.report, &sweep), STATUS_OK);
    assert_int_equal(sweep_run(sweep, jobs, &totals), STATUS_OK);
    sweep_close(sweep);
    return totals;
}

static void products_are_counted(void **state)
{
    (void)state;
    static const struct {
        const char *rest;
        unsigned combinations;
    } rows[] = {
        {"machines: tiny\n", 1},
        {"machines: [programmable, tiny]\n", 2},
        {"machines: programmable\nset: {}\n", 1},
        {"machines: programmable\nset:\n  stencil_bits: 4..8\n", 5},
        {"machines: programmable\nset:\n  stencil_bits: [1, 3..5, 8]\n", 5},
        {"machines: programmable\nset:\n  stencil_bits: 3..3\n", 1},
        {"machines: programmable\nset:\n  depth_cache_bytes: 16384..262144*2\n", 5},
        {"machines: programmable\nset:\n  core_mhz: 100..1000+300\n", 4},
        {"machines: programmable\nset: {l2_bytes: [0, 1048576..67108864*4], stencil_bits: 5..8+3}\n", 10},
        {"machines: programmable\nset:\n  core_mhz: 7..7*2\n", 1},
        {"machines: tiny\ndetail: cycle\n", 1},
        {"machines: [programmable, g80]\nset:\n  stencil_bits: 4..8\n  depth_format: [z16, z24, z32f]\n", 30},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[512];
        sweep_fixture f;
        snprintf(text, sizeof text, HEAD "%s", rows[i].rest);
        start(&f, text);
        assert_int_equal(run(&f, 2).combinations, rows[i].combinations);
        assert_int_equal(sweep_fixture_number(f.database, "SELECT count(DISTINCT machine_hash) FROM runs"),
                         rows[i].combinations);
        sweep_fixture_end(&f);
    }
}

static void rows_hold_what_the_replay_gives(void **state)
{
    (void)state;
    sweep_fixture f;
    char trace_path[256], path[4096];
    start(&f, HEAD "machines: programmable\nset: {stencil_bits: 7}\n");
    const sweep_totals totals = run(&f, 1);
    assert_int_equal(totals.done, 1);
    machine machine;
    program *program = NULL;
    trace *trace = NULL;
    run_result *result = NULL;
    snprintf(trace_path, sizeof trace_path, "%s/four.rtxt", f.folder);
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    assert_int_equal(machine_set(&machine, "stencil_bits=7", NULL), STATUS_OK);
    assert_int_equal(program_load("layer_peel", NULL, path, sizeof path, &program), STATUS_OK);
    assert_int_equal(trace_open(trace_path, NULL, &trace), STATUS_OK);
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .reference = true};
    assert_int_equal(replay_run(program, &machine, trace, &options, NULL, &result), STATUS_OK);
    const struct {
        const char *column;
        uint64_t value;
    } counts[] = {{"geometry_passes", result->geometry_passes},
                  {"iterations", result->iterations},
                  {"fragments_replayed", result->fragments_replayed},
                  {"fragments_composited", result->fragments_composited},
                  {"deepest_sample", 2},
                  {"width", 2},
                  {"exact", 1},
                  {"list_kept IS NULL", 1},
                  {"machine_keys ->> 'stencil_bits'", 7},
                  {"max_iterations", 0}};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        char query[128];
        snprintf(query, sizeof query, "SELECT %s FROM runs", counts[i].column);
        assert_int_equal(sweep_fixture_number(f.database, query), counts[i].value);
    }
    assert_int_equal(sweep_fixture_number(f.database, "SELECT count(*) FROM planes"), result->plane_count);
    uint64_t bytes = 0;
    for (int i = 0; i < result->plane_count; i++)
        bytes += result->planes[i].bytes_read + result->planes[i].bytes_written + result->planes[i].texture_bytes_read;
    assert_int_equal(
        sweep_fixture_number(f.database, "SELECT sum(bytes_read + bytes_written + texture_bytes_read) FROM planes"),
        bytes);
    assert_int_equal(sweep_fixture_number(f.database, "SELECT plane_bytes FROM runs"), bytes);
    result_destroy(result);
    trace_close(trace);
    program_destroy(program);
    sweep_fixture_end(&f);
}

static void refusals_are_rows_and_nothing_runs_twice(void **state)
{
    (void)state;
    sweep_fixture f;
    start(&f, "results: sweep.db\ntraces: [four.rtxt, ./four.rtxt]\n"
              "programs: [layer_peel, ideal_coherent_layer_peel]\nmachines: [g80, programmable, g80]\n");
    // Two names of one trace and one machine twice: four runs stand behind twelve combinations.
    sweep_totals totals = run(&f, 3);
    assert_int_equal(totals.combinations, 12);
    assert_int_equal(totals.done, 3);
    assert_int_equal(totals.refused, 1);
    assert_int_equal(totals.there, 8);
    assert_int_equal(f.messages.count, 0);
    assert_int_equal(sweep_fixture_number(f.database,
                                          "SELECT count(*) FROM runs WHERE outcome = 'refused' AND machine = 'g80' AND"
                                          " why LIKE '%no programmable ROP%' AND geometry_passes IS NULL"),
                     1);
    char *before = sweep_fixture_content(f.database);
    totals = run(&f, 1);
    assert_int_equal(totals.there, 12);
    assert_int_equal(totals.done + totals.refused, 0);
    char *after = sweep_fixture_content(f.database);
    assert_string_equal(after, before);
    free(before);
    free(after);
    // A limit of iterations is another run.
    sweep_fixture_write(&f, HEAD "machines: programmable\nmax_iterations: 1\n");
    totals = run(&f, 1);
    assert_int_equal(totals.done, 1);
    assert_int_equal(
        sweep_fixture_number(f.database, "SELECT iteration_limit_reached FROM runs WHERE max_iterations = 1"), 1);
    sweep_fixture_end(&f);
}

static void files_are_read_strictly(void **state)
{
    (void)state;
    static const struct {
        const char *text, *wanted;
    } rows[] = {
        {"", "one mapping"},
        {"- a\n", ":1:1: a sweep file is one mapping"},
        {HEAD, "missing key machines"},
        {HEAD "machine: g80\n", ":4:1: unknown key `machine`; did you mean `machines`?"},
        {HEAD "machines: g80\nprograms: layer_peel\n", ":5:1: programs stands here a second time"},
        {HEAD "machines: g81\n", ":4:11: no machine is called `g81`"},
        {HEAD "machines: []\n", ":4:11: machines is an empty list"},
        {HEAD "machines: &a g80\n", "without tags or anchors"},
        {HEAD "machines: !!str g80\n", "without tags or anchors"},
        {HEAD "machines: *a\n", "without tags or anchors"},
        {HEAD "machines: [[g80]]\n", "without tags or anchors"},
        {HEAD "machines: {g80: g80}\n", "without tags or anchors"},
        {HEAD "machines: ''\n", "without tags or anchors"},
        {HEAD "machines: |\n  g80\n", "without tags or anchors"},
        {HEAD "machines: \"g80\\0\"\n", "without tags or anchors"},
        {HEAD "[a]: b\n", ":4:1: a key must be a word"},
        {HEAD "machines: [g80\n", "sweep.yaml:"},
        {HEAD "machines: g80\n---\na: b\n", "holds one document"},
        {HEAD "machines: g80\nset: 3\n", ":5:6: set is a map"},
        {HEAD "machines: g80\nset:\n  stencil_bit: 3\n", "did you mean `stencil_bits`?"},
        {HEAD "machines: g80\nset:\n  stencil_bits: 3\n  stencil_bits: 4\n",
         ":7:3: this machine key is set a second time"},
        {HEAD "machines: g80\nset:\n  stencil_bits: 7..9\n", ":6:17: "},
        {HEAD "machines: g80\nset:\n  stencil_bits: 8..7\n", "the range 8..7 must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  core_mhz: 100..1000+200\n",
         ":6:13: the range 100..1000+200 does not meet 1000: it has 900, then 1100"},
        {HEAD "machines: g80\nset:\n  core_mhz: [5, 100..1000*3]\n",
         ":6:17: the range 100..1000*3 does not meet 1000: it has 900, then 2700"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8*1\n", "factor of at least 2"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8*-2\n", "factor of at least 2"},
        {HEAD "machines: g80\nset:\n  core_mhz: 0..8*2\n", "must begin at 1 or above"},
        {HEAD "machines: g80\nset:\n  core_mhz: -4..8*2\n", "must begin at 1 or above"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8+0\n", "a step of at least 1"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8+-1\n", "a step of at least 1"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8+\n", "must be LOW..HIGH, LOW..HIGH+STEP or LOW..HIGH*FACTOR"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8*2+1\n", "must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..8..9\n", "must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..99999999999*2\n", "must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  core_mhz: 1..2147483647+1\n", "at most 1024 integers"},
        {HEAD "machines: g80\nset:\n  core_mhz: [1..1000, 1001..2000]\n", "core_mhz is given more than 1024 values"},
        {HEAD "machines: g80\nset:\n  stencil_bits: 4..16*2\n", ":6:17: stencil_bits is `16`"},
        {HEAD "machines: g80\ndetail: cycles\n",
         ":5:9: detail is `cycles`, but must be function, traffic, cycle or sampled; did you mean `cycle`?"},
        {HEAD "machines: g80\ndetail: [cycle, function, cycle]\n", ":5:27: detail is given cycle a second time"},
        {HEAD "machines: g80\ndetail: []\n", "detail is an empty list"},
        {HEAD "machines: g80\ndetail: {cycle: 1}\n", "without tags or anchors"},
        {HEAD "machines: g80\nset:\n  instructions_max: 1..9223372036854775807\n", "must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  instructions_max: -9223372036854775808..9223372036854775807\n",
         "must be LOW..HIGH"},
        {HEAD "machines: g80\nset:\n  bits_per_sample_max: 1..2000\n", "at most 1024 integers"},
        {HEAD "machines: g80\nset:\n  stencil_bits: [5, 4..6]\n", "stencil_bits is given 5 a second time"},
        {HEAD "machines: g80\nset:\n  depth_format: z99\n", ":6:17: "},
        {HEAD "machines: g80\nset:\n  depth_format: []\n", "depth_format is an empty list"},
        {HEAD "machines: g80\nset:\n  bits_per_sample_max: 1..1000\n  list_entries_max: 1..1000\n",
         "more than 100000 runs"},
        {HEAD "machines: g80\nthreads: 1025\n", "threads is `1025`, but must be an integer from 0 to 1024"},
        {HEAD "machines: g80\nmax_iterations: -1\n", "max_iterations is `-1`"},
        {HEAD "machines: g80\nmax_iterations: 99999999999999999999\n", "must be an integer from 0"},
        {"results: sweep.db\ntraces: none.ropt\nprograms: layer_peel\nmachines: g80\n", ":2:9: "},
        {"results: sweep.db\ntraces: four.rtxt\nprograms: layer_pel\nmachines: g80\n", "did you mean `layer_peel`?"},
        {"results: sweep.db\ntraces: four.rtxt\nprograms: \"layer_peel,x=1\"\nmachines: g80\n", ":3:11: "},
        {"results: sweep.db\ntraces: record scene:knot size=64\nprograms: layer_peel\nmachines: g80\n",
         ":2:9: `size=64` must be size=WxH"},
        {"results: sweep.db\ntraces: record scene:knot samples=3\nprograms: layer_peel\nmachines: g80\n",
         "samples=1, 2, 4, 8 or 16"},
        {"results: sweep.db\ntraces: record size=4x4\nprograms: layer_peel\nmachines: g80\n", "no scene to record"},
        {"results: sweep.db\ntraces: record scene:knott\nprograms: layer_peel\nmachines: g80\n", ":2:9: "},
        {"results: no/folder/sweep.db\ntraces: four.rtxt\nprograms: layer_peel\nmachines: g80\n", "no/folder/sweep.db"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        sweep_fixture f;
        sweep *sweep = NULL;
        start(&f, rows[i].text);
        const status status = sweep_open(f.file, &f.messages.report, &sweep);
        if (status == STATUS_OK || sweep || !strstr(f.messages.text, rows[i].wanted))
            fail_msg("row %zu, wanted `%s`, said: %s", i, rows[i].wanted, f.messages.text);
        sweep_fixture_end(&f);
    }
}

// Cut and garbled files end in a message or a sweep, never in a crash; the sanitizers watch.
static void garbled_files_end_well(void **state)
{
    (void)state;
    static const char whole[] =
        HEAD "machines: [g80, tiny]\nset:\n  stencil_bits: [4..6, 8]\n  depth_format: z16\nthreads: 1\n";
    unsigned seed = 7;
    sweep_fixture f;
    start(&f, whole);
    int opened = 0;
    for (size_t i = 0; i < 2 * sizeof whole; i++) {
        char text[sizeof whole];
        memcpy(text, whole, sizeof whole);
        if (i < sizeof whole)
            text[i] = 0;
        else
            text[rand_r(&seed) % (sizeof whole - 1)] = "[]{}:&*!,.-\n \"'\t9"[rand_r(&seed) % 17];
        sweep_fixture_write(&f, text);
        sweep *sweep = NULL;
        messages_start(&f.messages);
        const status status = sweep_open(f.file, &f.messages.report, &sweep);
        assert_true((status == STATUS_OK) == (sweep != NULL));
        assert_true(status == STATUS_OK || f.messages.count > 0);
        opened += status == STATUS_OK;
        sweep_close(sweep);
    }
    assert_true(opened > 0);
    sweep_fixture_end(&f);
}

static void refuse_database(sweep_fixture *f, const char *wanted)
{
    sweep *sweep = NULL;
    messages_start(&f->messages);
    assert_int_equal(sweep_open(f->file, &f->messages.report, &sweep), STATUS_REFUSED);
    assert_null(sweep);
    assert_non_null(strstr(f->messages.text, wanted));
}

static void databases_of_others_are_left_alone(void **state)
{
    (void)state;
    sweep_fixture f;
    start(&f, HEAD "machines: tiny\n");
    FILE *file = fopen(f.database, "w");
    fputs("a letter", file);
    fclose(file);
    refuse_database(&f, "is not the database of a sweep");
    char kept[32] = "";
    file = fopen(f.database, "r");
    assert_non_null(fgets(kept, sizeof kept, file));
    fclose(file);
    assert_string_equal(kept, "a letter");

    remove(f.database);
    sqlite3 *other = NULL;
    assert_int_equal(sqlite3_open(f.database, &other), SQLITE_OK);
    assert_int_equal(sqlite3_exec(other, "CREATE TABLE runs (a); INSERT INTO runs VALUES (5)", NULL, NULL, NULL),
                     SQLITE_OK);
    sqlite3_close(other);
    refuse_database(&f, "is not the database of a sweep");
    assert_int_equal(sweep_fixture_number(f.database, "SELECT a FROM runs"), 5);

    remove(f.database);
    run(&f, 1);
    other = sweep_fixture_open(f.database);
    assert_int_equal(sqlite3_exec(other, "PRAGMA user_version = 99", NULL, NULL, NULL), SQLITE_OK);
    sqlite3_close(other);
    refuse_database(&f, "version 99");
    sweep_fixture_end(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(products_are_counted),
        cmocka_unit_test(rows_hold_what_the_replay_gives),
        cmocka_unit_test(refusals_are_rows_and_nothing_runs_twice),
        cmocka_unit_test(files_are_read_strictly),
        cmocka_unit_test(garbled_files_end_well),
        cmocka_unit_test(databases_of_others_are_left_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
