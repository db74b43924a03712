// A schedule pass by pass over image-wide planes, each stamp in order of arrival, told to a sink.
//
// The function level replays the same program tile by tile, much faster; its log says how each condition went, so that none
// is evaluated here. Planes are kept for blocks that have a fragment; all others share one block, whose full-screen passes
// run once and are told for each of them.
#include "arrival.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

enum { STAMPS_AHEAD = 32 };  // whose planes are asked for before they are needed

// ---- Passes --------------------------------------------------------------------------------------------

bool draws_class(const arrival *a, const step *step, uint32_t draw)
{
    if (step->classes == DRAW_BATCH)
        return a->batches->batches[a->batch].draws[draw];
    return step->classes >> trace_get_info(a->stamps->trace)->draws[draw].class & 1;
}

status begin_pass(arrival *a, pass_kind kind, const char *name, bool numbered, const step *step, const kernel_use *use)
{
    const trace_info *info = trace_get_info(a->stamps->trace);
    pass_info pass = {.kind = kind, .iteration = a->iteration};
    snprintf(pass.name, sizeof pass.name, "%s", name);
    a->pass_number += numbered;
    pass.number = numbered ? a->pass_number : 0;
    for (uint32_t d = 0; kind == PASS_DRAW && d < info->draw_count; d++) {
        if (!draws_class(a, step, d))
            continue;
        pass.triangles += info->draws[d].triangles;
        pass.vertices += info->draws[d].vertices;
        pass.primitives += a->stamps->primitives[d];
        pass.stamps += a->stamps->counts[d];
        pass.binned += a->options.region_pixels ? a->stamps->region_pairs[d] : 0;
    }
    if (use) {
        pass.free_kernel = use->free_kernel;
        pass.hierarchical = use->hierarchical;
        pass.early = use->early;
        pass.hierarchical_forbidden = kind == PASS_DRAW ? use->hierarchical_forbidden : NULL;
        pass.early_forbidden = kind == PASS_DRAW ? use->early_forbidden : NULL;
        pass.shader_operations = use->shader_operations;
    }
    if (kind != PASS_DRAW)
        pass.stamps = a->tiling.tile_count;
    phases_begin(a, pass.stamps);
    return a->sink->begin_pass(a->sink->user, &pass);
}

static status end_pass(arrival *a)
{
    return a->sink->end_pass(a->sink->user);
}

// Looks at the stamp, or passes it over.
static status take_stamp(arrival *a, const step *step, const stamp_chunk *chunk, uint32_t number, stamp_body *body)
{
    const stamp_record *record = &chunk->records[number];
    stamp_phase phase;
    status status = phases_next(a, record->begins_primitive, &phase);
    if (phase == PHASE_WARM && !a->warming) {
        a->warming = true;
        a->warm_first = number;
    }
    if (status != STATUS_OK || phase == PHASE_SKIP || phase == PHASE_WARM)
        return status;
    status = skip_pass_by(a, number);
    return status == STATUS_OK ? body(a, step, chunk, record) : status;
}

static status each_by_region(arrival *a, const step *step, stamp_body *body)
{
    const stamps *s = a->stamps;
    status status = STATUS_OK;
    for (uint64_t i = 0; status == STATUS_OK && i < s->stamp_count; i++) {
        const stamp_place place = s->by_region[i];
        const stamp_chunk *chunk = &s->chunks[place.chunk];
        if (draws_class(a, step, chunk->records[place.record].draw))
            status = take_stamp(a, step, chunk, place.record, body);
    }
    return status;
}

static void add_reads(const arrival *a, const kernel_use *use, bool colors, block_reads *reads)
{
    for (const kernel_plane *plane = use->planes; plane < use->planes + use->plane_count; plane++)
        for (uint32_t c = 0; plane->read && plane->color == colors && c < (colors ? 4 : 1); c++)
            reads->offsets[reads->count++] = a->plan.plane_offset[a->plane_at[plane->plane]] + c * TILE_LANES;
}

static void find_reads(arrival *a, const step *step)
{
    block_reads *reads = &a->reads;
    reads->plain_count = reads->count = 0;
    if (step->kind != STEP_DRAW)
        return;
    add_reads(a, &a->uses[step->kernel], false, reads);
    reads->plain_count = reads->count;
    add_reads(a, &a->uses[step->kernel], true, reads);
}

