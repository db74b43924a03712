// `ropsim papers --time`: figure 1's slices and table 1's meshes on the paper's card, timed.
//
// The card's 24-bit depth buffer is the usual one. Each program's counts are taken with a 32-bit one, too, and where
// they differ, since depths fall together, it is timed with that as well.
#include "papers_time.h"

#include <stdlib.h>
#include <string.h>

static bool same_counts(const paper_time *a, const paper_time *b)
{
    return a->iterations == b->iterations && a->passes == b->passes && a->composited == b->composited;
}

static status time_programs(paper_timer *timer, trace *trace, const paper_machine_set *set, const char *label,
                            paper_timing *timing)
{
    const machine *card = &set->machines[PAPER_MACHINE_card], *floats = &set->machines[PAPER_MACHINE_card_z32f];
    const trace_info *info = trace_get_info(trace);
    status status = STATUS_OK;
    timing->fragments = info->fragment_count;
    timing->triangles = 0;
    for (uint32_t i = 0; i < info->draw_count; i++)
        timing->triangles += info->draws[i].triangles;
    for (int p = 0; status == STATUS_OK && p < PAPER_TIMED_COUNT; p++) {
        const char *name = paper_timed_rows[p].name;
        paper_time *here = &timing->times[0][p], *wide = &timing->times[1][p];
        if (timing->subject && !paper_timed_rows[p].on_meshes) {
            paper_timer_skip(timer, 2);
            continue;
        }
        status = paper_timer_run(timer, trace, label, name, card, "card", here);
        if (status == STATUS_OK)
            status = paper_timer_count(timer, trace, name, floats, wide);
        if (status == STATUS_OK && !same_counts(here, wide))
            status = paper_timer_run(timer, trace, label, name, floats, "card_z32f", wide);
        else
            paper_timer_skip(timer, 1);
    }
    return status;
}

static status time_slices(const paper_setup *setup, const paper_machine_set *set, paper_timer *timer,
                          paper_timing *timing)
{
    char scene[96], label[PAPER_LABEL_SIZE];
    trace *trace = NULL;
    snprintf(scene, sizeof scene, "scene:slices_cone,slices=%u,grid=%u", timing->slices, setup->grid);
    snprintf(label, sizeof label, "slices_%u", timing->slices);
    status status = paper_timer_record(timer, label, scene, &setup->figure, &trace);
    if (status == STATUS_OK)
        status = time_programs(timer, trace, set, label, timing);
    trace_close(trace);
    return status;
}

static status time_subject(const paper_setup *setup, const paper_machine_set *set, paper_timer *timer,
                           paper_timing *timing)
{
    const paper_subject *subject = timing->subject;
    record_options options = setup->mesh;
    trace *trace = NULL;
    options.camera = subject->camera;
    options.order = ORDER_BUCKET;
    status status = paper_timer_record(timer, subject->label, subject->scene, &options, &trace);
    if (status == STATUS_OK)
        status = time_programs(timer, trace, set, subject->label, timing);
    trace_close(trace);
    return status;
}

// Each step has at least one slice.
static void choose_steps(const paper_setup *setup, paper_timings *timings)
{
    for (int i = 0; i < PAPER_SLICE_STEPS; i++) {
        const uint32_t slices = setup->slices >> (PAPER_SLICE_STEPS - 1 - i);
        timings->slices[i].slices = slices > 0 ? slices : 1;
    }
}

static status measure(const paper_setup *setup, const paper_machine_set *set, paper_timer *timer,
                      paper_timings *timings)
{
    status status = STATUS_OK;
    choose_steps(setup, timings);
    paper_print_time_intro(setup, set);
    for (int i = 0; status == STATUS_OK && i < PAPER_SLICE_STEPS; i++)
        status = time_slices(setup, set, timer, &timings->slices[i]);
    if (status == STATUS_OK)
        paper_print_slices(setup, timings);
    for (int i = 0; status == STATUS_OK && i < setup->subject_count; i++) {
        timings->subjects[i].subject = &setup->subjects[i];
        status = time_subject(setup, set, timer, &timings->subjects[i]);
    }
    if (status == STATUS_OK)
        paper_print_times(setup, timings);
    return status;
}

status paper_time_all(const paper_setup *setup, const paper_machine_set *machines, const run_options *run,
                      const char *out)
{
    const uint64_t cases = PAPER_SLICE_STEPS + (uint64_t)setup->subject_count;
    paper_timings timings = {.subjects = calloc((size_t)setup->subject_count + 1, sizeof *timings.subjects)};
    paper_timer *timer = NULL;
    if (!timings.subjects)
        return report_error(&command_report, STATUS_IO, "out of memory");
    status status = paper_timer_create(run, out, "time.csv", 2 * cases * PAPER_TIMED_COUNT, &timer);
    if (status == STATUS_OK)
        status = measure(setup, machines, timer, &timings);
    if (status == STATUS_OK)
        status = paper_timer_finish(timer);
    paper_timer_destroy(timer);
    free(timings.subjects);
    return status;
}
