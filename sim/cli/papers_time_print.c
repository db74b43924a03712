// Times on the card beside the paper's frame rates, as Markdown, and what makes each ratio that is far off.
//
// A ratio of times is the ratio of passes times the ratio of what a pass costs: where the paper's ratio is not met, the
// two factors tell which of them differs.
#include "papers_time.h"

#include <inttypes.h>
#include <math.h>

static const double FAR_OFF = 0.25;

// A program beside layer peeling, which takes more of all.
typedef struct ratio {
    double times, passes;
    double busy;  // times without the last iteration of either, which finds nothing; of measured ones alone
} ratio;

static ratio ratio_here(const paper_time *peel, const paper_time *other)
{
    return (ratio){.times = peel->seconds / other->seconds,
                   .passes = (double)peel->passes / (double)other->passes,
                   .busy = (peel->seconds - peel->last_seconds) / (other->seconds - other->last_seconds)};
}

static uint64_t printed_iterations(const paper_row *row, int program)
{
    return *(const uint64_t *)(const void *)((const char *)row + paper_timed_rows[program].iterations);
}

static double printed_fps(const paper_row *row, int program)
{
    return *(const double *)(const void *)((const char *)row + paper_timed_rows[program].fps);
}

static double printed_passes(const paper_row *row, int program)
{
    return (double)(printed_iterations(row, program) * paper_timed_rows[program].passes_an_iteration);
}

static ratio ratio_printed(const paper_row *row, int program)
{
    return (ratio){.times = printed_fps(row, program) / row->fps_layer_peel,
                   .passes = printed_passes(row, PAPER_TIMED_layer_peel) / printed_passes(row, program)};
}

static int percent(double here, double there)
{
    return (int)lround(100 * (here / there - 1));
}

void paper_print_time_intro(const paper_setup *setup, const paper_machine_set *set)
{
    char hash[33];
    machine_hash(&set->machines[PAPER_MACHINE_card], hash);
    const machine *card = &set->machines[PAPER_MACHINE_card];
    printf(
        "# The papers' frame rates\n\n"
        "Times of the level cycle on machine `%s` (%s) at %" PRId64 " MHz: %s, %s, %" PRId64 " bits of stencil.\n"
        "coherent_layer_peel_b keeps its own depths as 32-bit floats and blends those of `before` as rgba32f, since "
        "section 6 moves depths by blending.\n"
        "Where a program's counts differ with a 32-bit depth buffer, since 24 bits let depths fall together, it is "
        "timed with `depth_format=z32f` as well.\n\n"
        "*times*: how many times faster than layer_peel. *without last*: the same without the last, empty iteration of "
        "both.\n*by passes*: what that would be if all passes cost the same. *M tri/s*: triangles x geometry passes / "
        "time, in millions;\nof the paper: its faces x passes x frames a second. *bound by*: the resource that bounds "
        "the passes which take most of the\ntime, and their share of it.\n\n",
        card->name, hash, card->core_mhz, format_table[card->depth_format].name, format_table[card->color_format].name,
        card->stencil_bits);
    printf("Slices at %u x %u pixels, meshes at %u x %u, 1 sample a pixel; %" PRIu64 " buckets.\n\n",
           setup->figure.width, setup->figure.height, setup->mesh.width, setup->mesh.height,
           setup->mesh.order_parameter);
    fflush(stdout);
}

static void print_bound(const paper_time *time)
{
    double share;
    const clock_resource resource = paper_time_bound(time, &share);
    printf(" %s %.0f %% |", clock_resource_names[resource], 100 * share);
}

static void print_measured(const paper_timing *timing, const paper_time *time)
{
    printf(" %" PRIu64 " | %" PRIu64 " | %" PRIu64 " | %.4g | %.4g | %.0f |", time->iterations, time->passes,
           time->cycles, 1e3 * time->seconds, 1 / time->seconds,
           (double)timing->triangles * (double)time->passes / time->seconds / 1e6);
}

// ---- Slices --------------------------------------------------------------------------------------------

static void print_slice_rows(const paper_timing *timing)
{
    for (int wide = 0; wide < 2; wide++) {
        for (int p = 0; p < PAPER_TIMED_COUNT; p++) {
            const paper_time *time = &timing->times[wide][p], *peel = &timing->times[wide][PAPER_TIMED_layer_peel];
            const paper_time *hybrid = &timing->times[wide][PAPER_TIMED_hybrid_layer_peel];
            if (!time->known)
                continue;
            printf("| %u | %s | %s | %" PRIu64 " | %" PRIu64 " / %" PRIu64 " | %" PRIu64 " | %.4g | %.4g |",
                   timing->slices, paper_timed_rows[p].name, wide ? "z32f" : "", time->iterations, time->unsorted,
                   time->sorted, time->cycles, 1e3 * time->seconds, 1 / time->seconds);
            if (peel->known)
                printf(" %.3g |", peel->seconds / time->seconds);
            else
                fputs(" – |", stdout);
            if (hybrid->known)
                printf(" %.3g |", time->seconds / hybrid->seconds);
            else
                fputs(" – |", stdout);
            print_bound(time);
            putchar('\n');
        }
    }
}

