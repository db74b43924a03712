// A run at a deeper level: passes in order of arrival through the memory model and, at the level cycle, the timing model.
//
// Data flow one way. What comes out is a record a pass, sums by draw and iteration, and the checks that every run must pass:
// what went in came out, the image is the function level's, no pass beat its busiest resource.
#include "detail.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static status refuse_memory(const detail *d)
{
    return report_error(d->report, STATUS_IO, "out of memory: records of passes");
}

static double seconds_of_process(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// ---- The sink ------------------------------------------------------------------------------------------

static void end_draw(detail *d)
{
    if (d->draw != UINT32_MAX) {
        const statistics since = statistics_since(&d->raw, &d->before_draw);
        statistics_add(&d->result->draws[d->draw], &since);
    }
    d->before_draw = d->raw;
}

static status begin_pass(void *user, const pass_info *pass)
{
    detail *d = user;
    d->record = (pass_record){.info = *pass};
    d->before_pass = d->before_draw = d->raw;
    d->draw = UINT32_MAX;
    memory_begin_pass(d->memory, &d->record.info, &d->raw);
    if (!d->clock)
        return STATUS_OK;
    d->record.start = clock_now(d->clock);
    return clock_begin_pass(d->clock, &d->record.info, &d->raw);
}

static status take_stamp(void *user, const stamp *stamp)
{
    detail *d = user;
    if (stamp->draw != d->draw) {
        if (d->clock)
            clock_catch_up(d->clock);
        end_draw(d);
        d->draw = stamp->draw;
    }
    const stamp_lines *lines = memory_stamp(d->memory, stamp, &d->raw);
    return d->clock ? clock_stamp(d->clock, stamp, lines, &d->raw) : STATUS_OK;
}

static void ahead(void *user, uint32_t tile)
{
    memory_ahead(((const detail *)user)->memory, tile);
}

status detail_flush(detail *d, bool last)
{
    uint32_t partition;
    access_unit cache;
    transfer transfer;
    status status = STATUS_OK;
    while (status == STATUS_OK && memory_flush(d->memory, last, &partition, &cache, &transfer, &d->raw))
        if (d->clock)
            status = clock_flush(d->clock, partition, cache, &transfer);
    return status;
}

int detail_busiest(const uint64_t bounds[RESOURCE_COUNT], uint64_t cycles)
{
    int most = 0;
    for (int i = 1; i < RESOURCE_COUNT; i++)
        most = bounds[i] > bounds[most] ? i : most;
    return 2 * bounds[most] < cycles ? RESOURCE_COUNT : most;
}

status detail_keep_record(detail *d)
{
    detail_result *r = d->result;
    if (r->pass_count == d->pass_capacity) {
        const uint64_t capacity = d->pass_capacity ? 2 * d->pass_capacity : 64;
        pass_record *grown = realloc(r->passes, capacity * sizeof *grown);
        if (!grown)
            return refuse_memory(d);
        r->passes = grown;
        d->pass_capacity = capacity;
    }
    const uint64_t iteration = d->record.info.iteration;
    if (iteration >= d->iteration_capacity) {
        const uint64_t capacity = 2 * iteration + 16;
        statistics *grown = realloc(r->iterations, capacity * sizeof *grown);
        if (!grown)
            return refuse_memory(d);
        memset(grown + d->iteration_capacity, 0, (capacity - d->iteration_capacity) * sizeof *grown);
        r->iterations = grown;
        d->iteration_capacity = capacity;
    }
    statistics_add(&r->total, &d->record.statistics);
    statistics_add(&r->iterations[iteration], &d->record.statistics);
    r->iteration_count = iteration >= r->iteration_count ? iteration + 1 : r->iteration_count;
    r->passes[r->pass_count++] = d->record;
    return STATUS_OK;
}

static status finish_pass(detail *d, bool last)
{
    status status = d->clock ? clock_end_stamps(d->clock, &d->raw) : STATUS_OK;
    end_draw(d);
    if (status == STATUS_OK)
        status = detail_flush(d, last);
    if (status == STATUS_OK && d->clock)
        status = clock_end_pass(d->clock, &d->raw);
    if (status != STATUS_OK)
        return status;
    d->record.statistics = statistics_since(&d->raw, &d->before_pass);
    if (d->clock) {
        uint64_t cycles = clock_now(d->clock) - d->record.start;
        memcpy(d->record.bounds, clock_pass_bounds(d->clock), sizeof d->record.bounds);
        d->record.drained = clock_now(d->clock);
        d->record.last_fragment = clock_last_fragment(d->clock);
        d->record.bound_by = detail_busiest(d->record.bounds, cycles);
        uint64_t most = 0;
        for (int i = 0; i < RESOURCE_COUNT; i++)
            most = d->record.bounds[i] > most ? d->record.bounds[i] : most;
        d->result->bound_cycles += most;
        d->result->cycles = last ? d->result->cycles : d->record.last_fragment;
        d->result->drained_cycles = d->record.drained;
        if (d->timeline)
            timeline_pass(d->timeline, &d->record);
    }
    return detail_keep_record(d);
}

static status end_pass(void *user)
{
    return finish_pass(user, false);
}

// What the second level still holds goes to memory in a pass of its own.
static status drain(detail *d)
{
    pass_info pass = {.kind = PASS_DRAIN, .name = "second level"};
    if (!d->machine->l2_bytes)
        return STATUS_OK;
    if (d->sampler)
        return sampled_drain(d, &pass);
    const status status = begin_pass(d, &pass);
    return status == STATUS_OK ? finish_pass(d, true) : status;
}

// ---- The run -------------------------------------------------------------------------------------------

static sampling sampling_wanted(const detail_options *options)
{
    return options->sampling ? *options->sampling : sampling_default();
}

static arrival_options arrival_options_of(const machine *m, const detail_options *options, const sampling *sampling)
{
    return (arrival_options){.memory_bytes = options->memory_bytes,
                             .region_pixels = m->tile_based ? (uint32_t)m->region_pixels : 0,
                             .tiles = options->tiles,
                             .sampling = options->level == DETAIL_SAMPLED ? sampling : NULL,
                             .stamps = options->stamps,
                             .hierarchical = m->hierarchical_depth,
                             .early = m->early_depth};
}

status detail_read(const program *program, const machine *machine, trace *trace, const detail_options *options, const report *report,
                   stamps **stamps)
{
    const sampling sampling = sampling_wanted(options);
    const arrival_options arrival_options = arrival_options_of(machine, options, &sampling);
    return stamps_read(program, machine, trace, &arrival_options, report, stamps);
}

bool detail_fits(const stamps *stamps, const program *program, const machine *machine, const trace *trace, const detail_options *options)
{
    const sampling sampling = sampling_wanted(options);
    const arrival_options arrival_options = arrival_options_of(machine, options, &sampling);
    return stamps_fit(stamps, program, machine, trace, &arrival_options);
}

bool detail_reads_first(const machine *machine, const detail_options *options)
{
    return options->level == DETAIL_SAMPLED && !machine->tile_based;
}

static status make_models(detail *d, const program *program, trace *trace, const run_result *function, const detail_options *options)
{
    const machine *m = d->machine;
    const arrival_options arrival_options = arrival_options_of(m, options, &d->result->sampling);
    uint32_t slots[ACCESS_UNITS];
    status status = arrival_create(program, m, trace, function, &arrival_options, d->report, &d->arrival);
    if (status == STATUS_OK)
        status = memory_create(m, arrival_frame(d->arrival), d->report, &d->memory);
    for (int u = 0; status == STATUS_OK && u < ACCESS_UNITS; u++)
        slots[u] = memory_slots(d->memory, (access_unit)u);
    if (status == STATUS_OK && options->level >= DETAIL_CYCLE)
        status = clock_create(m, arrival_frame(d->arrival), slots, options->clock, d->report, &d->clock);
    return status;
}

static status make_result(detail *d, const detail_options *options)
{
    const frame *frame = arrival_frame(d->arrival);
    detail_result *r = d->result;
    r->level = options->level;
    r->machine = *d->machine;
    r->draw_count = d->sampler ? 0 : frame->draw_count;  // windows are of no draw
    r->draws = calloc((size_t)frame->draw_count + 1, sizeof *r->draws);
    r->plane_count = frame->plane_count;
    memcpy(r->plane_names, frame->plane_names, sizeof r->plane_names);
    return r->draws ? STATUS_OK : refuse_memory(d);
}

// What the models count apart from each other must agree: bytes that caches moved, and that data buses carried.
static status check_bytes(const detail *d)
{
    uint64_t read, written;
    clock_bytes(d->clock, &read, &written);
    if (read == d->raw.memory_bytes_read && written == d->raw.memory_bytes_written)
        return STATUS_OK;
    return report_error(d->report, STATUS_REFUSED,
                        "internal error: conservation: %llu bytes read and %llu written at the caches, %llu and %llu at the memory",
                        (unsigned long long)d->raw.memory_bytes_read, (unsigned long long)d->raw.memory_bytes_written,
                        (unsigned long long)read, (unsigned long long)written);
}

static status check(detail *d, const detail_options *options)
{
    detail_result *r = d->result;
    status status = d->sampler ? STATUS_OK : memory_check(d->memory, &d->raw, d->report);
    if (status == STATUS_OK && d->clock && !d->sampler)
        status = check_bytes(d);
    if (status == STATUS_OK && !options->tiles)
        status = arrival_check(d->arrival);
    memcpy(r->planes, memory_planes(d->memory), sizeof r->planes);
    for (int u = 0; u < ACCESS_UNITS; u++)
        memory_occupancy(d->memory, (access_unit)u, &r->occupancy[u].least, &r->occupancy[u].most, &r->occupancy[u].sets);
    return status;
}

status detail_run(const program *program, const machine *machine, trace *trace, const run_result *function,
                  const detail_options *options, const report *report, detail_result **result)
{
    detail d = {.machine = machine,
                .report = report,
                .draw = UINT32_MAX,
                .timeline = options->clock ? options->clock->timeline : NULL};
    const stamp_sink whole = {.begin_pass = begin_pass, .stamp = take_stamp, .end_pass = end_pass, .ahead = ahead, .user = &d};
    const stamp_sink sampled = {.begin_pass = sampled_begin_pass, .stamp = sampled_stamp, .end_pass = sampled_end_pass,
                                .ahead = ahead, .warm = sampled_warm, .skip = sampled_skip, .phase = sampled_phase, .waiting = sampled_waiting, .user = &d};
    sampler sampler = {0};
    const double start = seconds_of_process();
    *result = NULL;
    d.result = calloc(1, sizeof *d.result);
    if (!d.result)
        return report_error(report, STATUS_IO, "out of memory");
    if (options->level == DETAIL_SAMPLED) {
        d.sampler = &sampler;
        d.result->sampling = sampling_wanted(options);
    }
    status status = make_models(&d, program, trace, function, options);
    if (status == STATUS_OK)
        status = make_result(&d, options);
    if (status == STATUS_OK)
        status = arrival_run(d.arrival, d.sampler ? &sampled : &whole);
    if (status == STATUS_OK)
        status = drain(&d);
    if (status == STATUS_OK && d.clock)
        status = clock_finish(d.clock);
    if (status == STATUS_OK)
        status = check(&d, options);
    if (status == STATUS_OK && d.sampler)
        estimate_half_widths(&d);
    free(sampler.windows);
    clock_destroy(d.clock);
    memory_destroy(d.memory);
    arrival_destroy(d.arrival);
    d.result->wall_seconds = seconds_of_process() - start;
    if (status == STATUS_OK)
        *result = d.result;
    else
        detail_destroy(d.result);
    return status;
}

void detail_destroy(detail_result *result)
{
    if (!result)
        return;
    free(result->passes);
    free(result->draws);
    free(result->iterations);
    free(result);
}
