// The levels traffic and cycle as a short table for people: bytes, time, what bounds it, what it waits for.
#include "detail_table.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

enum { BOUNDS_SHOWN = 3 };

static double derived(const detail_result *detail, int index)
{
    return derived_value(index, &detail->total, &detail->machine);
}

// "name 93.1 %", or a dash where nothing was asked.
static void print_share(FILE *out, const char *before, const char *name, double share)
{
    if (isfinite(share))
        fprintf(out, "%s%s %.1f %%", before, name, 100 * share);
    else
        fprintf(out, "%s%s -", before, name);
}

static void print_bytes(FILE *out, const char *before, uint64_t bytes, const char *after)
{
    if (bytes < 1000000)
        fprintf(out, "%s%" PRIu64 " bytes %s", before, bytes, after);
    else
        fprintf(out, "%s%.3f MB %s", before, (double)bytes / 1e6, after);
}

// "name 1234 ± 56 unit (0.5 %)": what a sampled run may be off by.
static void print_interval(FILE *out, const char *before, double value, double half_width, const char *unit)
{
    fprintf(out, "%s%.0f ± %.0f %s", before, value, half_width, unit);
    if (value > 0)
        fprintf(out, " (%.2f %%)", 100 * half_width / value);
}

static void print_sampling(const detail_result *detail, FILE *out)
{
    const double share = detail->stamps ? 100 * (double)detail->stamps_measured / (double)detail->stamps : 100;
    fprintf(out, "  sampled             %" PRIu64 " windows; %" PRIu64 " of %" PRIu64 " stamps measured (%.1f %%)\n", detail->windows,
            detail->stamps_measured, detail->stamps, share);
    print_interval(out, "  estimates           ", (double)detail->total.cycles, detail->half_widths[STAT_INDEX_cycles], "cycles");
    print_interval(out, ", ", derived(detail, DERIVED_INDEX_memory_bytes), detail->memory_half_width, "bytes");
    fputs("\n                      ± half widths of intervals of 95 % confidence; shares and rates have none\n", out);
}

static void print_memory(const detail_result *detail, FILE *out)
{
    const double bytes_per_fragment = derived(detail, DERIVED_INDEX_bytes_per_fragment);
    print_bytes(out, "  memory              ", detail->total.memory_bytes_read, "read");
    print_bytes(out, ", ", detail->total.memory_bytes_written, "written");
    if (isfinite(bytes_per_fragment))
        fprintf(out, ", %.2f bytes a fragment", bytes_per_fragment);
    fputs("\n  hit rates           ", out);
    print_share(out, "", "texture", derived(detail, DERIVED_INDEX_texture_hit_rate));
    print_share(out, ", ", "depth", derived(detail, DERIVED_INDEX_depth_hit_rate));
    print_share(out, ", ", "colour", derived(detail, DERIVED_INDEX_color_hit_rate));
    print_share(out, ", ", "second level", derived(detail, DERIVED_INDEX_l2_hit_rate));
    fputc('\n', out);
}

static void print_time(const detail_result *detail, FILE *out)
{
    const double samples = derived(detail, DERIVED_INDEX_samples_per_clock);
    const double rate = derived(detail, DERIVED_INDEX_memory_gb_per_s);
    fprintf(out, "  time                %" PRIu64 " cycles to the last fragment, %" PRIu64 " until all is drained\n",
            detail->cycles, detail->drained_cycles);
    fprintf(out,
            "                      %.4g ms at %" PRId64 " MHz; no less than %" PRIu64
            " cycles by what bounds each pass\n",
            (double)detail->drained_cycles / (1e3 * (double)detail->machine.core_mhz), detail->machine.core_mhz,
            detail->bound_cycles);
    fputs("  rates               ", out);
    if (isfinite(samples))
        fprintf(out, "%.3f samples a clock, ", samples);
    if (isfinite(rate))
        fprintf(out, "%.2f GB/s, ", rate);
    print_share(out, "", "memory busy", derived(detail, DERIVED_INDEX_memory_share));
    print_share(out, ", ", "row hits", derived(detail, DERIVED_INDEX_row_hit_rate));
    fputc('\n', out);
}

// The resources that bound most passes, with the passes' share of the time.
static void print_bounds(const detail_result *detail, FILE *out)
{
    uint64_t passes[RESOURCE_COUNT + 1] = {0}, cycles[RESOURCE_COUNT + 1] = {0}, all = 0;
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        const pass_record *pass = &detail->passes[i];
        passes[pass->bound_by]++;
        cycles[pass->bound_by] += pass->drained - pass->start;
        all += pass->drained - pass->start;
    }
    fputs("  bound by            ", out);
    for (int shown = 0; shown < BOUNDS_SHOWN; shown++) {
        int most = 0;
        for (int i = 1; i <= RESOURCE_COUNT; i++)
            most = passes[most] == 0 || (passes[i] > 0 && cycles[i] > cycles[most]) ? i : most;
        if (passes[most] == 0)
            break;
        fprintf(out, "%s%s in %" PRIu64 " %s (%.1f %% of the time)", shown > 0 ? ", " : "", clock_resource_names[most],
                passes[most], passes[most] == 1 ? "pass" : "passes",
                all > 0 ? 100 * (double)cycles[most] / (double)all : 0);
        passes[most] = 0;
    }
    fputc('\n', out);
}

// Each reason that draws give against an early test, and how many give it.
static void print_forbidden(const detail_result *detail, FILE *out)
{
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        const char *why = detail->passes[i].info.early_forbidden;
        uint64_t draws = 0;
        bool said = false;
        for (uint64_t k = 0; why && k < detail->pass_count; k++) {
            const char *other = detail->passes[k].info.early_forbidden;
            said |= other && k < i && strcmp(other, why) == 0;
            draws += other && strcmp(other, why) == 0;
        }
        if (why && !said)
            fprintf(out, "  no early depth      in %" PRIu64 " %s: %s\n", draws, draws == 1 ? "draw" : "draws", why);
    }
}

static void print_stalls(const detail_result *detail, FILE *out)
{
    fputs("\n  waited for                 cycles\n", out);
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_is_stall(i))
            fprintf(out, "  %-22s %10" PRIu64 "\n", statistic_rows[i].name, statistic_value(&detail->total, i));
    }
}

status detail_print(const detail_result *detail, FILE *out)
{
    fprintf(out, "\n%s on %s, %" PRIu64 " passes\n", detail_level_names[detail->level], detail->machine.name,
            detail->pass_count);
    if (detail->level == DETAIL_SAMPLED)
        print_sampling(detail, out);
    print_memory(detail, out);
    if (detail->level >= DETAIL_CYCLE) {
        print_time(detail, out);
        print_bounds(detail, out);
        print_forbidden(detail, out);
        print_stalls(detail, out);
    }
    detail_print_passes(detail, out);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
