// The rows of papers.def as arrays.
#include "papers.h"

#include <string.h>

#define PAPER_VIEW(name, axis, meaning) {#name, axis, meaning},
const paper_view_row paper_views[PAPER_VIEW_COUNT] = {
#include "papers.def"
};

#define PAPER_ROW(model, view, faces, a, b, peel) {#model, PAPER_VIEW_##view, faces, a, b, peel},
const paper_row paper_rows[PAPER_ROW_COUNT] = {
#include "papers.def"
};

#define PAPER_PROGRAM(name, on_meshes, meaning) {#name, on_meshes, meaning},
const paper_program_row paper_programs[PAPER_PROGRAM_COUNT] = {
#include "papers.def"
};

#define PAPER_ORDER(name, kind, parameter, meaning) {#name, "", kind, parameter, meaning},
const paper_order_row paper_orders[PAPER_ORDER_COUNT] = {
#include "papers.def"
};

#define PAPER_FIGURE(name, class, kind, parameter, meaning) {#name, class, kind, parameter, meaning},
const paper_order_row paper_figures[PAPER_FIGURE_COUNT] = {
#include "papers.def"
};

const char *paper_model(const char *name)
{
    const char *names[PAPER_ROW_COUNT];
    char list[256] = "";
    size_t count = 0;
    for (int i = 0; i < PAPER_ROW_COUNT; i++) {
        if (strcmp(paper_rows[i].model, name) == 0)
            return paper_rows[i].model;
        if (count > 0 && strcmp(names[count - 1], paper_rows[i].model) == 0)
            continue;
        names[count++] = paper_rows[i].model;
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", used ? ", " : "", paper_rows[i].model);
    }
    const char *meant = nearest_word(name, names, count);
    report_error(&command_report, STATUS_USAGE, "table 1 has no model `%s`; %s%s%sit has %s", name,
                 meant ? "did you mean `" : "", meant ? meant : "", meant ? "`? " : "", list);
    return NULL;
}
