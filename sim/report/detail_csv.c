// Statistics of the levels traffic and cycle as CSV (RFC 4180): one header line, then a row for the total, each pass,
// each draw and each iteration.
//
// Every row has every column: sums over rows must choose a scope first. Units are in the glossary, not in a second
// header, so that any tool reads the file.
#include "../levels.h"

#include <inttypes.h>
#include <math.h>

typedef struct csv_row {
    const char *scope;
    uint64_t index;           // within its scope, from 0
    const pass_record *pass;  // NULL: columns of passes are empty
    const statistics *statistics;
} csv_row;

// Names of kernels and planes are identifiers, and all others are our own: none needs quotes.
static void write_header(const detail_result *detail, FILE *file)
{
    fputs("scope,index,number,kind,name,iteration", file);
    if (detail->level >= DETAIL_CYCLE) {
        fputs(",start,last_fragment,drained,bound_by", file);
        for (int i = 0; i < RESOURCE_COUNT; i++)
            fprintf(file, ",bound_%s", clock_resource_names[i]);
    }
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_rows[i].level <= detail->level)
            fprintf(file, ",%s", statistic_rows[i].name);
    }
    for (int i = 0; i < DERIVED_COUNT; i++) {
        if (derived_rows[i].level <= detail->level)
            fprintf(file, ",%s", derived_rows[i].name);
    }
    fputs("\r\n", file);
}

static void write_pass(const pass_record *pass, detail_level level, FILE *file)
{
    if (pass)
        fprintf(file, ",%" PRIu64 ",%s,%s,%" PRIu64, pass->info.number, pass_kind_names[pass->info.kind],
                pass->info.name, pass->info.iteration);
    else
        fputs(",,,,", file);
    if (level < DETAIL_CYCLE)
        return;
    if (pass)
        fprintf(file, ",%" PRIu64 ",%" PRIu64 ",%" PRIu64 ",%s", pass->start, pass->last_fragment, pass->drained,
                clock_resource_names[pass->bound_by]);
    else
        fputs(",,,,", file);
    for (int i = 0; i < RESOURCE_COUNT; i++) {
        if (pass)
            fprintf(file, ",%" PRIu64, pass->bounds[i]);
        else
            fputc(',', file);
    }
}

static void write_row(const detail_result *detail, const csv_row *row, FILE *file)
{
    fprintf(file, "%s,%" PRIu64, row->scope, row->index);
    write_pass(row->pass, detail->level, file);
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_rows[i].level <= detail->level)
            fprintf(file, ",%" PRIu64, statistic_value(row->statistics, i));
    }
    for (int i = 0; i < DERIVED_COUNT; i++) {
        if (derived_rows[i].level > detail->level)
            continue;
        const double value = derived_value(i, row->statistics, &detail->machine);
        if (isfinite(value))
            fprintf(file, ",%.17g", value);
        else
            fputc(',', file);
    }
    fputs("\r\n", file);
}

// What the totals of a sampled run may be off by, in a row of its own.
static void write_half_widths(const detail_result *detail, FILE *file)
{
    fputs("half_width,0", file);
    write_pass(NULL, detail->level, file);
    for (int i = 0; i < STATISTIC_COUNT; i++)
        fprintf(file, ",%.17g", detail->half_widths[i]);
    for (int i = 0; i < DERIVED_COUNT; i++) {
        if (i == DERIVED_INDEX_memory_bytes)
            fprintf(file, ",%.17g", detail->memory_half_width);
        else
            fputc(',', file);
    }
    fputs("\r\n", file);
}

status detail_write_csv(const detail_result *detail, const char *path, const report *report)
{
    aside *aside;
    FILE *file;
    const status status = aside_open(path, report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    write_header(detail, file);
    write_row(detail, &(csv_row){"total", 0, NULL, &detail->total}, file);
    if (detail->level == DETAIL_SAMPLED)
        write_half_widths(detail, file);
    for (uint64_t i = 0; i < detail->pass_count; i++)
        write_row(detail, &(csv_row){"pass", i, &detail->passes[i], &detail->passes[i].statistics}, file);
    for (uint32_t i = 0; i < detail->draw_count; i++)
        write_row(detail, &(csv_row){"draw", i, NULL, &detail->draws[i]}, file);
    for (uint64_t i = 0; i < detail->iteration_count; i++)
        write_row(detail, &(csv_row){"iteration", i, NULL, &detail->iterations[i]}, file);
    return aside_finish(aside);
}
