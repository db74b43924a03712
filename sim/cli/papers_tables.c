// The rows of papers.def as arrays.
#include "papers_time.h"

#include <string.h>

#define PAPER_VIEW(name, axis, meaning) {#name, axis, meaning},
const paper_view_row paper_views[PAPER_VIEW_COUNT] = {
#include "papers.def"
};

#define PAPER_ROW(model, view, faces, a, b, peel, a_fps, b_fps, peel_fps) \
    {#model, PAPER_VIEW_##view, faces, a, b, peel, a_fps, b_fps, peel_fps},
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

#define PAPER_MACHINE(name, file, key, value, second_key, second_value, meaning) \
    {#name, file, {{key, value}, {second_key, second_value}}, meaning},
const paper_machine_row paper_machines[PAPER_MACHINE_COUNT] = {
#include "papers.def"
};

// What PAPER_TIMED's column stands for: offsets in a row of table 1, and passes an iteration.
#define COLUMN(name, passes) true, offsetof(paper_row, name), offsetof(paper_row, fps_##name), passes
#define COLUMN_layer_peel COLUMN(layer_peel, 2)
#define COLUMN_coherent_a COLUMN(coherent_a, 6)
#define COLUMN_coherent_b COLUMN(coherent_b, 5)
#define COLUMN_none false, 0, 0, 0
#define TIMED_ROW(name, in_paper, iterations, fps, passes, on_meshes) \
    {name, in_paper, on_meshes, iterations, fps, passes},
#define TIMED(...) TIMED_ROW(__VA_ARGS__)
#define PAPER_TIMED(program, column, on_meshes) TIMED(#program, COLUMN_##column, on_meshes)
const paper_timed_row paper_timed_rows[PAPER_TIMED_COUNT] = {
#include "papers.def"
};

#define PAPER_CLAIM(text, place, slower, faster, low, high) \
    {text, place, PAPER_TIMED_##slower, PAPER_TIMED_##faster, low, high},
const paper_claim_row paper_claims[PAPER_CLAIM_COUNT] = {
#include "papers.def"
};

#define PAPER_GAINER(name, words, meaning) {#name, words, meaning},
const paper_gainer_row paper_gainers[PAPER_GAINER_COUNT] = {
#include "papers.def"
};

#define PAPER_SLOTS(number) number,
const int64_t paper_slots[PAPER_SLOTS_COUNT] = {
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
