// Passes in, cycles out: stamps go through the front end to partitions, which do their steps when somebody asks (clock.h).
#include "clock.h"

#include <stdlib.h>

static status refuse_memory(const clock_state *c)
{
    return report_error(c->report, STATUS_IO, "out of memory: timing model");
}

static channel_timing timing_of(const machine *m)
{
    return (channel_timing){
        .core_mhz = m->core_mhz, .memory_mhz = m->memory_mhz, .bytes_per_clock = m->memory_bytes_per_clock,
        .burst_bytes = m->memory_burst_bytes, .banks = m->memory_banks, .row_bytes = m->memory_row_bytes,
        .t_cl = m->memory_t_cl, .t_wl = m->memory_t_wl, .t_rcd = m->memory_t_rcd, .t_rp = m->memory_t_rp,
        .t_ras = m->memory_t_ras, .t_rc = m->memory_t_rc, .t_rrd = m->memory_t_rrd, .t_wr = m->memory_t_wr,
        .t_wtr = m->memory_t_wtr, .latency_cycles = m->memory_latency_cycles, .write_queue = m->memory_write_queue};
}

static status open_log(clock_state *c, const clock_config *config)
{
    const request_space space = {.burst_bytes = (uint32_t)c->machine->memory_burst_bytes,
                                 .channels = c->partition_count,
                                 .only = config->requests_channel ? *config->requests_channel : -1,
                                 .banks = (uint64_t)c->machine->memory_banks,
                                 .row_bytes = (uint64_t)c->machine->memory_row_bytes};
    return request_log_open(config->requests_path, config->requests_format, &space, c->report, &c->log);
}

status clock_create(const machine *machine, const frame *frame, const uint32_t slots[ACCESS_UNITS], const clock_config *config,
                    const report *report, clock_state **result)
{
    const channel_timing timing = timing_of(machine);
    const char *fault = channel_timing_fault(&timing);
    *result = NULL;
    if (fault)
        return report_error(report, STATUS_REFUSED, "%s: memory timing: %s", machine->name, fault);
    clock_state *c = calloc(1, sizeof *c);
    if (!c)
        return report_error(report, STATUS_IO, "out of memory");
    c->machine = machine;
    c->frame = frame;
    c->report = report;
    c->partition_count = (int)machine->partitions;
    c->partitions = calloc((size_t)c->partition_count, sizeof *c->partitions);
    c->front.read_ready = calloc((size_t)machine->triangles_ahead + 1, sizeof *c->front.read_ready);
    c->front.begun = calloc((size_t)machine->triangles_ahead, sizeof *c->front.begun);
    bool good = c->partitions && c->front.read_ready && c->front.begun;
    for (int i = 0; good && i < c->partition_count; i++)
        good = (c->partitions[i].channel = channel_create(&timing)) && partition_make(c, &c->partitions[i], slots);
    c->partitions_by = divisor_of((uint64_t)c->partition_count);
    c->timeline = config ? config->timeline : NULL;
    c->in_order = config && (config->requests_path || config->timeline);
    status status = good ? STATUS_OK : refuse_memory(c);
    if (status == STATUS_OK && config && config->requests_path)
        status = open_log(c, config);
    for (int i = 0; status == STATUS_OK && c->log && i < c->partition_count; i++)
        channel_log(c->partitions[i].channel, c->log, i);
    if (status == STATUS_OK)
        *result = c;
    else
        clock_destroy(c);
    return status;
}

void clock_destroy(clock_state *c)
{
    if (!c)
        return;
    for (int i = 0; c->partitions && i < c->partition_count; i++) {
        channel_destroy(c->partitions[i].channel);
        partition_free(&c->partitions[i]);
    }
    request_log_abandon(c->log);
    free(c->partitions);
    free(c->front.read_ready);
    free(c->front.begun);
    free(c);
}

status clock_finish(clock_state *c)
{
    request_log *log = c->log;
    c->log = NULL;
    for (int i = 0; i < c->partition_count; i++)
        channel_log(c->partitions[i].channel, NULL, i);
    return log ? request_log_finish(log) : STATUS_OK;
}

uint64_t clock_now(const clock_state *c)
{
    return c->drained;
}

uint64_t clock_last_fragment(const clock_state *c)
{
    return c->last_fragment;
}

