// The paper's numbers beside those measured; where they differ, what is known of the reason.
//
// A count agrees if it does with or without the last, empty iteration: the paper does not say which it is.
#include "papers.h"

#include <inttypes.h>

static const struct {
    paper_program program;
    size_t offset;  // of the paper's iterations in paper_row
    uint64_t passes_an_iteration;
    const char *name;
} columns[] = {
    {PAPER_PROGRAM_coherent_layer_peel_a, offsetof(paper_row, coherent_a), 6, "coherent layer peeling A"},
    {PAPER_PROGRAM_coherent_layer_peel_b, offsetof(paper_row, coherent_b), 5, "coherent layer peeling B"},
    {PAPER_PROGRAM_layer_peel, offsetof(paper_row, layer_peel), 2, "layer peeling"},
};
enum { COLUMN_COUNT = sizeof columns / sizeof *columns };

static uint64_t printed(const paper_row *row, int column)
{
    return *(const uint64_t *)(const void *)((const char *)row + columns[column].offset);
}

static bool agrees(uint64_t printed, uint64_t iterations)
{
    return printed == iterations || printed + 1 == iterations;
}

// The paper's own row was measured, its faces are rounded to thousands.
static bool same_faces(const paper_subject *subject)
{
    uint32_t here = subject->box.faces, there = subject->row->faces;
    return (here > there ? here - there : there - here) <= 1000;
}

static void print_row(const char *model, paper_view view, const paper_row *row, const paper_subject *subject)
{
    printf("| %s %s | ", model, paper_views[view].name);
    if (row)
        printf("%uK | ", row->faces / 1000);
    else
        fputs("– | ", stdout);
    if (subject && subject->camera.eye_set)
        printf("%u | ", subject->box.faces);
    else
        fputs("– | ", stdout);
    if (subject)
        printf("%" PRIu64 " | %.2f |", subject->cases[0].deepest, subject->cases[0].mean);
    else
        fputs("– | – |", stdout);
    for (int c = 0; c < COLUMN_COUNT; c++) {
        if (row)
            printf(" %" PRIu64 " it, %" PRIu64 " g |", printed(row, c),
                   printed(row, c) * columns[c].passes_an_iteration);
        else
            fputs(" – |", stdout);
        const paper_cell *cell = subject ? &subject->cases[PAPER_ORDER_bucket].cells[columns[c].program] : NULL;
        if (cell && cell->known)
            printf(" %" PRIu64 " it, %" PRIu64 " g |", cell->iterations, cell->passes);
        else
            fputs(" – |", stdout);
    }
    putchar('\n');
}

void paper_print_table(const paper_setup *setup)
{
    puts("## Table 1, beside the paper\n\n"
         "it: iterations; g: geometry passes. Here: in the order *bucket*, the last, empty iteration included.\n\n"
         "| model, view | faces, paper | here | deepest here | mean here | A, paper | A here | B, paper | B here | "
         "layer peeling, "
         "paper | layer peeling here |\n"
         "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|");
    for (int r = 0; r < PAPER_ROW_COUNT; r++) {
        const paper_subject *subject = NULL;
        for (int i = 0; i < setup->subject_count; i++) {
            if (setup->subjects[i].row == &paper_rows[r])
                subject = &setup->subjects[i];
        }
        print_row(paper_rows[r].model, paper_rows[r].view, &paper_rows[r], subject);
    }
    for (int i = 0; i < setup->subject_count; i++) {
        if (!setup->subjects[i].row)
            print_row(setup->subjects[i].model, setup->subjects[i].view, NULL, &setup->subjects[i]);
    }
    puts("\nA row without numbers here: no mesh was given for it.\n");
}

static void print_order_reason(const paper_subject *subject, int column)
{
    paper_program program = columns[column].program;
    uint64_t wanted = printed(subject->row, column);
    uint64_t sorted = subject->cases[PAPER_ORDER_front].cells[program].iterations;
    printf(" Sorted by centroid without buckets it is %" PRIu64 ": a finer sort %s.", sorted,
           agrees(wanted, sorted) ? "makes it agree" : "does not make it agree");
}

