// Rows of `ropsim trade` in, Markdown out: a table of levels, and with several seeds one of how their intervals did.
#include "trade.h"

#include <inttypes.h>

static void print_quantity(const trade_row *row, const trade_figures *f, detail_level level, trade_quantity quantity)
{
    const bool known = level >= DETAIL_CYCLE || (level == DETAIL_TRAFFIC && quantity == TRADE_BYTES);
    if (!known)
        fputs(" – | – |", stdout);
    else if (level != DETAIL_SAMPLED)
        fputs(" 0 | 0 |", stdout);
    else
        printf(" %+.2f | %.2f%s |", trade_error(row, f, quantity), trade_half_width(row, f, quantity),
               trade_covers(row, f, quantity) ? "" : " (missed)");
}

static void print_rate(double rate, double of_cycle)
{
    printf(" %.3g | %.1f |", rate, of_cycle > 0 ? rate / of_cycle : 0);
}

static void print_level(const trade_row *row, detail_level level, const trade_figures *f)
{
    printf("| %s | %s | %s | %s |", row->trace, row->program, row->machine->name, detail_level_names[level]);
    print_rate(trade_rate(f), trade_rate(&row->levels[DETAIL_CYCLE]));
    if (level == DETAIL_FUNCTION)
        fputs(" – | – |", stdout);
    else
        print_rate(trade_rate_again(f), trade_rate_again(&row->levels[DETAIL_CYCLE]));
    printf(" %.0f |", f->peak_mib);
    print_quantity(row, f, level, TRADE_CYCLES);
    print_quantity(row, f, level, TRADE_BYTES);
    putchar('\n');
}

static void print_summary(const trade_row *row)
{
    printf("| %s | %s | %s | %d | %.1f |", row->trace, row->program, row->machine->name, row->seed_count,
           row->seeds[0].stamps ? 100 * (double)row->seeds[0].stamps_measured / (double)row->seeds[0].stamps : 100);
    for (int q = 0; q <= TRADE_BYTES; q++) {
        const trade_summary s = trade_summarize(row, (trade_quantity)q);
        printf(" %d | %+.2f | %.2f | %+.2f | %.2f |", s.covered, s.bias, s.mean, s.worst, s.half_width);
    }
    putchar('\n');
}

void trade_print(const trade_row *rows, int count)
{
    fputs("| trace | program | machine | level | visits a second | speed | once more | speed | MiB | error of cycles, % | ± % | error of bytes, % | ± % |\n"
          "|---|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n", stdout);
    for (int i = 0; i < count; i++) {
        const trade_figures sampled = trade_sampled(&rows[i]);
        for (int level = 0; level < DETAIL_SAMPLED; level++)
            print_level(&rows[i], (detail_level)level, &rows[i].levels[level]);
        print_level(&rows[i], DETAIL_SAMPLED, &sampled);
    }
    fputs("\nvisits: fragments replayed, a second of CPU time with reading and the function level's run in it; speed: against cycle; once more:\n"
          "visits a second of another run on the trace and program that finds both done, as in a sweep of machines; MiB: most that the level's\n"
          "process held; errors against cycle; ±: half width of the interval of 95 % confidence.\n", stdout);
    if (count == 0 || rows[0].seed_count < 2)
        return;
    fputs("\n| trace | program | machine | seeds | measured, % | cycles covered | bias, % | mean error, % | worst, % | ± % | bytes covered | "
          "bias, % | mean error, % | worst, % | ± % |\n"
          "|---|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n", stdout);
    for (int i = 0; i < count; i++)
        print_summary(&rows[i]);
}
