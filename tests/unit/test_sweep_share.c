// Runs that share what they read and the function level: their rows are those of runs that share nothing, and what is
// shared is counted, as is what must not be.
#include "sweep_fixture.h"

#include "../../sim/sweep/sweep.h"

static sweep *open(sweep_fixture *f, const char *text)
{
    sweep *sweep = NULL;
    sweep_fixture_start(f, text);
    if (sweep_open(f->file, &f->messages.report, &sweep) != STATUS_OK)
        fail_msg("%s", f->messages.text);
    return sweep;
}

static void end(sweep_fixture *f, sweep *sweep)
{
    sweep_close(sweep);
    sweep_fixture_end(f);
}

static bool is_time(int column)
{
    return column == STAT_wall_seconds || column == STAT_fragments_per_second || column == STAT_detail_wall_seconds;
}

static void assert_same_row(const sweep_row *a, const sweep_row *b, const char *where)
{
    if (a->outcome != b->outcome || strcmp(a->why, b->why) != 0)
        fail_msg("%s: %s (%s), not %s (%s)", where, sweep_outcome_names[a->outcome], a->why,
                 sweep_outcome_names[b->outcome], b->why);
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++) {
        const sweep_value *x = &a->stats[i], *y = &b->stats[i];
        if (x->known != y->known ||
            (!is_time(i) && (x->count != y->count || memcmp(&x->real, &y->real, sizeof x->real) != 0)))
            fail_msg("%s: %s differs", where, sweep_get_column(i).name);
    }
    assert_int_equal(a->plane_count, b->plane_count);
    assert_memory_equal(a->planes, b->planes, sizeof a->planes);
}

// Runs it with what is kept, and with nothing; both must give the same.
static sweep_outcome run(sweep_share *share, const sweep *sweep, const sweep_combination *combination,
                         const char *where)
{
    sweep_share nothing = {0};
    static sweep_row shared, alone;
    sweep_share_run(share, sweep, combination, &shared);
    sweep_share_run(&nothing, sweep, combination, &alone);
    sweep_share_drop(&nothing);
    assert_same_row(&shared, &alone, where);
    return shared.outcome;
}

static sweep_outcome run_number(sweep_share *share, const sweep *sweep, uint64_t index)
{
    char where[64];
    const sweep_combination combination = sweep_get(sweep, index);
    snprintf(where, sizeof where, "run %u", (unsigned)index);
    return run(share, sweep, &combination, where);
}

static void assert_counts(const sweep_share *share, uint64_t opened, uint64_t read, uint64_t replayed)
{
    assert_int_equal(share->counts.opened, opened);
    assert_int_equal(share->counts.read, read);
    assert_int_equal(share->counts.replayed, replayed);
}

// ---- Rows ----------------------------------------------------------------------------------------------

// 2 traces x 4 levels x 2 programs x 2 machines x 2 x 2 settings.
static const char all_levels[] = "results: sweep.db\n"
                                 "traces:\n"
                                 "  - record scene:knot,rings=24 size=40x40 samples=2\n"
                                 "  - record opaque:scene:knot scene:soup,count=100 size=48x32\n"
                                 "programs: [layer_peel, ideal_coherent_layer_peel]\n"
                                 "machines: [programmable, tiled]\n"
                                 "detail: [function, traffic, cycle, sampled]\n"
                                 "set: {depth_format: [z16, z24], depth_cache_bytes: [8192, 16384]}\n";

static void runs_in_order_share(void **state)
{
    (void)state;
    sweep_fixture f;
    sweep_share share = {0};
    sweep *sweep = open(&f, all_levels);
    const uint64_t runs = sweep_count(sweep);
    assert_int_equal(runs, 128);
    for (uint64_t i = 0; i < runs; i++)
        assert_int_equal(run_number(&share, sweep, i), OUTCOME_DONE);
    // Every second run differs from the one before in its depth cache alone; the function level reads no stamps.
    assert_counts(&share, 2, runs / 4 * 3 / 2, runs / 2);
    sweep_share_drop(&share);
    end(&f, sweep);
}