void clock_bytes(const clock_state *c, uint64_t *read, uint64_t *written)
{
    *read = *written = 0;
    for (int i = 0; i < c->partition_count; i++) {
        *read += channel_get_counts(c->partitions[i].channel)->bytes_read;
        *written += channel_get_counts(c->partitions[i].channel)->bytes_written;
    }
}

const uint64_t *clock_pass_bounds(const clock_state *c)
{
    return c->bounds;
}

// ---- Passes --------------------------------------------------------------------------------------------

static void order_stages(clock_state *c)
{
    static const unit_kind late[] = {UNIT_SHADER_STAGE, UNIT_DEPTH_STAGE, UNIT_COLOR_STAGE}, early[] = {UNIT_DEPTH_STAGE, UNIT_SHADER_STAGE, UNIT_COLOR_STAGE};
    static const unit_kind of_kernel[] = {UNIT_SHADER_STAGE, UNIT_KERNEL_STAGE};
    const unit_kind *stages = c->pass.free_kernel ? of_kernel : c->pass.early && c->machine->early_depth ? early : late;
    c->stage_count = c->pass.free_kernel ? 2 : 3;
    for (int i = 0; i < c->stage_count; i++) {
        c->stages[i] = stages[i];
        c->stage_of[stages[i]] = i;
    }
}

status clock_begin_pass(clock_state *c, const pass_info *pass, statistics *statistics)
{
    c->pass = *pass;
    c->statistics = statistics;
    c->last_fragment = c->drained;
    c->pass_start = c->drained;
    for (int i = 0; i < RESOURCE_COUNT; i++)
        c->bounds[i] = 0;
    order_stages(c);
    for (int i = 0; i < c->partition_count; i++) {
        c->partitions[i].before = c->partitions[i].settled = *channel_get_counts(c->partitions[i].channel);
        partition_begin(c, &c->partitions[i]);
    }
    charge_begin(c);
    front_begin(c);
    return STATUS_OK;
}

// The partition whose step is next; NULL: none has one.
static partition *earliest(const clock_state *c)
{
    partition *found = NULL;
    uint64_t when = NEVER;
    for (int i = 0; i < c->partition_count; i++) {
        if (c->partitions[i].when < when) {
            found = &c->partitions[i];
            when = found->when;
        }
    }
    return found;
}

// All steps up to and with cycle `until`.
static void advance(clock_state *c, uint64_t until)
{
    if (c->in_order)
        for (partition *next; (next = earliest(c)) && next->when <= until;)
            partition_step(c, next);
    for (int i = 0; i < c->partition_count; i++)
        partition_advance(c, &c->partitions[i], until);
}

// All steps that there are. The front end is then where the last one was.
static void run_out(clock_state *c)
{
    advance(c, NEVER - 1);
    for (int i = 0; i < c->partition_count; i++)
        for (int s = 0; s < c->stage_count; s++)
            c->front.now = later(c->front.now, c->partitions[i].units[s].last_step);
}

// Nothing can go on although work is left: says which queue is full, the last one: those before it wait for it.
static status blocked(const clock_state *c)
{
    for (int i = 0; i < c->partition_count; i++) {
        const partition *p = &c->partitions[i];
        for (int s = c->stage_count - 1; s >= 0; s--) {
            const uint64_t arrived = s ? p->units[s - 1].started : p->pushed;
            if (p->units[s].started < arrived)
                return report_error(c->report, STATUS_REFUSED,
                                    "internal error: cycle %llu: the queue before the %s of partition %d holds %llu stamps and nothing moves",
                                    (unsigned long long)c->front.now, unit_names[c->stages[s]], i, (unsigned long long)(arrived - p->units[s].started));
        }
    }
    return report_error(c->report, STATUS_REFUSED, "internal error: cycle %llu: the rasterizer's queue is blocked and nothing moves", (unsigned long long)c->front.now);
}

static bool has_room(const clock_state *c, const partition *p)
{
    return p->pushed - p->units[0].started < (uint64_t)c->machine->raster_queue;
}