// Asks for what the kernel will read of a stamp's planes: triangles in the order of a mesh jump from block to block, and planes
// of a whole image do not fit a near cache. Of colours few are read as a rule.
static void prefetch(arrival *a, const stamp_chunk *chunk, uint32_t number)
{
    const stamp_record *record = &chunk->records[number];
    const block_reads *reads = &a->reads;
    const uint32_t *block = arrival_block(a, record->tile);
    const uint32_t *first = block + __builtin_ctzll(record->lanes), *last = block + (63 - __builtin_clzll(record->lanes));
    const int count = a->pack.reads_colors ? reads->count : reads->plain_count;
    if (a->sink->ahead)
        a->sink->ahead(a->sink->user, record->tile);
    skip_ahead(a, number);
    for (const uint32_t *offset = reads->offsets; offset < reads->offsets + count; offset++) {
        __builtin_prefetch(first + *offset);  // often two lines; to ask whether costs more than to ask for one twice
        __builtin_prefetch(last + *offset);
    }
}

// Whether the step draws all stamps of a chunk.
static bool draws_all(const arrival *a, const step *step, const stamp_chunk *chunk)
{
    bool all = true;
    for (uint32_t d = chunk->first_draw; all && chunk->count && d <= chunk->last_draw; d++)
        all = draws_class(a, step, d);
    return all;
}

// How many of the chunk's stamps from number `first` on are passed over.
static uint32_t pass_over(arrival *a, const stamp_chunk *chunk, uint32_t first)
{
    phase_plan *p = &a->plan_of_phases;
    const uint32_t left = chunk->count - first, count = p->until - p->at < left ? (uint32_t)(p->until - p->at) : left;
    const stamp_record *last = &chunk->records[first + count - 1];
    if (!count)
        return 0;
    p->at += count;
    p->begun += last->begun + last->begins_primitive - chunk->records[first].begun;
    return count;
}

status each_stamp(arrival *a, const step *step, stamp_body *body)
{
    if (a->options.region_pixels)
        return each_by_region(a, step, body);
    status status = stamps_rewind(a->stamps);
    find_reads(a, step);
    for (const stamp_chunk *chunk; status == STATUS_OK && (status = stamps_next(a->stamps, &chunk)) == STATUS_OK && chunk;) {
        const bool all = draws_all(a, step, chunk);
        skip_begin(a, step, chunk);
        for (uint32_t i = 0; status == STATUS_OK && i < chunk->count; i++) {
            if (all && phases_skip(a))
                i += pass_over(a, chunk, i);
            if (i == chunk->count)
                break;
            if (step->kind == STEP_DRAW && i + STAMPS_AHEAD < chunk->count && !phases_skip(a))
                prefetch(a, chunk, i + STAMPS_AHEAD);
            if (all || draws_class(a, step, chunk->records[i].draw))
                status = take_stamp(a, step, chunk, i, body);
        }
        if (status == STATUS_OK)
            status = skip_end(a);  // the chunk may not stay
    }
    return status;
}

static status draw_stamp(arrival *a, const step *step, const stamp_chunk *chunk, const stamp_record *record)
{
    stamp stamp;
    stamp_execute(a, step->kernel, chunk, record, &stamp);
    stamp.time = a->visit_time + (uint64_t)(record - chunk->records);
    phases_fill(a, &stamp);
    return a->sink->stamp(a->sink->user, &stamp);
}

static status draw(arrival *a, const step *step)
{
    const kernel_decl *kernel = &a->program->kernels[step->kernel];
    status status = begin_pass(a, PASS_DRAW, kernel->name, step->classes != DRAW_OPAQUE, step, &a->uses[step->kernel]);
    if (status == STATUS_OK)
        status = each_stamp(a, step, draw_stamp);
    a->draws++;
    return status == STATUS_OK ? end_pass(a) : status;
}

// The blocks of an image by rows; on a tile-based machine, by regions.
static uint32_t tile_in_order(const arrival *a, uint32_t i)
{
    return a->frame_order ? a->frame_order[i] : i;
}

static bool tile_wanted(const arrival *a, uint32_t tile)
{
    return !a->options.tiles || a->options.tiles[tile];
}

static status tell_warm(arrival *a, const stamp *stamp)
{
    uint64_t times[2 * PLANE_MAX];
    for (int i = 0; i < stamp->access_count; i++)
        times[i] = stamp->time;
    return a->sink->warm(a->sink->user, stamp, times);
}

// A stamp of a pass without draws, looked at or not.
static status tell(arrival *a, stamp *stamp)
{
    stamp_phase phase;
    stamp->time = a->time++;
    const status status = phases_next(a, false, &phase);
    if (status != STATUS_OK)
        return status;
    phases_fill(a, stamp);
    if (phase != PHASE_SKIP)
        return phase == PHASE_WARM ? tell_warm(a, stamp) : a->sink->stamp(a->sink->user, stamp);
    uint32_t planes = 0;
    uint64_t lanes = 0;
    for (int i = 0; i < stamp->access_count; i++) {
        planes |= stamp->accesses[i].written ? 1u << stamp->accesses[i].plane : 0;
        lanes |= stamp->accesses[i].written;
    }
    if (planes)
        a->sink->skip(a->sink->user, stamp->tile, planes, lanes, stamp->time);
    return STATUS_OK;
}