// After each run each other one: programs that want other columns of a trace, and machines that order it in other ways.
static void any_run_may_follow_any(void **state)
{
    (void)state;
    sweep_fixture f;
    static sweep_row alone[24], row;
    sweep *sweep = open(&f, "results: sweep.db\n"
                            "traces: record opaque:scene:knot,rings=8 scene:sheets,count=5,order=shuffled size=24x16\n"
                            "programs: [layer_peel, depth_complexity, item_buffer]\n"
                            "machines: programmable\n"
                            "detail: [traffic, sampled]\n"
                            "set: {tile_based: [false, true], region_pixels: [8, 16]}\n");
    const uint64_t runs = sweep_count(sweep);
    uint64_t read = 0;
    assert_int_equal(runs, 24);
    for (uint64_t i = 0; i < runs; i++) {
        sweep_share share = {0};
        const sweep_combination combination = sweep_get(sweep, i);
        sweep_share_run(&share, sweep, &combination, &alone[i]);
        assert_int_equal(alone[i].outcome, OUTCOME_DONE);
        sweep_share_drop(&share);
    }
    for (uint64_t i = 0; i < runs * runs; i++) {
        char where[64];
        sweep_share share = {0};
        const sweep_combination first = sweep_get(sweep, i / runs), second = sweep_get(sweep, i % runs);
        snprintf(where, sizeof where, "run %u after %u", (unsigned)(i % runs), (unsigned)(i / runs));
        sweep_share_run(&share, sweep, &first, &row);
        sweep_share_run(&share, sweep, &second, &row);
        assert_same_row(&row, &alone[i % runs], where);
        read += share.counts.read;
        sweep_share_drop(&share);
    }
    // Most pairs read twice; those that read once are more than the runs that follow themselves, since without regions
    // their size does not matter.
    assert_true(read > runs * runs * 3 / 2 && read < 2 * runs * runs - runs);
    end(&f, sweep);
}

// ---- Keys ----------------------------------------------------------------------------------------------

// Of the same class.
static format other_format(format of)
{
    int other = 0;
    while (other == (int)of || format_table[other].class != format_table[of].class)
        other++;
    return (format)other;
}

// Sets a key to a value that it takes and does not have; by its place in params.def.
static void change_key(machine *machine, int wanted)
{
    int key = 0;
#define PARAM_INT(name, min, max, unit, meaning) \
    if (key++ == wanted) \
        machine->name = machine->name > (min) ? machine->name - 1 : machine->name + 1;
#define PARAM_BOOL(name, meaning) \
    if (key++ == wanted) \
        machine->name = !machine->name;
#define PARAM_FORMAT(name, class, meaning) \
    if (key++ == wanted) \
        machine->name = other_format(machine->name);
#define PARAM_CHOICE(name, words, meaning) \
    if (key++ == wanted) \
        machine->name = !machine->name;
#define PARAM_SET(name, table, meaning) \
    if (key++ == wanted) \
        machine->name &= machine->name - 1;
#include "../../sim/params.def"
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_FORMAT
#undef PARAM_CHOICE
#undef PARAM_SET
}

