// See tick_compare.h. The order of calls is that of sim/detail.
#include "tick_compare.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

typedef struct both {
    const machine *machine;
    const char *label;
    double tolerance;
    memory *memory;
    clock_state *clock;
    tick *tick;
    traffic *traffic;
    statistics fast;
    pass_info pass;
    uint64_t fast_start, slow_start;
    tick_measure *measure;
    bool good;
} both;

static uint64_t apart(uint64_t a, uint64_t b)
{
    return a > b ? a - b : b - a;
}

static double relative(uint64_t fast, uint64_t slow)
{
    return fast == slow ? 0.0 : (double)apart(fast, slow) / (double)(slow ? slow : 1);
}

// ---- One pass ------------------------------------------------------------------------------------------

static status begin_pass(void *user, const pass_info *pass)
{
    both *b = user;
    b->pass = *pass;
    b->fast_start = clock_now(b->clock);
    b->slow_start = tick_now(b->tick);
    memory_begin_pass(b->memory, &b->pass, &b->fast);
    traffic_begin_pass(b->traffic, &b->pass);
    tick_begin_pass(b->tick, &b->pass);
    return clock_begin_pass(b->clock, &b->pass, &b->fast);
}

static status take_stamp(void *user, const stamp *stamp)
{
    both *b = user;
    const stamp_lines *lines = memory_stamp(b->memory, stamp, &b->fast);
    traffic_stamp(b->traffic, stamp);
    tick_stamp(b->tick, stamp, lines);
    return clock_stamp(b->clock, stamp, lines, &b->fast);
}

static void compare_cycles(both *b)
{
    tick_measure *m = b->measure;
    const uint64_t fast = clock_now(b->clock) - b->fast_start, slow = tick_now(b->tick) - b->slow_start;
    const uint64_t fast_last = clock_last_fragment(b->clock) - b->fast_start;
    const uint64_t slow_last = tick_last_fragment(b->tick) - b->slow_start;
    const double off = relative(fast, slow);
    m->passes++;
    m->equal += fast == slow && fast_last == slow_last;
    m->off_by_1 += apart(fast, slow) == 1;
    m->within_permille += apart(fast, slow) > 1 && off <= 0.001;
    if (off > m->worst_pass) {
        m->worst_pass = off;
        snprintf(m->worst_pass_label, sizeof m->worst_pass_label, "%s, pass %llu '%s': %llu cycles, slow %llu", b->label,
                 (unsigned long long)b->pass.number, b->pass.name, (unsigned long long)fast, (unsigned long long)slow);
    }
    // A single cycle is never too much.
    if ((off > b->tolerance && apart(fast, slow) > 1) || (getenv("ROPSIM_TICK_EXACT") && (fast != slow || fast_last != slow_last))) {
        print_message("%s, pass %llu '%s' of kind %s: %llu cycles, last fragment %llu; the slow machine: %llu, %llu\n",
                      b->label, (unsigned long long)b->pass.number, b->pass.name, pass_kind_names[b->pass.kind],
                      (unsigned long long)fast, (unsigned long long)fast_last, (unsigned long long)slow,
                      (unsigned long long)slow_last);
        b->good = false;
    }
    const uint64_t *bounds = clock_pass_bounds(b->clock);
    for (int i = 0; i < RESOURCE_COUNT; i++)
        if (bounds[i] > fast || bounds[i] > slow) {
            print_message("%s, pass '%s': %s is taken for %llu cycles, the pass takes %llu, in the slow machine %llu\n",
                          b->label, b->pass.name, clock_resource_names[i], (unsigned long long)bounds[i],
                          (unsigned long long)fast, (unsigned long long)slow);
            b->good = false;
        }
}

static status finish_pass(both *b, bool last)
{
    status status = clock_end_stamps(b->clock, &b->fast);
    tick_end_stamps(b->tick);
    uint32_t partition;
    access_unit cache;
    transfer transfer;
    while (status == STATUS_OK && memory_flush(b->memory, last, &partition, &cache, &transfer, &b->fast)) {
        tick_flush(b->tick, partition, cache, &transfer);
        status = clock_flush(b->clock, partition, cache, &transfer);
    }
    if (last)
        traffic_end_run(b->traffic);
    else
        traffic_end_pass(b->traffic);
    if (status != STATUS_OK)
        return status;
    status = clock_end_pass(b->clock, &b->fast);
    tick_end_pass(b->tick);
    if (status == STATUS_OK)
        compare_cycles(b);
    return status;
}

