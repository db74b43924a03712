// What keeps the model honest notices: each conserved count changed by one is refused by name, and a queue of no places
// is named instead of a hang.
#include "cost_fixture.h"

#include <stddef.h>
#include <unistd.h>

// ---- Conservation --------------------------------------------------------------------------------------

typedef struct counted {
    memory *memory;
    statistics total;
} counted;

static status begin(void *user, const pass_info *pass)
{
    counted *c = user;
    memory_begin_pass(c->memory, pass, &c->total);
    return STATUS_OK;
}

static status take(void *user, const stamp *stamp)
{
    counted *c = user;
    memory_stamp(c->memory, stamp, &c->total);
    return STATUS_OK;
}

static status end(void *user)
{
    counted *c = user;
    uint32_t partition;
    access_unit cache;
    transfer transfer;
    while (memory_flush(c->memory, false, &partition, &cache, &transfer, &c->total))
        continue;
    return STATUS_OK;
}

#define FIELD(name) offsetof(statistics, name)
static const struct {
    const char *name;
    size_t field;
    const char *said;
} conserved[] = {
    {"fragments", FIELD(fragments), "fragments and their verdicts"},
    {"fragments_hierarchical", FIELD(fragments_hierarchical), "fragments and their verdicts"},
    {"fragments_early", FIELD(fragments_early), "fragments and their verdicts"},
    {"fragments_discarded", FIELD(fragments_discarded), "fragments and their verdicts"},
    {"fragments_failed", FIELD(fragments_failed), "fragments and their verdicts"},
    {"fragments_passed", FIELD(fragments_passed), "fragments and their verdicts"},
    {"lines_dirtied", FIELD(lines_dirtied), "lines changed and written back"},
    {"depth_writebacks", FIELD(depth_writebacks), "lines changed and written back"},
    {"color_writebacks", FIELD(color_writebacks), "lines changed and written back"},
    {"memory_bytes_read", FIELD(memory_bytes_read), "bytes read from memory"},
    {"memory_bytes_written", FIELD(memory_bytes_written), "bytes written to memory"},
    {"rop_bytes_read", FIELD(rop_bytes_read), "bytes into caches"},
    {"rop_bytes_written", FIELD(rop_bytes_written), "bytes out of caches"},
    {"geometry_bytes", FIELD(geometry_bytes), "geometry"},
    {"list_bytes", FIELD(list_bytes), "lists"},
};

static void a_count_off_by_one_is_refused(void **state)
{
    (void)state;
    const box boxes[] = {{0, 0, 20, 12, 0.5, CLASS_OPAQUE},
                         {4, 4, 24, 16, 0.25, CLASS_TRANSPARENT},
                         {0, 0, 24, 16, 0.75, CLASS_TRANSPARENT}};
    const machine machine = cost_machine("g80", NULL);
    box_scene scene = {
        .width = 24, .height = 16, .samples = 1, .boxes = boxes, .count = 3, .triangles = 4, .vertices = 8};
    char path[4096];
    program *program = NULL;
    run_result *function = NULL;
    arrival *arrival = NULL;
    counted c = {0};
    messages said;
    messages_start(&said);
    assert_int_equal(program_load("layer_peel", NULL, path, sizeof path, &program), STATUS_OK);
    trace *trace = cost_trace(&scene);
    const run_options options = {.threads = 1, .occlusion_ratio = -1, .keep_planes = true, .log_conditions = true};
    assert_int_equal(replay_run(program, &machine, trace, &options, NULL, &function), STATUS_OK);
    assert_int_equal(arrival_create(program, &machine, trace, function,
                                    &(arrival_options){.hierarchical = true, .early = true}, NULL, &arrival),
                     STATUS_OK);
    assert_int_equal(memory_create(&machine, arrival_frame(arrival), &said.report, &c.memory), STATUS_OK);
    assert_int_equal(
        arrival_run(arrival, &(stamp_sink){.begin_pass = begin, .stamp = take, .end_pass = end, .user = &c}),
        STATUS_OK);
    assert_int_equal(memory_check(c.memory, &c.total, &said.report), STATUS_OK);
    assert_int_equal(said.count, 0);
    for (size_t i = 0; i < sizeof conserved / sizeof *conserved; i++) {
        for (int change = -1; change <= 1; change += 2) {
            statistics changed = c.total;
            *(uint64_t *)(void *)((char *)&changed + conserved[i].field) += (uint64_t)(int64_t)change;
            messages_start(&said);
            if (memory_check(c.memory, &changed, &said.report) != STATUS_REFUSED ||
                !strstr(said.text, conserved[i].said))
                fail_msg("%s off by %d: \"%s\" does not say \"%s\"", conserved[i].name, change, said.text,
                         conserved[i].said);
        }
    }
    memory_destroy(c.memory);
    arrival_destroy(arrival);
    result_destroy(function);
    trace_close(trace);
    program_destroy(program);
}