static status fullscreen(arrival *a, const step *step)
{
    const kernel_decl *kernel = &a->program->kernels[step->kernel];
    status status = begin_pass(a, PASS_FULLSCREEN, kernel->name, true, step, &a->uses[step->kernel]);
    bool empty_done = false;
    for (uint32_t i = 0; status == STATUS_OK && i < a->tiling.tile_count; i++) {
        stamp stamp;
        const uint32_t tile = tile_in_order(a, i);
        if (!tile_wanted(a, tile))
            continue;
        const bool empty = a->storage_of_tile[tile] == UINT32_MAX;
        const uint64_t lanes = tiling_valid_lanes(&a->tiling, tile);
        if (empty && empty_done)
            memcpy(arrival_plane(a, 0, tile), a->empty_before, a->plan.tile_words * sizeof(uint32_t));
        else if (empty)
            memcpy(a->empty_before, arrival_plane(a, 0, tile), a->plan.tile_words * sizeof(uint32_t));
        empty_done |= empty;
        block_execute(a, step->kernel, NULL, NULL, tile, empty ? UINT64_MAX : lanes, &stamp);
        if (empty && lanes != UINT64_MAX)
            stamp_cut(a, lanes, &stamp);
        status = tell(a, &stamp);
    }
    return status == STATUS_OK ? end_pass(a) : status;
}

static size_t plane_words(const arrival *a, int storage)
{
    return (format_table[a->frame.plane_formats[storage]].class == FORMAT_CLASS_COLOR ? 4 : 1) * TILE_LANES;
}

static status copy(arrival *a, const step *step)
{
    const int to = a->plane_at[step->plane], from = a->plane_at[step->source];
    const bool color = format_table[a->frame.plane_formats[to]].class == FORMAT_CLASS_COLOR;
    const access_unit unit = color ? ACCESS_COLOR : ACCESS_DEPTH;
    status status = begin_pass(a, PASS_COPY, a->program->planes[step->plane].name, false, step, NULL);
    bool empty_done = false;
    stamp stamp = {.draw = UINT32_MAX, .accesses = a->accesses, .access_count = 2};
    for (uint32_t i = 0; status == STATUS_OK && i < a->tiling.tile_count; i++) {
        const uint32_t tile = tile_in_order(a, i);
        if (!tile_wanted(a, tile))
            continue;
        const bool empty = a->storage_of_tile[tile] == UINT32_MAX;
        if (!empty || !empty_done)
            memcpy(arrival_plane(a, to, tile), arrival_plane(a, from, tile), plane_words(a, to) * sizeof(uint32_t));
        empty_done |= empty;
        const uint64_t lanes = tiling_valid_lanes(&a->tiling, tile);
        stamp.tile = tile;
        stamp.lanes = stamp.shaded = stamp.alive = stamp.passed = lanes;
        stamp.quads = stamp.quads_shaded = stamp.quads_passed = quads_of(a, lanes);
        a->accesses[0] = (plane_access){(uint8_t)from, unit, lanes, 0};
        a->accesses[1] = (plane_access){(uint8_t)to, unit, 0, lanes};
        status = tell(a, &stamp);
    }
    return status == STATUS_OK ? end_pass(a) : status;
}

static void fill_plane(arrival *a, int storage, const uint32_t value[4])
{
    const size_t components = plane_words(a, storage) / TILE_LANES;
    for (uint32_t n = 0; n <= a->storage_count; n++) {
        uint32_t *to = (n == a->storage_count ? a->empty_storage : a->storage + (size_t)n * a->plan.tile_words) + a->plan.plane_offset[storage];
        for (size_t c = 0; c < components; c++, to += TILE_LANES)
            for (size_t i = 0; i < TILE_LANES; i++)
                to[i] = value[c];
    }
}

static status clear(arrival *a, const step *step)
{
    uint32_t value[4];
    const int storage = a->plane_at[step->plane];
    bound_clear_value(a->bound, step, value);
    if (step->value.kind == VALUE_BATCH_NEAR)
        value[0] = a->batches->batches[a->batch].near_code;
    else if (step->value.kind == VALUE_BATCH_FAR)
        value[0] = a->batches->batches[a->batch].far_code;
    fill_plane(a, storage, value);
    pass_info pass = {.kind = PASS_CLEAR, .iteration = a->iteration, .plane = (uint8_t)storage};
    snprintf(pass.name, sizeof pass.name, "%s", a->program->planes[step->plane].name);
    const status status = a->sink->begin_pass(a->sink->user, &pass);
    return status == STATUS_OK ? end_pass(a) : status;
}

