// The schedule on one tile, as far as it can go alone.
//
// Tile-major: all passes run over one tile while its planes and fragments are in the nearest cache. What the
// program sees is the pass-major order all the same, since tiles meet only in the conditions of `while` and
// `if`: a tile adds its count to the condition and goes on if the outcome is known, else it waits (global.c).
//
// A finished tile is still visited by every pass of the iterations that others need. Once an iteration leaves
// all its planes as they were, each further one with the same outcomes does the same again: it is counted
// (fixed_point.c), not run. Batches whose outcome is foregone are counted, too (foregone.c).
#include "tile.h"

#include "fragment_list.h"
#include "write_log.h"

#include <stdlib.h>
#include <string.h>

static void note_counting(worker *w)
{
    uint32_t site_count = 0, store_count = 0;
    for (int k = 0; k < w->plan->program->kernel_count; k++) {
        int count;
        const instruction *code = bound_instructions(w->plan->bound, k, &count);
        w->site_start[k] = site_count;
        w->store_start[k] = store_count;
        for (int i = 0; i < count; i++) {
            const uint32_t at = w->plan->count_offset[k] + (uint32_t)i;
            if (code[i].op == OP_count)
                w->sites[site_count++] = (count_site){at, code[i].d};
            else if (code[i].op == OP_st)
                w->stores[store_count++] = at;
        }
        w->site_start[k + 1] = site_count;
        w->store_start[k + 1] = store_count;
    }
}

worker *worker_create(const plan *plan, global *global)
{
    worker *w = calloc(1, sizeof *w);
    if (!w)
        return NULL;
    w->plan = plan;
    w->global = global;
    w->count_total = plan->count_total;
    w->counts = calloc(3 * (size_t)w->count_total + 1, sizeof *w->counts);
    w->before = w->counts + w->count_total;
    w->delta = w->before + w->count_total;
    w->stores = malloc(((size_t)w->count_total + 1) * sizeof *w->stores);
    w->sites = malloc(((size_t)w->count_total + 1) * sizeof *w->sites);  // every instruction may count
    w->snapshot = malloc(plan->tile_words * sizeof *w->snapshot);
    w->expander = expander_create(plan->bound);
    if (!w->counts || !w->stores || !w->sites || !w->snapshot || !w->expander || !foresight_make(plan, &w->foresight)) {
        worker_destroy(w);
        return NULL;
    }
    note_counting(w);
    return w;
}

void worker_destroy(worker *w)
{
    if (!w)
        return;
    free(w->counts);
    free(w->stores);
    free(w->sites);
    free(w->snapshot);
    expander_destroy(w->expander);
    foresight_free(&w->foresight);
    free(w);
}

const uint64_t *worker_counts(const worker *worker)
{
    return worker->counts;
}

uint64_t worker_foregone(const worker *worker)
{
    return worker->foresight.batches;
}

uint32_t plane_words(const plan *plan, int plane)
{
    const uint32_t end = plane + 1 < plan->program->plane_count ? plan->plane_offset[plane + 1] : plan->tile_words;
    return end - plan->plane_offset[plane];
}

static const draw_batch *current_batch(const worker *w, const tile *tile)
{
    return &w->plan->batches[tile->batches].batches[tile->batch];
}

static void clear_plane(worker *w, const tile *tile, const step *step)
{
    uint32_t value[4];
    bound_clear_value(w->plan->bound, step, value);
    if (step->value.kind == VALUE_BATCH_NEAR)
        value[0] = current_batch(w, tile)->near_code;
    else if (step->value.kind == VALUE_BATCH_FAR)
        value[0] = current_batch(w, tile)->far_code;
    const uint32_t words = plane_words(w->plan, step->plane);
    for (uint32_t i = 0; i < words; i++)
        w->planes[step->plane][i] = value[i / TILE_LANES];
    foresight_cleared(&w->foresight, step->plane, value);
}