void paper_print_slices(const paper_setup *setup, const paper_timings *timings)
{
    const paper_timing *all = &timings->slices[PAPER_SLICE_STEPS - 1];
    printf(
        "## Slices and a cone\n\n"
        "`scene:slices_cone,grid=%u`: %" PRIu64 " triangles and %" PRIu64 " fragments with %u slices.\n\n"
        "| slices | program | depth | iterations | unsorted / sorted passes | cycles | ms | frames a second | times | "
        "time over hybrid | bound by |\n"
        "|---:|---|---|---:|---:|---:|---:|---:|---:|---:|---|\n",
        setup->grid, all->triangles, all->fragments, all->slices);
    for (int i = 0; i < PAPER_SLICE_STEPS; i++)
        print_slice_rows(&timings->slices[i]);
    putchar('\n');
    for (int c = 0; c < PAPER_CLAIM_COUNT; c++) {
        const paper_claim_row *claim = &paper_claims[c];
        const paper_time *slower = &all->times[0][claim->slower], *faster = &all->times[0][claim->faster];
        const double here = slower->seconds / faster->seconds;
        const double near = here < claim->low ? claim->low : here > claim->high ? claim->high : here;
        printf("- %u slices: %s by %.3g here, %.3g without the slower one's last, empty iteration. The paper, of 256 "
               "slices: %s. ",
               all->slices, claim->text, here, (slower->seconds - slower->last_seconds) / faster->seconds,
               claim->place);
        if (here == near)
            puts("Within.");
        else
            printf("%+d %%.\n", percent(here, near));
    }
    putchar('\n');
    fflush(stdout);
}

// ---- Meshes --------------------------------------------------------------------------------------------

static void print_mesh_row(const paper_timing *timing, int wide, int p)
{
    const paper_time *time = &timing->times[wide][p], *peel = &timing->times[wide][PAPER_TIMED_layer_peel];
    const paper_row *row = timing->subject->row;
    peel = peel->known ? peel : &timing->times[0][PAPER_TIMED_layer_peel];
    const ratio here = ratio_here(peel, time);
    printf("| %s | %s | %s |", timing->subject->label, paper_timed_rows[p].name, wide ? "z32f" : "");
    print_measured(timing, time);
    printf(" %.2f | %.2f | %.2f |", here.times, here.busy, here.passes);
    print_bound(time);
    if (row && paper_timed_rows[p].in_paper) {
        const ratio there = ratio_printed(row, p);
        printf(" %g | %.0f | %.2f | %.2f | %+d %% |\n", printed_fps(row, p),
               (double)row->faces * printed_passes(row, p) * printed_fps(row, p) / 1e6, there.times, there.passes,
               percent(here.times, there.times));
    } else {
        puts(" – | – | – | – | – |");
    }
}

static void print_factor(const paper_timing *timing, int p, int *counts)
{
    const paper_row *row = timing->subject->row;
    const ratio here = ratio_here(&timing->times[0][PAPER_TIMED_layer_peel], &timing->times[0][p]);
    const ratio there = ratio_printed(row, p);
    const double pass_here = here.times / here.passes, pass_there = there.times / there.passes;
    counts[0]++;
    if (fabs(here.times / there.times - 1) <= FAR_OFF)
        return;
    counts[1]++;
    printf(
        "- %s, %s: %.2f here, %.2f there, %+d %%. Fewer passes: %.2f here, %.2f there, %+d %%. A pass against "
        "one of layer_peel: %.2f times as fast here, %.2f there, %+d %%. Without either's last, empty iteration: %.2f, "
        "%+d %%.\n",
        timing->subject->label, paper_timed_rows[p].name, here.times, there.times, percent(here.times, there.times),
        here.passes, there.passes, percent(here.passes, there.passes), pass_here, pass_there,
        percent(pass_here, pass_there), here.busy, percent(here.busy, there.times));
}

static void print_far_off(const paper_setup *setup, const paper_timings *timings)
{
    int counts[2] = {0};
    puts("\n### Ratios that are off the paper's by more than 25 %\n");
    for (int i = 0; i < setup->subject_count; i++) {
        if (!timings->subjects[i].subject->row)
            continue;
        print_factor(&timings->subjects[i], PAPER_TIMED_coherent_layer_peel_a, counts);
        print_factor(&timings->subjects[i], PAPER_TIMED_coherent_layer_peel_b, counts);
    }
    printf("\n%d of %d ratios of table 1.\n", counts[1], counts[0]);
}

void paper_print_times(const paper_setup *setup, const paper_timings *timings)
{
    puts("## Meshes\n\n"
         "| subject | program | depth | iterations | passes | cycles | ms | frames a second | M tri/s | times | "
         "without last | "
         "by passes | bound by | frames a second, paper | M tri/s, paper | times, paper | by passes, paper | off |\n"
         "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|");
    for (int i = 0; i < setup->subject_count; i++)
        for (int wide = 0; wide < 2; wide++)
            for (int p = 0; p < PAPER_TIMED_COUNT; p++)
                if (timings->subjects[i].times[wide][p].known)
                    print_mesh_row(&timings->subjects[i], wide, p);
    print_far_off(setup, timings);
    fflush(stdout);
}