static status end_pass(void *user)
{
    return finish_pass(user, false);
}

// ---- A whole run ---------------------------------------------------------------------------------------

#define COMPARED(X)                                                                                                     \
    X(texture_lookups) X(texture_misses) X(depth_lookups) X(depth_misses) X(depth_writebacks) X(color_lookups)         \
    X(color_misses) X(color_writebacks) X(lines_dirtied) X(fills_cleared) X(fills_none) X(lines_compressed)            \
    X(rop_bytes_read) X(rop_bytes_written) X(l2_lookups) X(l2_misses) X(l2_writebacks) X(geometry_bytes)               \
    X(list_bytes) X(blocks_cleared) X(memory_bytes_read) X(memory_bytes_written)

static void compare_traffic(both *b)
{
    const statistics *slow = traffic_counts(b->traffic);
#define X(name)                                                                                                         \
    b->measure->traffic_checked++;                                                                                      \
    if (b->fast.name != slow->name) {                                                                                   \
        print_message("%s: " #name " is %llu; slow: %llu\n", b->label, (unsigned long long)b->fast.name,                \
                      (unsigned long long)slow->name);                                                                  \
        b->good = false;                                                                                                \
    }
    COMPARED(X)
#undef X
    const plane_traffic *planes = memory_planes(b->memory), *slow_planes = traffic_planes(b->traffic);
    for (int i = 0; i < PLANE_MAX; i++)
        if (planes[i].read != slow_planes[i].read || planes[i].written != slow_planes[i].written) {
            print_message("%s: plane %d: %llu bytes read, %llu written; slow: %llu, %llu\n", b->label, i,
                          (unsigned long long)planes[i].read, (unsigned long long)planes[i].written,
                          (unsigned long long)slow_planes[i].read, (unsigned long long)slow_planes[i].written);
            b->good = false;
        }
}

static void finish_run(both *b)
{
    tick_measure *m = b->measure;
    const uint64_t fast = clock_now(b->clock), slow = tick_now(b->tick);
    const double off = relative(fast, slow);
    m->runs++;
    m->runs_equal += fast == slow;
    m->cycles += slow;
    if (off > m->worst_run) {
        m->worst_run = off;
        snprintf(m->worst_run_label, sizeof m->worst_run_label, "%s: %llu cycles, slow %llu", b->label,
                 (unsigned long long)fast, (unsigned long long)slow);
    }
    if (off > b->tolerance) {
        print_message("%s: %llu cycles; the slow machine: %llu\n", b->label, (unsigned long long)fast,
                      (unsigned long long)slow);
        b->good = false;
    }
    compare_traffic(b);
    // What the memory model counts is what the timing model moved.
    if (tick_bytes(b->tick, false) != b->fast.memory_bytes_read || tick_bytes(b->tick, true) != b->fast.memory_bytes_written) {
        print_message("%s: %llu bytes read and %llu written, but channels moved %llu and %llu\n", b->label,
                      (unsigned long long)b->fast.memory_bytes_read, (unsigned long long)b->fast.memory_bytes_written,
                      (unsigned long long)tick_bytes(b->tick, false), (unsigned long long)tick_bytes(b->tick, true));
        b->good = false;
    }
}

