// The glossary of statistics as Markdown, from the rows of stats.def: what docs/statistics.md shows.
#include "../levels.h"

static void print_rows(const statistic_row *rows, int count, FILE *out)
{
    fputs("| name | unit | from level | meaning |\n|---|---|---|---|\n", out);
    for (int i = 0; i < count; i++)
        fprintf(out, "| `%s` | %s | %s | %s |\n", rows[i].name, rows[i].unit, detail_level_names[rows[i].level],
                rows[i].meaning);
}

status statistics_print(FILE *out)
{
    fputs("Counts:\n\n", out);
    print_rows(statistic_rows, STATISTIC_COUNT, out);
    fputs("\nDerived from them:\n\n", out);
    print_rows(derived_rows, DERIVED_COUNT, out);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