static bool changes_pixels(const char *key)
{
    static const char *const keys[] = {
        "fixed_function",    "depth_format",    "color_format",     "stencil_bits", "range_clip",
        "formats",           "opcodes",         "list_entries_max", "planes_max",   "bits_per_sample_max",
        "color_targets_max", "instructions_max"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        if (strcmp(keys[i], key) == 0)
            return true;
    return false;
}

// After the run of a machine, that of one with another value of one key. Returns whether the function level was shared,
// for keys of which machines with that value are run at all.
static void change_and_run(const sweep *sweep, const sweep_combination *first, int key, int *shared, int *anew)
{
    sweep_share share = {0};
    sweep_variant changed = *first->variant;
    sweep_combination second = *first;
    machine_value value;
    assert_true(machine_get_value(&first->variant->machine, key, &value));
    change_key(&changed.machine, key);
    second.variant = &changed;
    assert_int_equal(run(&share, sweep, first, value.key), OUTCOME_DONE);
    if (run(&share, sweep, &second, value.key) == OUTCOME_DONE) {
        assert_int_equal(share.counts.opened, 1);
        assert_int_equal(share.counts.replayed, changes_pixels(value.key) ? 2 : 1);
        *shared += share.counts.replayed == 1;
        *anew += share.counts.replayed == 2;
    }
    sweep_share_drop(&share);
}

static void what_changes_pixels_is_not_shared(void **state)
{
    (void)state;
    sweep_fixture f;
    machine_value value;
    int keys = 0, shared = 0, anew = 0;
    sweep *sweep = open(&f, "results: sweep.db\n"
                            "traces: record opaque:scene:knot,rings=8 scene:sheets,count=9,order=shuffled size=24x16\n"
                            "programs: [hybrid_layer_peel, a_buffer]\n"
                            "machines: [modern, abuffer]\n"
                            "detail: sampled\n");
    while (machine_get_value(&sweep->variants[0].machine, keys, &value))
        keys++;
    for (uint64_t i = 0; i < sweep_count(sweep); i++) {
        const sweep_combination first = sweep_get(sweep, i);
        sweep_share share = {0};
        const bool runs = run(&share, sweep, &first, first.program->label) == OUTCOME_DONE;
        sweep_share_drop(&share);
        for (int key = 0; runs && key < keys; key++)
            change_and_run(sweep, &first, key, &shared, &anew);
    }
    print_message("%d keys, %d runs shared the function level, %d did not\n", keys, shared, anew);
    assert_true(shared > 100 && anew > 20);
    end(&f, sweep);
}

// ---- What goes wrong -----------------------------------------------------------------------------------

static void refusals_keep_and_failures_drop(void **state)
{
    (void)state;
    sweep_fixture f;
    sweep_share share = {0};
    // One that runs, one whose chip is too small, and both again with lines that contradict the machine.
    sweep *sweep = open(&f, "results: sweep.db\n"
                            "traces: record scene:knot,rings=8 size=32x32\n"
                            "programs: layer_peel\n"
                            "machines: tiled\n"
                            "detail: traffic\n"
                            "set: {line_bytes: [64, 48], on_chip_overflow: refuse, on_chip_bits: [1024, 8]}\n");
    assert_int_equal(sweep_count(sweep), 4);
    assert_int_equal(run_number(&share, sweep, 0), OUTCOME_DONE);
    assert_int_equal(run_number(&share, sweep, 1), OUTCOME_REFUSED);
    assert_int_equal(run_number(&share, sweep, 2), OUTCOME_REFUSED);
    assert_int_equal(run_number(&share, sweep, 0), OUTCOME_DONE);
    assert_counts(&share, 1, 1, 1);
    // The file is another than the run means.
    sweep_combination other = sweep_get(sweep, 0);
    sweep_trace trace = *other.trace;
    trace.hash[0] = trace.hash[0] == '0' ? '1' : '0';
    other.trace = &trace;
    assert_int_equal(run(&share, sweep, &other, "another trace"), OUTCOME_FAILED);
    assert_null(share.trace);
    assert_null(share.stamps);
    assert_null(share.function);
    assert_int_equal(run_number(&share, sweep, 0), OUTCOME_DONE);
    assert_counts(&share, 3, 2, 2);
    sweep_share_drop(&share);
    end(&f, sweep);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(runs_in_order_share),
        cmocka_unit_test(any_run_may_follow_any),
        cmocka_unit_test(what_changes_pixels_is_not_shared),
        cmocka_unit_test(refusals_keep_and_failures_drop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
