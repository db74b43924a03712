// The results of a sweep's runs, in the order of the sweep file: as a Markdown table and as CSV.
#include "sweep.h"

#include <inttypes.h>
#include <string.h>

enum { SETTINGS_SIZE = 2048 };

// A bar would end a cell of the table.
void print_cell(const char *text, FILE *out)
{
    fputs(" ", out);
    for (; *text; text++) {
        if (*text == '|')
            fputc('\\', out);
        fputc(*text == '\n' || *text == '\r' ? ' ' : *text, out);
    }
    fputs(" |", out);
}

void print_labels(const sweep *sweep, const sweep_combination *run, FILE *out)
{
    char settings[SETTINGS_SIZE];
    sweep_settings_text(sweep, run->variant, settings, sizeof settings);
    fputs("|", out);
    print_cell(run->trace->label, out);
    print_cell(run->program->label, out);
    print_cell(run->variant->machine.name, out);
    print_cell(settings, out);
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

void print_figures(const sweep_row *row, FILE *out)
{
    fprintf(out, " %" PRId64 " | %" PRId64 " | %.3f |", row->stats[STAT_geometry_passes].count,
            row->stats[STAT_fragments_replayed].count, (double)row->stats[STAT_plane_bytes].count / 1e6);
    print_error(row, out);
}

void print_half_width(const sweep_row *row, int column, double unit, int decimals, FILE *out)
{
    const int half = sweep_half_width_of(column);
    if (half >= 0 && row->stats[half].known)
        fprintf(out, " ± %.*f", decimals, row->stats[half].real / unit);
}

static bool has_deeper(const sweep *sweep)
{
    for (int i = 0; i < sweep->file.detail_count; i++) {
        if (sweep->file.details[i].level != DETAIL_FUNCTION)
            return true;
    }
    return false;
}

// Of the levels below function.
static void print_deeper(const sweep_combination *run, const sweep_row *row, FILE *out)
{
    const sweep_value *read = &row->stats[SWEEP_STATISTICS_FROM + STAT_INDEX_memory_bytes_read];
    const sweep_value *written = &row->stats[SWEEP_STATISTICS_FROM + STAT_INDEX_memory_bytes_written];
    const sweep_value *cycles = &row->stats[STAT_drained_cycles], *bound = &row->stats[STAT_bound_by];
    print_cell(run->detail->name, out);
    if (read->known && written->known)
        fprintf(out, " %.3f", (double)(read->count + written->count) / 1e6);
    else
        fputs(" -", out);
    print_half_width(row, SWEEP_DERIVED_FROM + DERIVED_INDEX_memory_bytes, 1e6, 3, out);
    if (cycles->known)
        fprintf(out, " | %" PRId64, cycles->count);
    else
        fputs(" | -", out);
    print_half_width(row, STAT_drained_cycles, 1, 0, out);
    fputs(" |", out);
    print_cell(bound->known ? clock_resource_names[bound->count] : "-", out);
}

static void print_outcome(const sweep_row *row, FILE *out)
{
    char said[sizeof row->why + 16];
    if (row->outcome == OUTCOME_DONE) {
        print_cell(row->stats[STAT_iteration_limit_reached].count ? "limit of iterations" : "done", out);
        return;
    }
    snprintf(said, sizeof said, "%s: %s", sweep_outcome_names[row->outcome], row->why);
    print_cell(said, out);
}

status sweep_print(sweep *sweep, FILE *out)
{
    uint64_t absent = 0;
    const bool deeper = has_deeper(sweep);
    fprintf(out, LABELS_HEADING FIGURES_HEADING "%s outcome |\n" LABELS_RULE FIGURES_RULE "%s---|\n",
            deeper ? " detail | memory MB | drained cycles | bound by |" : "", deeper ? "---|---:|---:|---|" : "");
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
        if (deeper)
            print_deeper(&run, &row, out);
        print_outcome(&row, out);
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

static void write_value(column_kind kind, const sweep_value *value, FILE *file)
{
    switch (kind) {
    case COLUMN_COUNT: fprintf(file, "%" PRId64, value->count); break;
    case COLUMN_REAL: fprintf(file, "%.17g", value->real); break;
    case COLUMN_RESOURCE: write_text(file, clock_resource_names[value->count]); break;
    }
}

static void write_row(const sweep *sweep, const sweep_combination *run, const sweep_row *row, FILE *file)
{
    char settings[SETTINGS_SIZE];
    sweep_settings_text(sweep, run->variant, settings, sizeof settings);
    const char *texts[] = {ROPSIM_VERSION,
                           run->detail->name,
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
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++) {
        fputc(',', file);
        if (row->stats[i].known)
            write_value(sweep_column_kind(i), &row->stats[i], file);
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
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++)
        fprintf(file, ",%s", sweep_get_column(i).name);
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
