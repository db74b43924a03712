// What a programmable ROP gains, as Markdown: a table a subject and set of formats, and one of all.
#include "papers_time.h"

#include <inttypes.h>
#include <math.h>

void paper_print_gain_intro(const paper_setup *setup, const paper_machine_set *set)
{
    printf("# What a programmable ROP would gain\n\n"
           "Times of the level cycle. Fixed-function programs and free kernels run on the same machine, the card's "
           "rates with a kernel unit of so many\nslots a clock (`kernel_slots_per_clock`, of the chip: 6 are one "
           "instruction a clock and quad in each partition). An instruction whose guard holds\nnowhere in a quad takes "
           "a slot (*guarded 1*) or none (*guarded 0*, `kernel_guarded_slots`).\n\n"
           "Cells are milliseconds; *=*: not run, since the rate before gained less than %.0f %% over the one before "
           "it. *beats A*, *beats layer_peel*: slots a clock\nfrom which it is faster, between two rates as if time "
           "were a + b / slots.\n\n",
           100 * PAPER_GAIN_LEAST);
    for (int f = 0; f < PAPER_GAIN_FORMATS; f++) {
        const machine *machine = &set->machines[PAPER_MACHINE_rop + f];
        char hash[33];
        machine_hash(machine, hash);
        printf("- %s, %s: %s (`%s`, %s)\n", format_table[machine->depth_format].name,
               format_table[machine->color_format].name, paper_machines[PAPER_MACHINE_rop + f].meaning, machine->name,
               hash);
    }
    for (int p = 0; p < PAPER_GAINER_COUNT; p++)
        printf("- `%s`: %s\n", paper_gainers[p].words, paper_gainers[p].meaning);
    printf("\nMeshes at %u x %u pixels, slices at %u x %u, with %u quads a side.\n\n", setup->mesh.width,
           setup->mesh.height, setup->figure.width, setup->figure.height, setup->grid);
    fflush(stdout);
}

static void print_meets(double slots)
{
    if (slots == 0)
        printf(" below %" PRId64 " |", paper_slots[0]);
    else if (isinf(slots))
        fputs(" never |", stdout);
    else
        printf(" %.3g |", slots);
}

static void print_rows(const paper_gain *gain, int f)
{
    for (int p = 0; p < PAPER_GAINER_COUNT; p++) {
        for (int g = 0; g < paper_gain_guards(f); g++) {
            const paper_time *times = gain->times[f][g][p];
            printf("| %s | %d | %" PRIu64 " |", paper_gainers[p].words, g == 0, times[0].passes);
            for (int s = 0; s < PAPER_SLOTS_COUNT; s++) {
                if (times[s].known)
                    printf(" %.4g |", 1e3 * times[s].seconds);
                else
                    fputs(" = |", stdout);
            }
            print_meets(paper_gain_meets(times, gain->coherent[f].seconds));
            print_meets(paper_gain_meets(times, gain->peel[f].seconds));
            double share;
            const paper_time *least = &times[0];
            const clock_resource resource = paper_time_bound(least, &share);
            printf(" %s %.0f %%", clock_resource_names[resource], 100 * share);
            const paper_time *most = least;
            for (int s = 1; s < PAPER_SLOTS_COUNT; s++)
                most = times[s].known ? &times[s] : most;
            const clock_resource last = paper_time_bound(most, &share);
            printf(", %s %.0f %% |\n", clock_resource_names[last], 100 * share);
        }
    }
}

static void print_fixed(const char *name, const paper_time *time)
{
    double share;
    const clock_resource resource = paper_time_bound(time, &share);
    printf("%s: %.4g ms in %" PRIu64 " passes, bound by %s (%.0f %%)", name, 1e3 * time->seconds, time->passes,
           clock_resource_names[resource], 100 * share);
}

void paper_print_gain(const paper_gain *gain)
{
    static const char *const formats[PAPER_GAIN_FORMATS] = {"the card's formats", "wide formats"};
    printf("## %s\n\n%" PRIu64 " triangles, %" PRIu64 " fragments.\n", gain->label, gain->triangles, gain->fragments);
    for (int f = 0; f < PAPER_GAIN_FORMATS; f++) {
        printf("\nIn %s. ", formats[f]);
        print_fixed("layer_peel", &gain->peel[f]);
        print_fixed("; A", &gain->coherent[f]);
        fputs(".\n\n| program | guarded | passes |", stdout);
        for (int s = 0; s < PAPER_SLOTS_COUNT; s++)
            printf(" %" PRId64 " |", paper_slots[s]);
        fputs(" beats A | beats layer_peel | bound by, first and last rate |\n|---|---:|---:|", stdout);
        for (int s = 0; s < PAPER_SLOTS_COUNT + 2; s++)
            fputs("---:|", stdout);
        puts("---|");
        print_rows(gain, f);
    }
    putchar('\n');
    fflush(stdout);
}

static void print_speeds(const paper_gain *gain, int p, int slots)
{
    const double seconds = paper_gain_seconds(gain->times[0][0][p], slots);
    printf(" %.2f · %.2f |", gain->peel[0].seconds / seconds, gain->coherent[0].seconds / seconds);
}

void paper_print_gain_summary(const paper_gains *gains)
{
    enum { MIDDLE = 2, LAST = PAPER_SLOTS_COUNT - 1 };
    printf("## All subjects, in the card's formats, guarded 1\n\n"
           "Times faster than layer_peel · than A, at %" PRId64 ", %" PRId64 " and %" PRId64 " slots a clock.\n\n"
           "| subject | A over layer_peel | program | %" PRId64 " | %" PRId64 " | %" PRId64
           " | beats A | beats layer_peel |\n|---|---:|---|---:|---:|---:|---:|---:|\n",
           paper_slots[0], paper_slots[MIDDLE], paper_slots[LAST], paper_slots[0], paper_slots[MIDDLE],
           paper_slots[LAST]);
    for (int i = 0; i < gains->count; i++) {
        const paper_gain *gain = &gains->gains[i];
        for (int p = 0; p < PAPER_GAINER_COUNT; p++) {
            printf("| %s | %.2f | %s |", gain->label, gain->peel[0].seconds / gain->coherent[0].seconds,
                   paper_gainers[p].words);
            print_speeds(gain, p, 0);
            print_speeds(gain, p, MIDDLE);
            print_speeds(gain, p, LAST);
            print_meets(paper_gain_meets(gain->times[0][0][p], gain->coherent[0].seconds));
            print_meets(paper_gain_meets(gain->times[0][0][p], gain->peel[0].seconds));
            putchar('\n');
        }
    }
    fflush(stdout);
}
