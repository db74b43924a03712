// The results of a sweep's runs, in the order of the sweep file: as a Markdown table, as CSV, and the cheapest a trace.
#include "sweep.h"

#include <inttypes.h>
#include <string.h>

enum { SETTINGS_SIZE = 2048 };

// A bar would end a cell of the table.
static void print_cell(FILE *out, const char *text)
{
    fputs(" ", out);
    for (; *text; text++) {
        if (*text == '|')
            fputc('\\', out);
        fputc(*text == '\n' || *text == '\r' ? ' ' : *text, out);
    }
    fputs(" |", out);
}

static void print_labels(const sweep *sweep, const sweep_combination *run, FILE *out)
{
    char settings[SETTINGS_SIZE];
    sweep_settings_text(sweep, run->variant, settings, sizeof settings);
    fputs("|", out);
    print_cell(out, run->trace->label);
    print_cell(out, run->program->label);
    print_cell(out, run->variant->machine.name);
    print_cell(out, settings);
}

static void print_error(const sweep_row *row, FILE *out)
{
    if (!row->stats[STAT_exact].known)
        fputs(" not known |", out);
    else if (row->stats[STAT_exact].count)
        fputs(" exact |", out);
    else if (row->stats[STAT_error_max_abs].known)
        fprintf(out, " %.2g |", row->stats[STAT_error_max_abs].real);
    else
        fputs(" not finite |", out);
}

static void print_figures(const sweep_row *row, FILE *out)
{
    fprintf(out, " %" PRId64 " | %" PRId64 " | %.3f |", row->stats[STAT_geometry_passes].count,
            row->stats[STAT_fragments_replayed].count, (double)row->stats[STAT_plane_bytes].count / 1e6);
    print_error(row, out);
}

static const char heading[] =
    "| trace | program | machine | settings | geometry passes | fragments replayed | plane MB "
    "| largest error |";

status sweep_print(sweep *sweep, FILE *out)
{
    uint64_t absent = 0;
    fprintf(out, "%s outcome |\n|---|---|---|---|---:|---:|---:|---:|---|\n", heading);
    for (uint64_t i = 0; i < sweep_count(sweep); i++) {
        const sweep_combination run = sweep_get(sweep, i);
        sweep_row row;
        bool found;
        const status status = store_find(sweep->store, &run, &found, &row);
        if (status != STATUS_OK)
            return status;
        absent += !found;
        if (!found)
            continue;
        print_labels(sweep, &run, out);
        if (row.outcome == OUTCOME_DONE)
            print_figures(&row, out);
        else
            fputs(" - | - | - | - |", out);
        if (row.outcome == OUTCOME_DONE) {
            print_cell(out, row.stats[STAT_iteration_limit_reached].count ? "limit of iterations" : "done");
        } else {
            char said[sizeof row.why + 16];
            snprintf(said, sizeof said, "%s: %s", sweep_outcome_names[row.outcome], row.why);
            print_cell(out, said);
        }
        fputs("\n", out);
    }
    if (absent > 0)
        fprintf(out, "\n%" PRIu64 " runs are not there yet.\n", absent);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

// In quotes, doubled inside, as RFC 4180 has it: names of programs hold commas.
static void write_text(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++)
        fprintf(file, *text == '"' ? "\"\"" : "%c", *text);
    fputc('"', file);
}

static void write_row(const sweep *sweep, const sweep_combination *run, const sweep_row *row, FILE *file)
{
    char settings[SETTINGS_SIZE];
    sweep_settings_text(sweep, run->variant, settings, sizeof settings);
    const char *texts[] = {ROPSIM_VERSION,
                           "function",
                           run->trace->label,
                           run->trace->hash,
                           run->program->label,
                           run->program->hash,
                           run->variant->machine.name,
                           run->variant->hash,
                           settings,
                           sweep_outcome_names[row->outcome],
                           row->why};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        write_text(file, texts[i]);
        fputc(',', file);
    }
    fprintf(file, "%" PRIu64, run->max_iterations);
    for (int i = 0; i < SWEEP_STAT_COUNT; i++) {
        fputc(',', file);
        if (row->stats[i].known && sweep_stat_rows[i].real)
            fprintf(file, "%.17g", row->stats[i].real);
        else if (row->stats[i].known)
            fprintf(file, "%" PRId64, row->stats[i].count);
    }
    fputs("\r\n", file);
}

status sweep_write_csv(sweep *sweep, const char *path)
{
    aside *aside;
    FILE *file;
    status status = aside_open(path, sweep->report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    fputs(
        "version,detail,trace,trace_hash,program,program_hash,machine,machine_hash,settings,outcome,why,max_iterations",
        file);
    for (int i = 0; i < SWEEP_STAT_COUNT; i++)
        fprintf(file, ",%s", sweep_stat_rows[i].name);
    fputs("\r\n", file);
    for (uint64_t i = 0; status == STATUS_OK && i < sweep_count(sweep); i++) {
        const sweep_combination run = sweep_get(sweep, i);
        sweep_row row;
        bool found;
        status = store_find(sweep->store, &run, &found, &row);
        if (status == STATUS_OK && found)
            write_row(sweep, &run, &row, file);
    }
    if (status == STATUS_OK)
        return aside_finish(aside);
    aside_discard(aside);
    return status;
}

status sweep_print_cheapest(sweep *sweep, sweep_cost cost, bool exact, FILE *out)
{
    const sweep_stat stat = cost == SWEEP_COST_BYTES ? STAT_plane_bytes : STAT_geometry_passes;
    const uint64_t runs_a_trace = sweep->program_count * sweep->variant_count;
    fprintf(out, "%s\n|---|---|---|---|---:|---:|---:|---:|\n", heading);
    for (uint64_t t = 0; t < sweep->trace_count; t++) {
        sweep_row row, best = {0};
        uint64_t best_index = 0;
        bool any = false;
        for (uint64_t i = t * runs_a_trace; i < (t + 1) * runs_a_trace; i++) {
            const sweep_combination run = sweep_get(sweep, i);
            bool found;
            const status status = store_find(sweep->store, &run, &found, &row);
            if (status != STATUS_OK)
                return status;
            if (!found || row.outcome != OUTCOME_DONE || (exact && row.stats[STAT_exact].count != 1) ||
                (any && row.stats[stat].count >= best.stats[stat].count))
                continue;
            any = true;
            best = row;
            best_index = i;
        }
        if (!any) {
            fputs("|", out);
            print_cell(out, sweep->traces[t].label);
            fprintf(out, " no run%s | | | | | | |\n", exact ? " is exact" : "");
            continue;
        }
        const sweep_combination run = sweep_get(sweep, best_index);
        print_labels(sweep, &run, out);
        print_figures(&best, out);
        fputs("\n", out);
    }
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
