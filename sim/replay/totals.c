// Settled conditions and instruction counts in, passes, iterations and bytes out.
//
// Everything that all tiles do alike (passes, copies, clears) is counted here once, from the schedule; what
// depends on the fragments comes from how often each instruction was executed.
#include "replay.h"

#include <stdlib.h>

static bool has_class(const trace_info *info, draw_class class)
{
    for (uint32_t i = 0; i < info->draw_count; i++)
        if (info->draws[i].class == class)
            return true;
    return false;
}

typedef struct walk {
    const plan *plan;
    global *global;
    const trace_info *info;
    const sample_counts *samples;
    run_result *result;
    uint64_t sample_count, evaluation, passes;
    uint64_t iterations[REPEAT_MAX];
    uint32_t batch;
    uint8_t batches;
    bool log_conditions, failed;
    uint64_t logged_capacity;
} walk;

static uint64_t plane_bytes(const walk *w, int plane, uint64_t accesses)
{
    return accesses * (uint64_t)format_table[bound_plane_format(w->plan->bound, plane)].bits / 8;
}

static void count_draw(const walk *w, const step *step)
{
    run_result *r = w->result;
    if (step->classes == DRAW_OPAQUE) {
        r->passes_by_class[CLASS_OPAQUE]++;
        return;
    }
    r->geometry_passes++;
    const bool both = step->classes == DRAW_TRANSPARENT || step->classes == DRAW_BATCH, any_sorted = has_class(w->info, CLASS_SORTED);
    // A pass over both classes counts in those that the trace has, and as transparent if it has none.
    const bool unsorted = step->classes == DRAW_UNSORTED || (both && (has_class(w->info, CLASS_TRANSPARENT) || !any_sorted));
    const bool sorted = step->classes == DRAW_SORTED || (both && any_sorted);
    r->passes_by_class[CLASS_TRANSPARENT] += unsorted;
    r->passes_by_class[CLASS_SORTED] += sorted;
    const uint64_t *fragments = step->classes == DRAW_BATCH ? w->plan->batches[w->batches].batches[w->batch].class_fragments
                                                            : w->samples->class_fragments;
    if (unsorted)
        r->fragments_replayed += fragments[CLASS_TRANSPARENT];
    if (sorted)
        r->fragments_replayed += fragments[CLASS_SORTED];
}

static bool settled(walk *w, const step *step)
{
    const bool is_while = step->kind == STEP_WHILE;
    const bool above = global_ask(w->global, w->evaluation, is_while ? w->plan->threshold_while : 0) == OUTCOME_TRUE;
    if (!is_while)
        return above;
    w->result->iterations++;
    const int repeat = w->plan->repeat_index[step - w->plan->program->steps];
    if (++w->iterations[repeat] < w->plan->max_iterations)
        return above;
    w->result->iteration_limit_reached |= above;
    return false;
}

static void log_condition(walk *w, bool holds)
{
    run_result *r = w->result;
    if (r->condition_count == w->logged_capacity) {
        w->logged_capacity = w->logged_capacity ? 2 * w->logged_capacity : 64;
        condition_result *grown = realloc(r->conditions, w->logged_capacity * sizeof *grown);
        w->failed |= !grown;
        if (!grown)
            return;
        r->conditions = grown;
    }
    r->conditions[r->condition_count++] = (condition_result){global_count(w->global, w->evaluation), holds};
}

static bool condition_holds(walk *w, const step *step)
{
    const bool holds = settled(w, step);
    if (w->log_conditions && !w->failed)
        log_condition(w, holds);
    w->evaluation++;
    return holds;
}

// One geometry pass that appends, one full-screen pass that sorts and blends.
static void count_list(walk *w, const step *step)
{
    count_draw(w, step);
    run_result *r = w->result;
    r->fullscreen_passes++;
    r->has_list = true;
    r->list_composites |= w->plan->program->blends[step->kernel].composites;
    r->list_entry_bytes = plane_bytes(w, step->source, 1) + plane_bytes(w, step->plane, 1);
    r->planes[step->plane].bytes_read += plane_bytes(w, step->plane, w->sample_count);
    r->planes[step->plane].bytes_written += plane_bytes(w, step->plane, w->sample_count);
    for (int c = CLASS_TRANSPARENT; c <= CLASS_SORTED; c++)
        if (step->classes & (c == CLASS_SORTED ? DRAW_SORTED : DRAW_UNSORTED))
            r->planes[step->source].bytes_read += plane_bytes(w, step->source, w->samples->class_fragments[c]);
}

static void walk_schedule(walk *w)
{
    const program *program = w->plan->program;
    for (int s = 0; s < program->step_count; s++) {
        const step *step = &program->steps[s];
        switch (step->kind) {
        case STEP_CLEAR: w->result->planes[step->plane].bytes_cleared += plane_bytes(w, step->plane, w->sample_count); break;
        case STEP_COPY:
            w->result->planes[step->source].bytes_read += plane_bytes(w, step->source, w->sample_count);
            w->result->planes[step->plane].bytes_written += plane_bytes(w, step->plane, w->sample_count);
            break;
        case STEP_DRAW: count_draw(w, step); break;
        case STEP_FULLSCREEN: w->result->fullscreen_passes++; break;
        case STEP_REPEAT: w->iterations[w->plan->repeat_index[s]] = 0; break;
        case STEP_WHILE:
            if (condition_holds(w, step))
                s = step->target;
            break;
        case STEP_IF:
            if (!condition_holds(w, step))
                s = step->target;
            break;
        case STEP_LIST: count_list(w, step); break;
        case STEP_BATCHES:
            w->batch = 0;
            w->batches = w->plan->batches_index[s];
            if (w->plan->batches[w->batches].count == 0)
                s = step->target;
            break;
        case STEP_END_BATCHES:
            if (++w->batch < w->plan->batches[w->batches].count)
                s = step->target;
            break;
        case STEP_SWAP:
        case STEP_RESET:
        case STEP_END: break;
        }
        if (plan_stops_after(w->plan, step, &w->passes))
            break;
    }
}

static void count_instructions(const walk *w, const uint64_t *counts)
{
    const program *program = w->plan->program;
    for (int k = 0; k < program->kernel_count; k++) {
        int count;
        const instruction *code = bound_instructions(w->plan->bound, k, &count);
        for (int i = 0; i < count; i++) {
            const uint64_t executed = counts[w->plan->count_offset[k] + (uint32_t)i];
            plane_result *planes = w->result->planes;
            switch (code[i].op) {
            case OP_ld: planes[code[i].a].bytes_read += plane_bytes(w, code[i].a, executed); break;
            case OP_tex: planes[code[i].a].texture_bytes_read += plane_bytes(w, code[i].a, executed); break;
            case OP_st: planes[code[i].d].bytes_written += plane_bytes(w, code[i].d, executed); break;
            case OP_blend:
                if (program->blends[code[i].c].composites)
                    w->result->fragments_composited += executed;
                break;
            default: break;
            }
        }
    }
}

bool totals_count(const plan *plan, global *global, const uint64_t *counts, const trace_info *info,
                  const sample_counts *samples, bool log_conditions, run_result *result)
{
    walk w = {.plan = plan, .global = global, .info = info, .samples = samples, .result = result,
              .log_conditions = log_conditions};
    w.sample_count = (uint64_t)info->width * info->height * info->samples;
    walk_schedule(&w);
    count_instructions(&w, counts);
    result->list_kept = counts[plan->list_kept_at];
    result->list_lost = counts[plan->list_lost_at];
    result->fragments_composited += result->list_composites ? result->list_kept : 0;
    return !w.failed;
}