// Moves front.when to the first cycle from then on in which the partition's first queue has room; false: it never has.
static bool wait_for_room(clock_state *c, partition *p)
{
    const uint64_t from = c->front.when;
    while (!has_room(c, p)) {
        partition_advance(c, p, c->front.when);
        if (has_room(c, p))
            break;
        const partition *next = c->in_order ? earliest(c) : p;
        if (!next || next->when == NEVER)
            return false;
        c->front.when = next->when;
        if (c->in_order)
            advance(c, c->front.when);
    }
    c->statistics->raster_wait_queue += c->front.when - from;
    return true;
}

static status push(clock_state *c, partition *p, const stamp *stamp, const stamp_lines *lines)
{
    job *job = partition_new_job(c, p, (uint32_t)(lines->counts[0] + lines->counts[1] + lines->counts[2]));
    if (!job)
        return refuse_memory(c);
    charge_stamp(c, p, stamp, lines, job);
    job->ready = cycles_up(c->front.raster_free);  // later than front.now
    p->pushed++;
    p->moving = p->moves.end != job->first_move || job->stream_read | job->stream_written ? p->pushed : p->moving;
    p->when = job->ready < p->when ? job->ready : p->when;
    return STATUS_OK;
}

status clock_stamp(clock_state *c, const stamp *stamp, const stamp_lines *lines, statistics *statistics)
{
    partition *p = &c->partitions[lines->partition];
    c->statistics = statistics;
    front_next(c, stamp);
    if (c->in_order)
        advance(c, c->front.when);
    if (!stamp->hierarchical && !wait_for_room(c, p)) {
        c->front.now = c->front.when;
        run_out(c);
        return blocked(c);
    }
    front_step(c);
    return stamp->hierarchical ? STATUS_OK : push(c, p, stamp, lines);
}

void clock_catch_up(clock_state *c)
{
    advance(c, c->front.now);
}

static status idle(clock_state *c, statistics *statistics)
{
    c->statistics = statistics;
    run_out(c);
    for (int i = 0; i < c->partition_count; i++)
        for (int s = 0; s < c->stage_count; s++)
            if (c->partitions[i].units[s].started != c->partitions[i].pushed)
                return blocked(c);
    return STATUS_OK;
}

uint64_t clock_last_stamp(const clock_state *c)
{
    return c->last_stamp;
}

uint64_t clock_front(const clock_state *c)
{
    return cycles_up(c->front.raster_free);
}

uint64_t clock_paced(const clock_state *c)
{
    return c->front.paced;
}

status clock_end_stamps(clock_state *c, statistics *statistics)
{
    const status status = idle(c, statistics);
    if (status != STATUS_OK)
        return status;
    c->last_stamp = c->last_fragment;
    front_end(c);
    for (int i = 0; i < c->partition_count; i++)
        c->partitions[i].flush_time = c->last_fragment;
    return STATUS_OK;
}

status clock_flush(clock_state *c, uint32_t partition, access_unit cache, const transfer *transfer)
{
    struct partition *p = &c->partitions[partition];
    uint64_t now = p->flush_time;
    (void)cache;
    if (transfer->bytes && transfer->on_chip)
        clock_l2_move(c, p, now, transfer->bytes);
    else
        while (!clock_write(p, now, transfer->address, transfer->bytes, &now))
            continue;
    while (!clock_write(p, now, transfer->evicted_address, transfer->evicted_bytes, &now))
        continue;
    p->flush_time = now + 1;
    return STATUS_OK;
}

// ---- The end of a pass ---------------------------------------------------------------------------------

static void bound(clock_state *c, clock_resource resource, uint64_t cycles)
{
    c->bounds[resource] = later(c->bounds[resource], cycles);
}

static uint64_t memory_cycles(const clock_state *c, uint64_t clocks)
{
    return clocks * (uint64_t)c->machine->core_mhz / (uint64_t)c->machine->memory_mhz;
}

// What statistics do not have yet of a unit's work.
static void settle_unit(unit *u, statistics *s)
{
    const uint64_t busy = u->busy / CYCLE_PARTS - u->settled, second = u->second_busy / CYCLE_PARTS - u->second_settled;
    u->settled += busy;
    u->second_settled += second;
    switch (u->kind) {
    case UNIT_SHADER_STAGE:
        s->shader_busy += busy;
        s->texture_busy += second;
        break;
    case UNIT_DEPTH_STAGE: s->depth_busy += busy; break;
    case UNIT_COLOR_STAGE: s->color_busy += busy; break;
    default: s->kernel_busy += busy;
    }
}

