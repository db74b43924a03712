// No run is faster than its busiest resources: each pass is at least as long as each of its bounds, on every machine
// and for traces, scenes and programs of all kinds; and what streams through one resource comes within 5 per cent of
// its bound.
#include "cost_fixture.h"

#include <unistd.h>

enum { NAMES_MAX = 64 };

static const char *const machines[] = {"g80", "programmable", "abuffer", "tiled", "tiny", "modern"};
enum { MACHINES = sizeof machines / sizeof *machines };

static void check_bounds(const detail_result *detail, const char *what)
{
    uint64_t sum = 0, last = 0;
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        const pass_record *pass = &detail->passes[i];
        uint64_t most = 0;
        for (int r = 0; r < RESOURCE_COUNT; r++)
            most = pass->bounds[r] > most ? pass->bounds[r] : most;
        if (pass->start != last || pass->last_fragment < pass->start || pass->drained < pass->last_fragment ||
            most > pass->drained - pass->start || pass->statistics.cycles != pass->drained - pass->start)
            fail_msg("%s on %s, pass %d: %d to %d, %d, bound %d", what, detail->machine.name, (int)i, (int)pass->start,
                     (int)pass->last_fragment, (int)pass->drained, (int)most);
        sum += most;
        last = pass->drained;
    }
    assert_int_equal(detail->bound_cycles, sum);
    assert_int_equal(detail->drained_cycles, last);
    assert_true(detail->drained_cycles >= detail->bound_cycles && detail->cycles <= detail->drained_cycles);
}

// All programs that the machine runs.
static int run_programs(trace *trace, const char *what, const char *const *programs, int count)
{
    int runs = 0;
    for (int p = 0; p < count; p++) {
        char path[4096];
        program *program = NULL;
        assert_int_equal(program_load(programs[p], NULL, path, sizeof path, &program), STATUS_OK);
        for (int m = 0; m < MACHINES; m++) {
            const machine machine = cost_machine(machines[m], NULL);
            rop_limits limits;
            machine_limits(&machine, &limits);
            if (verify_program(program, path, &limits, NULL) != STATUS_OK)
                continue;
            detail_result *detail = cost_trace_at(program, &machine, trace, DETAIL_CYCLE);
            check_bounds(detail, what);
            detail_destroy(detail);
            runs++;
        }
        program_destroy(program);
    }
    return runs;
}

static void shipped_traces(void **state)
{
    (void)state;
    static const char *const names[] = {"classes",         "edge_samples", "empty", "figure2",
                                        "finished_sample", "opaque",       "ties"};
    static char found[NAMES_MAX][NAME_SIZE];
    const char *programs[NAMES_MAX];
    const int count = data_names("programs", ".rop", found, NAMES_MAX);
    int runs = 0;
    assert_true(count > 20);
    for (int i = 0; i < count; i++)
        programs[i] = found[i];
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[4096];
        trace *trace = NULL;
        snprintf(path, sizeof path, "%s/traces/%s.rtxt", ROPSIM_SOURCE, names[i]);
        assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
        runs += run_programs(trace, names[i], programs, count);
        trace_close(trace);
    }
    print_message("%d runs\n", runs);
    assert_true(runs > 500);
}

static void scenes(void **state)
{
    (void)state;
    static const char *const names[] = {"transparent:scene:knot,rings=48,sides=8", "scene:slices_cone,slices=12,grid=8",
                                        "scene:soup,count=200", "scene:sheets,count=8,order=shuffled"};
    static const char *const programs[] = {"layer_peel",   "coherent_layer_peel_a", "hybrid_layer_peel",
                                           "sorted_blend", "k_buffer,k=4",          "weighted_sum",
                                           "a_buffer",     "z_batch_peel"};
    int runs = 0;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char folder[] = "/tmp/ropsim-model-XXXXXX", path[128];
        record_options options;
        trace *trace = NULL;
        record_defaults(&options);
        options.width = 72;
        options.height = 56;
        options.samples = i == 2 ? 4 : 1;
        assert_non_null(mkdtemp(folder));
        snprintf(path, sizeof path, "%s/scene.ropt", folder);
        assert_int_equal(record_scenes(&names[i], 1, &options, path, NULL), STATUS_OK);
        assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
        unlink(path);
        rmdir(folder);
        runs += run_programs(trace, names[i], programs, sizeof programs / sizeof *programs);
        trace_close(trace);
    }
    print_message("%d runs\n", runs);
    assert_true(runs > 100);
}

