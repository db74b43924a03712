// Contradictions between keys of a machine, which the bounds of each key alone cannot show. Every one is said, with
// what would be accepted.
//
// Not asked for: memory_t_rc >= memory_t_ras + memory_t_rp. Data sheets round the three apart, and a channel keeps all.
#include "levels.h"

typedef struct checker {
    const report *report;
    status status;
} checker;

static void want_multiple(checker *checker, const char *key, int64_t value, const char *of, int64_t unit)
{
    if (value % unit != 0)
        checker->status =
            report_error(checker->report, STATUS_REFUSED, "%s is %lld, but must be a multiple of %s, which is %lld",
                         key, (long long)value, of, (long long)unit);
}

static void check_lines(checker *checker, const machine *machine)
{
    // A block of 64 samples is cut into equal lines, each of whole samples.
    if ((machine->line_bytes & (machine->line_bytes - 1)) != 0)
        checker->status = report_error(checker->report, STATUS_REFUSED,
                                       "line_bytes is %lld, but must be a power of two: 16, 32, 64 and so on",
                                       (long long)machine->line_bytes);
    want_multiple(checker, "line_bytes", machine->line_bytes, "memory_burst_bytes", machine->memory_burst_bytes);
    // So that no line lies in two rows.
    want_multiple(checker, "memory_row_bytes", machine->memory_row_bytes, "line_bytes", machine->line_bytes);
}

status machine_check(const machine *machine, const report *report)
{
    checker checker = {.report = report, .status = STATUS_OK};
    const int64_t line = machine->line_bytes;
    check_lines(&checker, machine);
    want_multiple(&checker, "depth_cache_bytes", machine->depth_cache_bytes, "depth_cache_ways * line_bytes",
                  machine->depth_cache_ways * line);
    want_multiple(&checker, "color_cache_bytes", machine->color_cache_bytes, "color_cache_ways * line_bytes",
                  machine->color_cache_ways * line);
    want_multiple(&checker, "texture_cache_bytes", machine->texture_cache_bytes, "texture_cache_ways * line_bytes",
                  machine->texture_cache_ways * line);
    // 0, no second level, is a multiple of everything.
    want_multiple(&checker, "l2_bytes", machine->l2_bytes, "partitions * l2_ways * line_bytes",
                  machine->partitions * machine->l2_ways * line);
    want_multiple(&checker, "region_pixels", machine->region_pixels, "a block's side in pixels", 8);
    return checker.status;
}
