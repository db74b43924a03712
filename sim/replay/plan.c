// A bound program in, its layout in a tile's storage and in the counts array out.
#include "replay.h"

static uint32_t plane_words(const bound_program *bound, int plane)
{
    const bool color = format_table[bound_plane_format(bound, plane)].class == FORMAT_CLASS_COLOR;
    return (color ? 4 : 1) * TILE_LANES;
}

bool plan_stops_after(const plan *plan, const step *step, uint64_t *passes)
{
    const bool pass = step->kind == STEP_FULLSCREEN || step->kind == STEP_LIST || (step->kind == STEP_DRAW && step->classes != DRAW_OPAQUE);
    if (plan->stop_after_pass && pass)
        ++*passes;
    return pass && plan->stop_after_pass && *passes == plan->stop_after_pass;
}

uint32_t list_depth_formats(const program *program, const bound_program *bound)
{
    uint32_t formats = 0;
    for (int s = 0; s < program->step_count; s++)
        if (program->steps[s].kind == STEP_LIST)
            formats |= 1u << bound_plane_format(bound, program->steps[s].source);
    return formats;
}

status plan_make(plan *plan, const program *program, const bound_program *bound, const report *report)
{
    plan->program = program;
    plan->bound = bound;
    plan->tile_words = 0;
    for (int i = 0; i < program->plane_count; i++) {
        plan->plane_offset[i] = plan->tile_words;
        plan->tile_words += plane_words(bound, i);
    }
    plan->count_offset[0] = 0;
    for (int k = 0; k < program->kernel_count; k++) {
        int count;
        bound_instructions(bound, k, &count);
        plan->count_offset[k + 1] = plan->count_offset[k] + (uint32_t)count;
    }
    plan->list_kept_at = plan->count_offset[program->kernel_count];
    plan->list_lost_at = plan->list_kept_at + 1;
    plan->count_total = plan->list_kept_at + 2;
    uint8_t repeats = 0, batches = 0;
    for (int s = 0; s < program->step_count; s++) {
        if (program->steps[s].kind == STEP_BATCHES) {
            if (batches == BATCHES_MAX)
                return report_error(report, STATUS_REFUSED, "line %d: a schedule has at most %d 'batches'", program->steps[s].line, BATCHES_MAX);
            plan->has_batches = true;
            plan->batches_index[s] = plan->batches_index[program->steps[s].target] = batches++;
        }
        if (program->steps[s].kind != STEP_REPEAT)
            continue;
        if (repeats == REPEAT_MAX)
            return report_error(report, STATUS_REFUSED, "line %d: a schedule has at most %d 'repeat'", program->steps[s].line, REPEAT_MAX);
        plan->repeat_index[s] = plan->repeat_index[program->steps[s].target] = repeats++;
    }
    return STATUS_OK;
}