static void print_column_difference(const paper_subject *subject, int column)
{
    const paper_cell *cell = &subject->cases[PAPER_ORDER_bucket].cells[columns[column].program];
    uint64_t wanted = printed(subject->row, column);
    printf("  - %s: the paper %" PRIu64 ", here %" PRIu64 " with the empty iteration, %" PRIu64 " without: ",
           columns[column].name, wanted, cell->iterations, cell->iterations - 1);
    if (wanted == cell->iterations) {
        puts("agrees, counted with it.");
        return;
    }
    if (agrees(wanted, cell->iterations)) {
        puts("agrees, counted without it.");
        return;
    }
    fputs("differs.", stdout);
    if (columns[column].program == PAPER_PROGRAM_layer_peel)
        printf(" The deepest sample has %" PRIu64 " layers here.", cell->iterations - 1);
    else
        print_order_reason(subject, column);
    putchar('\n');
}

static void print_subject_differences(const paper_subject *subject)
{
    printf("- %s\n", subject->label);
    if (!same_faces(subject))
        printf("  - The mesh has %u faces, the paper's %uK: it is another one, or reduced.\n", subject->box.faces,
               subject->row->faces / 1000);
    for (int c = 0; c < COLUMN_COUNT; c++)
        print_column_difference(subject, c);
}

static void print_figure_differences(const paper_setup *setup)
{
    enum { PAPER_SLICES = 256, PAPER_LAYER_PEEL = 257, PAPER_HYBRID = 3 };
    const paper_case *figure = &setup->figures[PAPER_FIGURE_sorted];
    uint64_t peel = figure->cells[PAPER_PROGRAM_layer_peel].iterations;
    uint64_t hybrid = figure->cells[PAPER_PROGRAM_hybrid_layer_peel].iterations;
    puts("- figure 1");
    if (setup->slices != PAPER_SLICES)
        printf("  - %u slices here, %d in the paper.\n", setup->slices, PAPER_SLICES);
    printf("  - layer peeling: the paper %d, here %" PRIu64 " with the empty iteration, %" PRIu64
           " without: the deepest sample's layers are the %u\n    slices and both sides of the cone.\n",
           PAPER_LAYER_PEEL, peel, peel - 1, setup->slices);
    if (setup->slices == PAPER_SLICES && !agrees(PAPER_LAYER_PEEL, peel))
        puts("    It differs: 257 are the slices and one more, be it one side of the cone or the empty iteration. The "
             "paper does not say.");
    printf("  - hybrid layer peeling: the paper %d, here %" PRIu64 " with the empty iteration: %s. %" PRIu64
           " passes of the unsorted draw, %" PRIu64 " of the sorted one.\n",
           PAPER_HYBRID, hybrid, hybrid == PAPER_HYBRID ? "agrees" : "differs",
           figure->cells[PAPER_PROGRAM_hybrid_layer_peel].unsorted,
           figure->cells[PAPER_PROGRAM_hybrid_layer_peel].sorted);
}

// Each count may agree in its own way of counting; how many do in the same way says more.
static void print_agreement(const paper_setup *setup)
{
    int count = 0, with = 0, without = 0;
    for (int i = 0; i < setup->subject_count; i++) {
        const paper_subject *subject = &setup->subjects[i];
        for (int c = 0; subject->row && c < COLUMN_COUNT; c++) {
            uint64_t iterations = subject->cases[PAPER_ORDER_bucket].cells[columns[c].program].iterations;
            count++;
            with += printed(subject->row, c) == iterations;
            without += printed(subject->row, c) + 1 == iterations;
        }
    }
    if (count > 0)
        printf("\nOf %d counts of table 1, %d agree with the empty iteration, %d without it, %d in neither way.\n",
               count, with, without, count - with - without);
}

void paper_print_differences(const paper_setup *setup)
{
    puts("## Where and why the numbers differ\n");
    print_figure_differences(setup);
    for (int i = 0; i < setup->subject_count; i++) {
        if (setup->subjects[i].row)
            print_subject_differences(&setup->subjects[i]);
    }
    print_agreement(setup);
    puts("\nWhat bears on all of them:\n");
#define PAPER_REASON(text) puts("- " text);
#include "papers.def"
    fflush(stdout);
}
