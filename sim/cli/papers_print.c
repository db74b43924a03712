// What was measured, as Markdown: how, figure 1, and a table a subject with a row a program and a column an order.
#include "papers.h"

#include <inttypes.h>

void paper_print_intro(const paper_setup *setup, const machine *machine)
{
    char hash[33];
    machine_hash(machine, hash);
    printf("# The papers' tables\n\n"
           "The paper: N. Carr, R. Mech, G. Miller, *Coherent Layer Peeling for Transparent High-Depth-Complexity "
           "Scenes*, "
           "Graphics\nHardware 2008. Machine `%s` (%s): depth %s, colour %s, %d bits of stencil.\n"
           "Figure 1 at %u x %u pixels, table 1 at %u x %u, 1 sample a pixel; %" PRIu64 " buckets.\n\n"
           "Counts are *iterations / geometry passes*, the last, empty iteration included. *k wrong*: the image is not "
           "exact, "
           "k samples are off by\nmore than 1e-5.\n\n",
           machine->name, hash, format_table[machine->depth_format].name, format_table[machine->color_format].name,
           (int)machine->stencil_bits, setup->figure.width, setup->figure.height, setup->mesh.width, setup->mesh.height,
           setup->mesh.order_parameter);
}

static void print_cell(const paper_cell *cell)
{
    if (!cell->known) {
        fputs(" – |", stdout);
        return;
    }
    printf(" %" PRIu64 " / %" PRIu64, cell->iterations, cell->passes);
    if (cell->limit_reached)
        fputs(", stopped at the limit", stdout);
    if (!cell->exact)
        printf(", %" PRIu64 " wrong", cell->samples_wrong);
    fputs(" |", stdout);
}

static void print_cases(const paper_case *cases, int count)
{
    fputs("\n| program |", stdout);
    for (int i = 0; i < count; i++)
        printf(" %s |", cases[i].order);
    fputs("\n|---|", stdout);
    for (int i = 0; i < count; i++)
        fputs("---:|", stdout);
    putchar('\n');
    for (int p = 0; p < PAPER_PROGRAM_COUNT; p++) {
        bool any = false;
        for (int i = 0; i < count; i++)
            any = any || cases[i].cells[p].known;
        if (!any)
            continue;
        printf("| %s |", paper_programs[p].name);
        for (int i = 0; i < count; i++)
            print_cell(&cases[i].cells[p]);
        putchar('\n');
    }
    putchar('\n');
    fflush(stdout);
}

void paper_print_figure(const paper_setup *setup)
{
    const paper_case *sorted = &setup->figures[PAPER_FIGURE_sorted];
    printf("## Figure 1: %u slices and a cone of two layers\n\n"
           "`scene:slices_cone,slices=%u`, seen from +z with a field of view of %g degrees that just fits it. %" PRIu64
           " fragments, at most %" PRIu64 " at a sample.\n\n",
           setup->slices, setup->slices, setup->figure.camera.fov_degrees, sorted->fragments, sorted->deepest);
    puts("| program | iterations | unsorted passes | sorted passes | full-screen passes | image | what it is |\n"
         "|---|---:|---:|---:|---:|---|---|");
    for (int p = 0; p < PAPER_PROGRAM_COUNT; p++) {
        const paper_cell *cell = &sorted->cells[p];
        printf("| %s | %" PRIu64 " | %" PRIu64 " | %" PRIu64 " | %" PRIu64 " | ", paper_programs[p].name,
               cell->iterations, cell->unsorted, cell->sorted, cell->fullscreen);
        if (cell->exact)
            fputs("exact", stdout);
        else
            printf("%" PRIu64 " wrong", cell->samples_wrong);
        printf(" | %s |\n", paper_programs[p].meaning);
    }
    puts("\nA pass that replays both classes counts in both columns. The same in other orders:\n");
    for (int i = 0; i < PAPER_FIGURE_COUNT; i++)
        printf("- *%s*: %s\n", paper_figures[i].name, paper_figures[i].meaning);
    print_cases(setup->figures, PAPER_FIGURE_COUNT);
}

void paper_print_orders(void)
{
    puts("## Meshes\n\nThe columns of the next tables are orders of the mesh's triangles:\n");
    for (int i = 0; i < PAPER_ORDER_COUNT; i++)
        printf("- *%s*: %s\n", paper_orders[i].name, paper_orders[i].meaning);
    puts("\nNo draw is known to be sorted, so that hybrid layer peeling would peel every layer, as layer_peel does.\n"
         "layer_peel_everitt and dual_depth_peel lose or mix fragments of one sample that have the same depth.\n");
}

void paper_print_subject(const paper_subject *subject)
{
    const paper_case *first = &subject->cases[0];
    const camera *camera = &subject->camera;
    printf("### %s\n\n", subject->label);
    if (camera->eye_set)
        printf("Looks %s: `--fov %g --eye %.6g,%.6g,%.6g --target %.6g,%.6g,%.6g --up %g,%g,%g`. %" PRIu32 " faces, ",
               paper_views[subject->view].meaning, camera->fov_degrees, camera->eye[0], camera->eye[1], camera->eye[2],
               camera->target[0], camera->target[1], camera->target[2], camera->up[0], camera->up[1], camera->up[2],
               subject->box.faces);
    else
        printf("`%s` from +z, with a field of view of %g degrees that just fits it. ", subject->scene,
               camera->fov_degrees);
    printf("%" PRIu64 " triangles, %" PRIu64 " fragments; samples are at most %" PRIu64
           " fragments deep, %.2f in the mean.\n",
           first->triangles, first->fragments, first->deepest, first->mean);
    print_cases(subject->cases, PAPER_ORDER_COUNT);
}
