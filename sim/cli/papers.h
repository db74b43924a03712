// The parts of `ropsim papers`: what is measured, and the printing of it.
//
// A *subject* is a mesh or scene seen from one view. A *case* is one trace: a subject in one order of its triangles. A
// *cell* is a case replayed with one program.
#ifndef PAPERS_H
#define PAPERS_H

#include "command.h"

enum {
    PAPER_PATH_SIZE = 4096,
    PAPER_LABEL_SIZE = 48,
    PAPER_MESHES_MAX = 16,
};

#define PAPER_VIEW(name, axis, meaning) PAPER_VIEW_##name,
typedef enum paper_view {
#include "papers.def"
    PAPER_VIEW_COUNT
} paper_view;
#define PAPER_PROGRAM(name, on_meshes, meaning) PAPER_PROGRAM_##name,
typedef enum paper_program {
#include "papers.def"
    PAPER_PROGRAM_COUNT
} paper_program;
#define PAPER_ORDER(name, kind, parameter, meaning) PAPER_ORDER_##name,
typedef enum paper_order {
#include "papers.def"
    PAPER_ORDER_COUNT
} paper_order;
#define PAPER_FIGURE(name, class, kind, parameter, meaning) PAPER_FIGURE_##name,
typedef enum paper_figure {
#include "papers.def"
    PAPER_FIGURE_COUNT
} paper_figure;
#define PAPER_ROW(model, view, faces, a, b, peel, a_fps, b_fps, peel_fps) PAPER_ROW_##model##_##view,
enum {
#include "papers.def"
    PAPER_ROW_COUNT
};

// ---- Tables (papers_tables.c) --------------------------------------------------------------------------

typedef struct paper_view_row {
    const char *name;
    int axis;  // 0 to 2; -1: the longest
    const char *meaning;
} paper_view_row;

typedef struct paper_row {
    const char *model;
    paper_view view;
    uint32_t faces;
    uint64_t coherent_a, coherent_b, layer_peel;  // iterations
    double fps_coherent_a, fps_coherent_b, fps_layer_peel;
} paper_row;

typedef struct paper_program_row {
    const char *name;
    bool on_meshes;
    const char *meaning;
} paper_program_row;

typedef struct paper_order_row {
    const char *name, *class;  // class: prefix of the scene
    triangle_order kind;
    uint64_t parameter;
    const char *meaning;
} paper_order_row;

extern const paper_view_row paper_views[PAPER_VIEW_COUNT];
extern const paper_row paper_rows[PAPER_ROW_COUNT];
extern const paper_program_row paper_programs[PAPER_PROGRAM_COUNT];
extern const paper_order_row paper_orders[PAPER_ORDER_COUNT];
extern const paper_order_row paper_figures[PAPER_FIGURE_COUNT];
// The model of table 1 that is called so; NULL, with the names and the nearest one said, if there is none.
const char *paper_model(const char *name);

// ---- Traces (papers_trace.c) ---------------------------------------------------------------------------

enum { PAPER_FOLDER_SIZE = PAPER_PATH_SIZE };
// Makes a folder for traces in $TMPDIR; empty if it fails.
status paper_folder_make(char folder[PAPER_FOLDER_SIZE]);
// Records the scene and opens the trace, whose file has no name any more. Warnings of the mesh were said before.
status paper_trace_record(const char *folder, const char *scene, const record_options *options, trace **trace);
// Says errors alone: each mesh is loaded once for its box and once for each trace.
extern const report paper_errors;

// ---- Measuring (papers_measure.c) ----------------------------------------------------------------------

typedef struct paper_cell {
    bool known;                               // was replayed
    uint64_t iterations, passes, fullscreen;  // the last, empty iteration included
    uint64_t unsorted, sorted;                // of the passes, those that replayed such draws
    uint64_t samples_wrong;
    double max_abs;
    bool exact, limit_reached;
} paper_cell;

typedef struct paper_case {
    char subject[PAPER_LABEL_SIZE];
    const char *order;  // row's name
    uint32_t width, height;
    uint64_t fragments, triangles;
    uint64_t deepest;  // most fragments at one sample
    double mean;       // of the samples that have any
    paper_cell cells[PAPER_PROGRAM_COUNT];
} paper_case;

typedef struct paper_bench paper_bench;
// Loads every program and makes a folder for traces. `out`: where a JSON a cell and a CSV of all go, NULL: nowhere.
// `cases`: traces to come, for the progress. Free with paper_bench_destroy.
status paper_bench_create(const machine *machine, const run_options *run, const char *out, uint64_t cases,
                          paper_bench **bench);
// Records the scene and replays it. The trace is gone afterwards.
status paper_measure(paper_bench *bench, const char *scene, const record_options *options, bool on_meshes,
                     const char *subject, const char *order, paper_case *measured);
// Writes the CSV.
status paper_bench_finish(paper_bench *bench);
void paper_bench_destroy(paper_bench *bench);  // NULL is fine

// ---- Views (papers_views.c) ----------------------------------------------------------------------------

// The box of a mesh's triangles.
typedef struct paper_box {
    double low[3], high[3];
    uint32_t faces;
} paper_box;

// STATUS_REFUSED, said, if the mesh has no triangle.
status paper_box_of(const char *path, paper_box *box);
// The axis that a view of this box looks along.
int paper_view_axis(paper_view view, const paper_box *box);
// Perspective from the axis' positive side, from where the box just fits.
void paper_view_camera(paper_view view, const paper_box *box, double aspect, camera *camera);

// ---- Pages (papers_print.c, papers_compare.c), Markdown on stdout --------------------------------------

typedef struct paper_subject {
    const char *scene;             // as the user gave it
    char model[PAPER_LABEL_SIZE];  // of table 1, or made of the scene's name
    char label[PAPER_LABEL_SIZE];  // model and view
    const paper_row *row;          // of table 1, or NULL
    paper_view view;
    paper_box box;
    camera camera;  // eye_set: a mesh; else what is fitted to a scene, from +z
    paper_case cases[PAPER_ORDER_COUNT];
} paper_subject;

// What was measured for all of them.
typedef struct paper_setup {
    record_options figure, mesh;  // the latter's camera is each subject's own
    uint32_t slices;
    uint32_t grid;  // of a slice, in timed runs
    paper_case figures[PAPER_FIGURE_COUNT];
    paper_subject *subjects;  // malloc
    int subject_count;
} paper_setup;

void paper_print_intro(const paper_setup *setup, const machine *machine);
void paper_print_figure(const paper_setup *setup);
void paper_print_orders(void);  // what the columns of all subjects mean
void paper_print_subject(const paper_subject *subject);
// Table 1 beside what was measured, then each difference with what is known of its reason.
void paper_print_table(const paper_setup *setup);
void paper_print_differences(const paper_setup *setup);

#endif