// ---- Streams -------------------------------------------------------------------------------------------

#define HEAD \
    "program stream\nplane z depth\nplane base rgba\nblend under rgb add dst_alpha one alpha add zero " \
    "one_minus_src_alpha\noutput base\n"
#define TAIL "schedule\nclear z far\nclear base background\ndraw opaque with first\nend\n"
static const char opaque_fill[] = HEAD "pass first\ndepth less z\ntarget base replace color\nend\n" TAIL;
static const char depth_fill[] = HEAD "pass first\ndepth less z\nend\n" TAIL;
static const char slices[] = HEAD "pass first\ndepth less z read_only\ntarget base under color\nend\n" TAIL;

// `layers` full layers on all machines; the share of time that the busiest resource of each pass is taken is at least
// that. On modern six times as many, and 5 per cent less: it is so fast that start and drain show. A tile-based machine
// writes a region back at once, from row to row: 20 less.
static void stream(const char *what, const char *text, uint32_t width, uint32_t height, uint32_t layers, double least)
{
    int below = 0;
    for (int m = 0; m < MACHINES; m++) {
        const machine machine = cost_machine(machines[m], NULL);
        const uint32_t count = strcmp(machines[m], "modern") ? layers : 6 * layers;
        box *boxes = cost_layers(width, height, count, CLASS_OPAQUE);
        box_scene scene = {.width = width, .height = height, .samples = 1, .boxes = boxes, .count = count};
        detail_result *detail = cost_run(text, &machine, &scene);
        const double share = 100.0 * (double)detail->bound_cycles / (double)detail->drained_cycles;
        printf("%-14s %-12s %7d cycles, bound %7d by %-8s %6.2f %%\n", what, machines[m], (int)detail->drained_cycles,
               (int)detail->bound_cycles, clock_resource_names[cost_draw(detail)->bound_by], share);
        check_bounds(detail, what);
        below += share < (machine.tile_based ? 0.8 * least : machine.l2_bytes ? 0.95 * least : least);
        detail_destroy(detail);
        free(boxes);
    }
    assert_int_equal(below, 0);
}

// One layer over cleared planes: written, never read. 96 x 96 blocks are as many for each partition of any machine.
// Both planes take a multiple of as many rows as there are banks: if they began in one bank, tiled would reach 29 per
// cent.
static void an_opaque_fill_streams(void **state)
{
    (void)state;
    stream("opaque fill", opaque_fill, 768, 768, 1, 95);
}

static void a_depth_fill_streams(void **state)
{
    (void)state;
    stream("depth fill", depth_fill, 768, 768, 1, 95);
}

// Slices that stay in the caches: blending binds; but on tiny, where each goes to memory and back.
static void blended_slices_stream(void **state)
{
    (void)state;
    stream("slices", slices, 96, 64, 40, 95);
}

// Where every line is read and written back, the bus turns between both, and rows change: that is no bound, as a better
// controller would lose less. What is lost is largest for compressed lines of 64 bytes, 4 memory clocks each.
static void streams_of_reads_and_writes_turn_the_bus(void **state)
{
    (void)state;
    stream("opaque layers", opaque_fill, 384, 256, 8, 75);
    stream("depth layers", depth_fill, 384, 256, 24, 60);
    stream("slices", slices, 384, 256, 8, 90);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shipped_traces),         cmocka_unit_test(scenes),
        cmocka_unit_test(an_opaque_fill_streams), cmocka_unit_test(a_depth_fill_streams),
        cmocka_unit_test(blended_slices_stream),  cmocka_unit_test(streams_of_reads_and_writes_turn_the_bus),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