// ---- Schedule ------------------------------------------------------------------------------------------

static const draw_batches *batches_of(const arrival *a, int at)
{
    int index = 0;
    for (int s = 0; s < at; s++)
        index += a->program->steps[s].kind == STEP_BATCHES;
    return &a->function->batches[index];
}

static bool condition(arrival *a)
{
    assert(a->condition < a->function->condition_count);
    return a->function->conditions[a->condition++].holds;
}

// Runs one step; *at becomes where the schedule goes on.
static status run_step(arrival *a, int *at)
{
    const step *step = &a->program->steps[*at];
    uint8_t kept;
    int next = *at + 1;
    status status = STATUS_OK;
    switch (step->kind) {
    case STEP_CLEAR: status = clear(a, step); break;
    case STEP_COPY: status = copy(a, step); break;
    case STEP_SWAP:
        kept = a->plane_at[step->plane];
        a->plane_at[step->plane] = a->plane_at[step->source];
        a->plane_at[step->source] = kept;
        break;
    case STEP_DRAW: status = draw(a, step); break;
    case STEP_FULLSCREEN: status = fullscreen(a, step); break;
    case STEP_LIST: status = arrival_list(a, step); break;
    case STEP_REPEAT: a->iteration = a->nest++ == 0 ? 1 : a->iteration; break;
    case STEP_WHILE:
        if (condition(a)) {
            a->iteration += a->nest == 1;
            next = step->target + 1;  // behind its `repeat`
        } else if (--a->nest == 0) {
            a->iteration = 0;
        }
        break;
    case STEP_IF: next = condition(a) ? next : step->target + 1; break;
    case STEP_BATCHES:
        a->batches = batches_of(a, *at);
        a->batch = 0;
        next = a->batches->count ? next : step->target + 1;
        break;
    case STEP_END_BATCHES: next = ++a->batch < a->batches->count ? step->target + 1 : next; break;
    case STEP_RESET:
    case STEP_END: break;
    }
    *at = next;
    return status;
}

status arrival_run(arrival *a, const stamp_sink *sink)
{
    status status = STATUS_OK;
    a->sink = sink;
    a->draws = 0;
    a->condition = a->pass_number = a->iteration = a->passes_begun = 0;
    a->pack.end = 0;
    memset(a->ranges, 0, a->tiling.tile_count * sizeof *a->ranges);
    skip_forget(a);
    a->nest = 0;
    for (int i = 0; i < a->program->plane_count; i++)
        a->plane_at[i] = (uint8_t)i;
    if (a->ran) {  // before, they are as they were made
        memset(a->storage, 0, (size_t)a->storage_count * a->plan.tile_words * sizeof(uint32_t));
        memset(a->empty_storage, 0, a->plan.tile_words * sizeof(uint32_t));
    }
    a->ran = true;
    for (int at = 0; status == STATUS_OK && at < a->program->step_count;) {
        report_progress(a->report, "passes in order of arrival", a->pass_number, a->function->geometry_passes + a->function->fullscreen_passes);
        status = run_step(a, &at);
    }
    return status;
}

// The first lane of a plane of a block, one of so many components, that is not what the function level says; TILE_LANES: none.
static uint32_t lane_that_differs(const arrival *a, int plane, uint32_t components, uint32_t tile)
{
    const uint32_t *words = arrival_plane(a, a->plane_at[plane], tile);
    for (uint32_t row = 0; row < a->tiling.tile_height; row++) {
        const tiling_run run = tiling_row(&a->tiling, tile, row);
        const uint32_t *expected = a->function->plane_values[plane] + run.sample * components;
        if (components == 1 && memcmp(words + run.lane, expected, run.count * sizeof *words) == 0)
            continue;
        for (uint32_t lane = run.lane; lane < run.lane + run.count; lane++)
            for (uint32_t c = 0; c < components; c++)
                if (words[c * TILE_LANES + lane] != *expected++)
                    return lane;
    }
    return TILE_LANES;
}

status arrival_check(const arrival *a)
{
    for (int i = 0; i < a->program->plane_count; i++) {
        const uint32_t components = (uint32_t)plane_words(a, a->plane_at[i]) / TILE_LANES;
        for (uint32_t t = 0; a->function->plane_values[i] && t < a->tiling.tile_count; t++) {
            const uint32_t lane = lane_that_differs(a, i, components, t);
            if (lane < TILE_LANES)
                return report_error(a->report, STATUS_REFUSED, "internal error: plane '%s' differs between the levels of detail at block %u, lane %u",
                                    a->program->planes[i].name, t, lane);
        }
    }
    return STATUS_OK;
}