// Runs the kernel on a batch; NULL: counts what it would have done to those that were passed over.
static void run_kernel(worker *w, tile *tile, int kernel, const batch *batch)
{
    uint64_t *counts = w->counts + w->plan->count_offset[kernel];
    const uint32_t first = w->site_start[kernel], end = w->site_start[kernel + 1];
    for (uint32_t s = first; s < end; s++)
        tile->query[w->sites[s].query] -= w->counts[w->sites[s].at];
    if (batch)
        w->plan->execute(w->plan->bound, kernel, w->planes, batch, counts);
    else
        foresight_count(&w->foresight, counts);
    for (uint32_t s = first; s < end; s++)
        tile->query[w->sites[s].query] += w->counts[w->sites[s].at];
    if (batch)
        foresight_executed(&w->foresight, kernel, w->counts);
}

// Those of a batch's lanes whose draw is drawn now.
static uint64_t lanes_of_draws(const worker *w, const bin_batch *from, const uint8_t *draws)
{
    const uint32_t *draw = w->bins->draw + from->offset;
    uint64_t lanes = 0;
    for (uint64_t left = from->lanes; left; left &= left - 1)
        lanes |= draws[*draw++] ? left & -left : 0;
    return lanes;
}

uint32_t tile_number(const worker *w)
{
    return w->bins->first_tile + (uint32_t)(w->bin - w->bins->bins);
}

// How often the kernel's stores were executed, in all lanes.
static uint64_t stores_executed(const worker *w, int kernel)
{
    uint64_t count = 0;
    for (uint32_t s = w->store_start[kernel], end = w->store_start[kernel + 1]; s < end; s++)
        count += w->counts[w->stores[s]];
    return count;
}

// Notes whether the batch that the kernel ran on wrote; `*stores`: executed before and after it.
static void note_write(worker *w, const tile *tile, int kernel, const bin_batch *batch, uint64_t *stores)
{
    const uint64_t before = *stores;
    *stores = stores_executed(w, kernel);
    if (*stores != before)
        write_log_note(w->plan->writes, tile_number(w), tile->draws, batch->number);
}

static void draw(worker *w, tile *tile, const step *step)
{
    const bin *bin = w->bin;
    if (!bin)
        return;
    const bool opaque = step->classes == DRAW_OPAQUE;
    uint64_t stores = w->plan->writes ? stores_executed(w, step->kernel) : 0;
    const uint32_t first = opaque ? 0 : bin->opaque_count;
    const uint32_t end = opaque ? bin->opaque_count : bin->opaque_count + bin->transparent_count;
    foresight_begin(&w->foresight, step->kernel);
    for (uint32_t r = first; r < end; r++) {
        bin_batch *from = &w->bins->batches[bin->first_batch + r];
        uint64_t lanes = from->lanes;
        if (step->classes == DRAW_UNSORTED)
            lanes &= ~from->sorted;
        else if (step->classes == DRAW_SORTED)
            lanes &= from->sorted;
        else if (step->classes == DRAW_BATCH)
            lanes = lanes_of_draws(w, from, current_batch(w, tile)->draws);
        if (!lanes || foresight_passes_over(&w->foresight, w->planes, w->bins, from, lanes))
            continue;
        run_kernel(w, tile, step->kernel, expander_batch(w->expander, r, lanes));
        if (w->plan->writes)
            note_write(w, tile, step->kernel, from, &stores);
    }
    run_kernel(w, tile, step->kernel, NULL);
    tile->draws++;
}

static void copy_plane(worker *w, const step *step)
{
    memcpy(w->planes[step->plane], w->planes[step->source], plane_words(w->plan, step->plane) * sizeof(uint32_t));
    foresight_copied(&w->foresight, step->plane, step->source);
}

static void swap_planes(worker *w, tile *tile, const step *step)
{
    const uint8_t at = tile->plane_at[step->plane];
    tile->plane_at[step->plane] = tile->plane_at[step->source];
    tile->plane_at[step->source] = at;
    const tile_plane plane = w->planes[step->plane];
    w->planes[step->plane] = w->planes[step->source];
    w->planes[step->source] = plane;
    foresight_swapped(&w->foresight, step->plane, step->source);
}