// Whatever the model of memory counts is what channels move. On tiny a memory clock is a cycle of 8 bytes and bursts
// have 8.
static void channels_move_what_caches_count(void **state)
{
    (void)state;
    const char *const programs[] = {"layer_peel", "k_buffer,k=2", "weighted_sum", "depth_complexity"};
    const char *const sets[] = {NULL,
                                "fast_clear=false",
                                "depth_compression=true color_compression=true",
                                "hierarchical_depth=true early_depth=true",
                                "tile_based=true binned_bytes=32 region_pixels=16",
                                "depth_cache_bytes=256 depth_cache_ways=1",
                                "l2_bytes=65536"};
    box *boxes = cost_layers(40, 24, 5, CLASS_TRANSPARENT);
    for (size_t p = 0; p < sizeof programs / sizeof *programs; p++) {
        for (size_t s = 0; s < sizeof sets / sizeof *sets; s++) {
            char path[4096];
            program *program = NULL;
            assert_int_equal(program_load(programs[p], NULL, path, sizeof path, &program), STATUS_OK);
            const machine machine = cost_machine("tiny", sets[s]);
            box_scene scene = {
                .width = 40, .height = 24, .samples = 1, .boxes = boxes, .count = 5, .triangles = 10, .vertices = 12};
            trace *trace = cost_trace(&scene);
            detail_result *detail = cost_trace_at(program, &machine, trace, DETAIL_CYCLE);
            if (8 * detail->total.memory_busy != detail->total.memory_bytes_read + detail->total.memory_bytes_written)
                fail_msg("%s, %s: the bus is taken for %d cycles of 8 bytes, but %d bytes are read and %d written",
                         programs[p], sets[s] ? sets[s] : "", (int)detail->total.memory_busy,
                         (int)detail->total.memory_bytes_read, (int)detail->total.memory_bytes_written);
            detail_destroy(detail);
            trace_close(trace);
            program_destroy(program);
        }
    }
    free(boxes);
}

// ---- The watchdog --------------------------------------------------------------------------------------

// One stamp a cycle on one block of one plane; ends with the first refusal.
static status drive(const machine *machine, bool free_kernel, messages *said)
{
    enum { STAMPS = 5000 };
    const frame frame = {.width = 8,
                         .height = 8,
                         .samples = 1,
                         .tile_width = 8,
                         .tile_height = 8,
                         .columns = 1,
                         .rows = 1,
                         .tile_count = 1,
                         .quad_corners = UINT64_C(0x0055005500550055),
                         .plane_count = 2,
                         .plane_bits = {32, 32}};
    const uint32_t slots[ACCESS_UNITS] = {4, 4, 4};
    const pass_info pass = {.kind = PASS_DRAW, .name = "driven", .free_kernel = free_kernel, .shader_operations = 1};
    const plane_access accesses[] = {{0, ACCESS_DEPTH, 1, 1}, {1, ACCESS_COLOR, 1, 1}};
    const stamp stamp = {.lanes = 1,
                         .shaded = 1,
                         .alive = 1,
                         .passed = 1,
                         .quads = 1,
                         .quads_shaded = 1,
                         .quads_passed = 1,
                         .kernel_slots = 1,
                         .accesses = accesses,
                         .access_count = 2};
    const line_touch touch = {0};
    const stamp_lines lines = {.touches = {&touch, &touch, &touch}, .counts = {0, 1, 1}};
    clock_state *clock = NULL;
    statistics total = {0};
    messages_start(said);
    status status = clock_create(machine, &frame, slots, NULL, &said->report, &clock);
    if (status == STATUS_OK)
        status = clock_begin_pass(clock, &pass, &total);
    for (int i = 0; i < STAMPS && status == STATUS_OK; i++)
        status = clock_stamp(clock, &stamp, &lines, &total);
    if (status == STATUS_OK)
        status = clock_end_stamps(clock, &total);
    if (status == STATUS_OK)
        status = clock_end_pass(clock, &total);
    clock_destroy(clock);
    return status;
}

// No file can set a queue to 0; a mistake in the model could have the same effect.
static void a_queue_of_no_places_is_named(void **state)
{
    (void)state;
    const struct {
        size_t key;
        bool free_kernel;
        const char *said;
    } cases[] = {
        {offsetof(machine, raster_queue), false, "rasterizer's queue"},
        {offsetof(machine, depth_queue), false, "the queue before the depth unit of partition 0"},
        {offsetof(machine, color_queue), false, "the queue before the colour unit of partition 0"},
        {offsetof(machine, depth_queue), true, "the queue before the kernel unit of partition 0"},
        {offsetof(machine, memory_write_queue), false, "write_queue"},
    };
    messages said;
    const machine sound = cost_machine("tiny", NULL);
    alarm(20);  // ends this program if something hangs after all
    assert_int_equal(drive(&sound, false, &said), STATUS_OK);
    assert_int_equal(drive(&sound, true, &said), STATUS_OK);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        machine broken = sound;
        *(int64_t *)(void *)((char *)&broken + cases[i].key) = 0;
        const status status = drive(&broken, cases[i].free_kernel, &said);
        print_message("%s", said.text);
        if (status != STATUS_REFUSED || !strstr(said.text, cases[i].said))
            fail_msg("case %d: status %d, \"%s\" does not say \"%s\"", (int)i, (int)status, said.text, cases[i].said);
    }
    // The shader takes a stamp that is larger than its queue alone: no places are slow, not stuck.
    machine slow = sound;
    slow.shader_queue = 0;
    assert_int_equal(drive(&slow, false, &said), STATUS_OK);
    alarm(0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_count_off_by_one_is_refused),
        cmocka_unit_test(channels_move_what_caches_count),
        cmocka_unit_test(a_queue_of_no_places_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