static void settle_channel(const clock_state *c, partition *p, statistics *s)
{
    const channel_counts *now = channel_get_counts(p->channel), *then = &p->settled;
    s->memory_busy += memory_cycles(c, now->busy_clocks - p->before.busy_clocks) - memory_cycles(c, then->busy_clocks - p->before.busy_clocks);
    s->memory_reads += now->reads - then->reads;
    s->memory_writes += now->writes - then->writes;
    s->row_hits += now->row_hits - then->row_hits;
    s->row_misses += now->row_misses + now->row_empty - then->row_misses - then->row_empty;
    s->turnarounds += now->turnarounds - then->turnarounds;
    p->settled = *now;
}

uint64_t clock_waiting(clock_state *c)
{
    uint64_t waiting = 0;
    advance(c, c->front.now);
    for (int i = 0; i < c->partition_count; i++)
        waiting += c->partitions[i].pushed - c->partitions[i].units[c->stage_count - 1].started;
    return waiting;
}

void clock_settle(clock_state *c, statistics *s)
{
    c->statistics = s;
    advance(c, c->front.now);
    const uint64_t raster = c->front.busy / CYCLE_PARTS - c->front.settled;
    s->raster_busy += raster;
    c->front.settled += raster;
    for (int i = 0; i < c->partition_count; i++) {
        settle_channel(c, &c->partitions[i], s);
        for (int k = 0; k < c->stage_count; k++)
            settle_unit(&c->partitions[i].units[k], s);
    }
}

static void bound_by_unit(clock_state *c, const unit *u)
{
    static const clock_resource resources[UNIT_KINDS] = {RESOURCE_SHADER, RESOURCE_DEPTH, RESOURCE_COLOR, RESOURCE_KERNEL};
    bound(c, resources[u->kind], u->busy / CYCLE_PARTS);
    bound(c, RESOURCE_TEXTURE, u->second_busy / CYCLE_PARTS);
}

// A clear that marks blocks takes its rate's time and nothing else.
static void mark_blocks(clock_state *c)
{
    const uint64_t lines = (uint64_t)c->frame->tile_count * block_lines(c->machine, c->frame->plane_bits[c->pass.plane]);
    const uint64_t rate = (uint64_t)c->machine->clear_blocks_per_clock, cycles = (lines + rate - 1) / rate;
    if (c->pass.kind != PASS_CLEAR || !c->machine->fast_clear)
        return;
    bound(c, RESOURCE_CLEAR, lines / rate);
    c->last_fragment = later(c->last_fragment, c->pass_start + cycles);
}

static status check_bounds(const clock_state *c)
{
    for (int i = 0; i < RESOURCE_COUNT; i++)
        if (c->bounds[i] > c->drained - c->pass_start)
            return report_error(c->report, STATUS_REFUSED, "internal error: pass '%s' took %llu cycles, but its %s was busy for %llu",
                                c->pass.name, (unsigned long long)(c->drained - c->pass_start), clock_resource_names[i],
                                (unsigned long long)c->bounds[i]);
    return STATUS_OK;
}

status clock_end_pass(clock_state *c, statistics *s)
{
    mark_blocks(c);
    c->drained = c->last_fragment;
    for (int i = 0; i < c->partition_count; i++) {
        partition *p = &c->partitions[i];
        const uint64_t end = channel_drain(p->channel, later(p->flush_time, c->last_fragment));
        c->drained = later(c->drained, later(end, cycles_up(p->l2_free)));
        bound(c, RESOURCE_MEMORY, memory_cycles(c, channel_get_counts(p->channel)->busy_clocks - p->before.busy_clocks));
        for (int k = 0; k < c->stage_count; k++) {
            bound_by_unit(c, &p->units[k]);
            spans_end(c, &p->units[k]);
        }
    }
    clock_settle(c, s);
    s->geometry_busy += c->bounds[RESOURCE_GEOMETRY];
    bound(c, RESOURCE_RASTER, c->front.busy / CYCLE_PARTS);
    s->cycles += c->drained - c->pass_start;
    s->fragment_cycles += c->last_fragment - c->pass_start;
    return check_bounds(c);
}
