// `ropsim papers --gain`: what a programmable ROP gains, over the slots a clock of its kernel unit.
#include "papers_time.h"

#include <math.h>
#include <stdlib.h>

const double PAPER_GAIN_LEAST = 0.01;

static status time_rates(paper_timer *timer, trace *trace, const char *label, const machine *formats, int guard,
                         const char *program, paper_time times[PAPER_SLOTS_COUNT])
{
    status status = STATUS_OK;
    machine machine = *formats;
    machine.kernel_guarded_slots = guard == 0;
    for (int s = 0; status == STATUS_OK && s < PAPER_SLOTS_COUNT; s++) {
        char note[PAPER_LABEL_SIZE];
        if (s > 1 && times[s - 1].seconds > (1 - PAPER_GAIN_LEAST) * times[s - 2].seconds) {
            paper_timer_skip(timer, (uint64_t)(PAPER_SLOTS_COUNT - s));
            break;
        }
        machine.kernel_slots_per_clock = paper_slots[s];
        snprintf(note, sizeof note, "%s_guarded_%d_slots_%d", format_table[machine.depth_format].name, guard == 0,
                 (int)paper_slots[s]);
        status = paper_timer_run(timer, trace, label, program, &machine, note, &times[s]);
    }
    return status;
}

static status time_subject(paper_timer *timer, trace *trace, const paper_machine_set *set, paper_gain *gain)
{
    const trace_info *info = trace_get_info(trace);
    status status = STATUS_OK;
    gain->fragments = info->fragment_count;
    for (uint32_t i = 0; i < info->draw_count; i++)
        gain->triangles += info->draws[i].triangles;
    for (int f = 0; status == STATUS_OK && f < PAPER_GAIN_FORMATS; f++) {
        const machine *formats = &set->machines[PAPER_MACHINE_rop + f];
        const char *note = format_table[formats->depth_format].name;
        status = paper_timer_run(timer, trace, gain->label, "layer_peel", formats, note, &gain->peel[f]);
        if (status == STATUS_OK)
            status =
                paper_timer_run(timer, trace, gain->label, "coherent_layer_peel_a", formats, note, &gain->coherent[f]);
        for (int g = 0; g < paper_gain_guards(f); g++)
            for (int p = 0; status == STATUS_OK && p < PAPER_GAINER_COUNT; p++)
                status =
                    time_rates(timer, trace, gain->label, formats, g, paper_gainers[p].words, gain->times[f][g][p]);
    }
    return status;
}

static status measure_one(const paper_setup *setup, const paper_machine_set *set, paper_timer *timer, int index,
                          paper_gain *gain)
{
    char slices[96];
    const char *scene = slices;
    record_options options = setup->figure;
    trace *trace = NULL;
    snprintf(slices, sizeof slices, "scene:slices_cone,slices=%u,grid=%u", setup->slices, setup->grid);
    snprintf(gain->label, sizeof gain->label, "slices_%u", setup->slices);
    if (index < setup->subject_count) {
        const paper_subject *subject = &setup->subjects[index];
        scene = subject->scene;
        options = setup->mesh;
        options.camera = subject->camera;
        options.order = ORDER_BUCKET;
        snprintf(gain->label, sizeof gain->label, "%s", subject->label);
    }
    status status = paper_timer_record(timer, gain->label, scene, &options, &trace);
    if (status == STATUS_OK)
        status = time_subject(timer, trace, set, gain);
    trace_close(trace);
    return status;
}

status paper_gain_all(const paper_setup *setup, const paper_machine_set *machines, const run_options *run,
                      const char *out, const char *svg)
{
    uint64_t runs = 0;  // of a subject
    for (int f = 0; f < PAPER_GAIN_FORMATS; f++)
        runs += 2 + (uint64_t)paper_gain_guards(f) * PAPER_GAINER_COUNT * PAPER_SLOTS_COUNT;
    paper_gains gains = {.count = setup->subject_count + 1};
    paper_timer *timer = NULL;
    gains.gains = calloc((size_t)gains.count, sizeof *gains.gains);
    if (!gains.gains)
        return report_error(&command_report, STATUS_IO, "out of memory");
    status status = paper_timer_create(run, out, "gain.csv", (uint64_t)gains.count * runs, &timer);
    if (status == STATUS_OK)
        paper_print_gain_intro(setup, machines);
    for (int i = 0; status == STATUS_OK && i < gains.count; i++) {
        status = measure_one(setup, machines, timer, i, &gains.gains[i]);
        if (status == STATUS_OK)
            paper_print_gain(&gains.gains[i]);
    }
    if (status == STATUS_OK) {
        paper_print_gain_summary(&gains);
        status = paper_timer_finish(timer);
    }
    if (status == STATUS_OK && svg)
        status = paper_gain_svg(&gains, svg);
    paper_timer_destroy(timer);
    free(gains.gains);
    return status;
}

// ---- Reading a curve -----------------------------------------------------------------------------------

double paper_gain_seconds(const paper_time times[PAPER_SLOTS_COUNT], int slots)
{
    while (slots > 0 && !times[slots].known)
        slots--;
    return times[slots].seconds;
}

double paper_gain_meets(const paper_time times[PAPER_SLOTS_COUNT], double seconds)
{
    if (paper_gain_seconds(times, 0) <= seconds)
        return 0;
    for (int s = 1; s < PAPER_SLOTS_COUNT; s++) {
        const double slow = paper_gain_seconds(times, s - 1), fast = paper_gain_seconds(times, s);
        if (fast > seconds)
            continue;
        const double at_slow = 1 / (double)paper_slots[s - 1], at_fast = 1 / (double)paper_slots[s];
        return 1 / (at_slow + (at_fast - at_slow) * (slow - seconds) / (slow - fast));
    }
    return INFINITY;
}