bool tick_compare(const program *program, const machine *machine, trace *trace, uint64_t max_iterations, const char *label,
                  double tolerance, tick_measure *measure)
{
    both b = {.machine = machine, .label = label, .tolerance = tolerance, .measure = measure, .good = true};
    const run_options options = {.threads = 1,
                                 .max_iterations = max_iterations,
                                 .occlusion_ratio = -1.0,
                                 .keep_planes = true,
                                 .log_conditions = true};
    run_result *function;
    arrival *arrival;
    if (replay_run(program, machine, trace, &options, &printing, &function) != STATUS_OK)
        return false;
    const arrival_options arrival_options = {.region_pixels = machine->tile_based ? (uint32_t)machine->region_pixels : 0,
                                             .hierarchical = machine->hierarchical_depth,
                                             .early = machine->early_depth};
    const stamp_sink sink = {.begin_pass = begin_pass, .stamp = take_stamp, .end_pass = end_pass, .user = &b};
    uint32_t slots[ACCESS_UNITS];
    assert_int_equal(arrival_create(program, machine, trace, function, &arrival_options, &printing, &arrival), STATUS_OK);
    status status = memory_create(machine, arrival_frame(arrival), &printing, &b.memory);
    if (status == STATUS_OK) {
        for (int u = 0; u < ACCESS_UNITS; u++)
            slots[u] = memory_slots(b.memory, (access_unit)u);
        assert_int_equal(clock_create(machine, arrival_frame(arrival), slots, NULL, &printing, &b.clock), STATUS_OK);
        b.tick = tick_create(machine, arrival_frame(arrival), slots);
        b.traffic = traffic_create(machine, arrival_frame(arrival));
        status = arrival_run(arrival, &sink);
    }
    if (status == STATUS_OK && machine->l2_bytes) {
        const pass_info drain = {.kind = PASS_DRAIN, .name = "second level"};
        status = begin_pass(&b, &drain);
        status = status == STATUS_OK ? finish_pass(&b, true) : status;
    }
    if (status == STATUS_OK)
        finish_run(&b);
    b.good = b.good && status == STATUS_OK && memory_check(b.memory, &b.fast, &printing) == STATUS_OK &&
             arrival_check(arrival) == STATUS_OK;
    clock_destroy(b.clock);
    tick_destroy(b.tick);
    traffic_destroy(b.traffic);
    memory_destroy(b.memory);
    arrival_destroy(arrival);
    result_destroy(function);
    if (!b.good)
        print_message("%s failed\n", label);
    return b.good;
}

void tick_print_measure(const char *title, const tick_measure *m)
{
    const uint64_t more = m->passes - m->equal;
    print_message("%s: %llu runs, %llu passes, %llu cycles\n", title, (unsigned long long)m->runs,
                  (unsigned long long)m->passes, (unsigned long long)m->cycles);
    print_message("  passes equal to the cycle %llu (%.2f %%), others %llu; off by one cycle %llu, by more but at most 0.1 %% %llu\n",
                  (unsigned long long)m->equal, 100.0 * (double)m->equal / (double)(m->passes ? m->passes : 1),
                  (unsigned long long)more, (unsigned long long)m->off_by_1, (unsigned long long)m->within_permille);
    print_message("  largest difference of a pass %.3f %% %s\n", 100.0 * m->worst_pass, m->worst_pass_label);
    print_message("  runs equal to the cycle %llu of %llu, largest difference %.3f %% %s\n", (unsigned long long)m->runs_equal,
                  (unsigned long long)m->runs, 100.0 * m->worst_run, m->worst_run_label);
    print_message("  counts of traffic compared, all equal: %llu\n", (unsigned long long)m->traffic_checked);
}

// ---- Inputs --------------------------------------------------------------------------------------------

program *tick_program(const char *words)
{
    char path[4096];
    program *program;
    assert_int_equal(program_load(words, &printing, path, sizeof path, &program), STATUS_OK);
    return program;
}

trace *tick_scene(const char *scene, uint32_t size, uint32_t samples)
{
    char path[] = "/tmp/ropsim_tick_XXXXXX.ropt";
    record_options options;
    trace *trace;
    record_defaults(&options);
    options.width = options.height = size;
    options.samples = samples;
    options.alpha = 0.5;
    const int file = mkstemps(path, 5);
    assert_true(file >= 0);
    close(file);
    assert_int_equal(record_scenes(&scene, 1, &options, path, &printing), STATUS_OK);
    assert_int_equal(trace_open(path, &printing, &trace), STATUS_OK);
    unlink(path);
    return trace;
}

trace *tick_trace(const char *name)
{
    char path[4096];
    trace *trace;
    snprintf(path, sizeof path, "%s/traces/%s", ROPSIM_SOURCE, name);
    assert_int_equal(trace_open(path, &printing, &trace), STATUS_OK);
    return trace;
}