// Settles the condition of a `while` or `if`, if it can be.
static outcome settle(worker *w, tile *tile, const step *step)
{
    const bool is_while = step->kind == STEP_WHILE;
    const uint64_t threshold = is_while ? w->plan->threshold_while : 0;
    const uint64_t count = tile->query[step->query] * tile->weight;
    if (!tile->waiting) {
        if (!global_add(w->global, tile->evaluation, count)) {
            w->failed = true;
            return OUTCOME_UNKNOWN;
        }
        tile->waiting = true;
    }
    outcome outcome = global_ask(w->global, tile->evaluation, threshold);
    const uint16_t here = (uint16_t)(step - w->plan->program->steps);
    const bool last = is_while && tile->iterations[w->plan->repeat_index[here]] + 1 >= w->plan->max_iterations;
    if (last)
        outcome = OUTCOME_FALSE;
    if (outcome == OUTCOME_UNKNOWN)
        return outcome;
    tile->waiting = false;
    tile->evaluation++;
    fixed_note(w, count, threshold, outcome);
    return outcome;
}

// Runs the step; false if the tile must wait.
static bool run_step(worker *w, tile *tile)
{
    const step *step = &w->plan->program->steps[tile->step];
    outcome outcome;
    switch (step->kind) {
    case STEP_CLEAR: clear_plane(w, tile, step); break;
    case STEP_COPY: copy_plane(w, step); break;
    case STEP_SWAP: swap_planes(w, tile, step); break;
    case STEP_DRAW: draw(w, tile, step); break;
    case STEP_FULLSCREEN: run_kernel(w, tile, step->kernel, &(batch){.lanes = tile->lanes}); break;
    case STEP_RESET: tile->query[step->query] = 0; break;
    case STEP_REPEAT:
        tile->iterations[w->plan->repeat_index[tile->step]] = 0;
        fixed_enter(w);
        fixed_head(w, tile, tile->step);
        break;
    case STEP_WHILE:
        outcome = settle(w, tile, step);
        if (outcome == OUTCOME_UNKNOWN)
            return false;
        tile->iterations[w->plan->repeat_index[tile->step]]++;
        if (outcome == OUTCOME_TRUE) {
            tile->step = step->target;  // its `repeat`; the increment below goes to the body
            fixed_head(w, tile, tile->step);
        }
        break;
    case STEP_IF:
        outcome = settle(w, tile, step);
        if (outcome == OUTCOME_UNKNOWN)
            return false;
        if (outcome == OUTCOME_FALSE)
            tile->step = step->target;
        break;
    case STEP_LIST:
        if (w->bin && !fragment_list_run(w->plan, step, w->bins, w->bin, w->planes, &w->counts[w->plan->list_kept_at],
                                         &w->counts[w->plan->list_lost_at]))
            w->failed = true;
        foresight_wrote(&w->foresight, step->plane);
        break;
    case STEP_BATCHES:
        tile->batch = 0;
        tile->batches = w->plan->batches_index[tile->step];
        if (w->plan->batches[tile->batches].count == 0)
            tile->step = step->target;
        break;
    case STEP_END_BATCHES:
        if (++tile->batch < w->plan->batches[tile->batches].count)
            tile->step = step->target;
        break;
    case STEP_END: break;
    }
    if (plan_stops_after(w->plan, step, &tile->passes))
        tile->step = (uint16_t)w->plan->program->step_count;
    else
        tile->step++;
    return true;
}

bool tile_run(worker *w, tile *tile, const bins *bins, const bin *bin)
{
    w->bins = bins;
    w->bin = bin;
    for (int i = 0; i < w->plan->program->plane_count; i++)
        w->planes[i] = tile->storage + w->plan->plane_offset[tile->plane_at[i]];
    if (bin)
        expander_start(w->expander, bins, bin);
    foresight_start(&w->foresight);
    fixed_start(w, tile);
    while (tile->step < w->plan->program->step_count && run_step(w, tile))
        ;
    tile->done = tile->step >= w->plan->program->step_count;
    return !w->failed;
}
