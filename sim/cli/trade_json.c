// Rows of `ropsim trade` in, one JSON object out: all figures of every level and seed.
#include "command.h"
#include "trade.h"

#include <jansson.h>

static json_t *figures_object(const trade_row *row, const trade_figures *f, detail_level level)
{
    json_t *o = json_pack("{s:s, s:f, s:I, s:f, s:f}", "level", detail_level_names[level], "cpu_seconds", f->cpu_seconds,
                          "visits", (json_int_t)f->visits, "visits_per_second", trade_rate(f), "peak_mib", f->peak_mib);
    if (level >= DETAIL_TRAFFIC) {
        json_object_set_new(o, "again_cpu_seconds", json_real(f->again_seconds));
        json_object_set_new(o, "memory_bytes_read", json_integer((json_int_t)f->bytes_read));
        json_object_set_new(o, "memory_bytes_written", json_integer((json_int_t)f->bytes_written));
        json_object_set_new(o, "bytes_error_percent", json_real(trade_error(row, f, TRADE_BYTES)));
    }
    if (level >= DETAIL_CYCLE) {
        json_object_set_new(o, "cycles", json_integer((json_int_t)f->cycles));
        json_object_set_new(o, "cycles_error_percent", json_real(trade_error(row, f, TRADE_CYCLES)));
    }
    if (level == DETAIL_SAMPLED) {
        json_object_set_new(o, "cycles_half_width", json_real(f->half_cycles));
        json_object_set_new(o, "bytes_half_width", json_real(f->half_bytes));
        json_object_set_new(o, "cycles_covered", json_boolean(trade_covers(row, f, TRADE_CYCLES)));
        json_object_set_new(o, "bytes_covered", json_boolean(trade_covers(row, f, TRADE_BYTES)));
        json_object_set_new(o, "windows", json_integer((json_int_t)f->windows));
        json_object_set_new(o, "stamps", json_integer((json_int_t)f->stamps));
        json_object_set_new(o, "stamps_measured", json_integer((json_int_t)f->stamps_measured));
    }
    return o;
}

static json_t *summary_object(const trade_row *row, trade_quantity quantity)
{
    const trade_summary s = trade_summarize(row, quantity);
    return json_pack("{s:i, s:f, s:f, s:f, s:f}", "covered", s.covered, "bias_percent", s.bias, "mean_error_percent", s.mean,
                     "worst_error_percent", s.worst, "half_width_percent", s.half_width);
}

static json_t *row_object(const trade_row *row, const sampling *first)
{
    json_t *levels = json_array(), *seeds = json_array();
    for (int level = 0; level < DETAIL_SAMPLED; level++)
        json_array_append_new(levels, figures_object(row, &row->levels[level], (detail_level)level));
    for (int i = 0; i < row->seed_count; i++) {
        json_t *seed = figures_object(row, &row->seeds[i], DETAIL_SAMPLED);
        json_object_set_new(seed, "seed", json_integer((json_int_t)(first->seed + (uint64_t)i)));
        json_array_append_new(seeds, seed);
    }
    return json_pack("{s:s, s:s, s:s, s:o, s:o, s:o, s:o}", "trace", row->trace, "program", row->program, "machine",
                     row->machine->name, "levels", levels, "seeds", seeds, "cycles", summary_object(row, TRADE_CYCLES), "bytes",
                     summary_object(row, TRADE_BYTES));
}

status trade_write_json(const trade_row *rows, int count, const sampling *first, const char *path)
{
    aside *aside;
    FILE *file;
    const status status = aside_open(path, &command_report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    json_t *array = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(array, row_object(&rows[i], first));
    json_t *object = json_pack("{s:i, s:i, s:o}", "sample_window", (int)first->window, "sample_every",
                               (int)(first->period / first->window), "rows", array);
    const bool good = object && json_dumpf(object, file, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) == 0 && fputc('\n', file) != EOF;
    json_decref(object);
    if (good)
        return aside_finish(aside);
    aside_discard(aside);
    return report_error(&command_report, STATUS_IO, "%s cannot be written", path);
}
