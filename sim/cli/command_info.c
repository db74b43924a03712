// `ropsim info`: what a trace holds, as text or as one JSON object.
#include "command.h"

#include <inttypes.h>
#include <jansson.h>
#include <sys/stat.h>

enum { ROW_JSON };
static const command_option options[] = {
    [ROW_JSON] = {"json", 0, NULL, "print one JSON object instead of text"},
    {0},
};

static double ratio(uint64_t part, uint64_t whole)
{
    return whole > 0 ? (double)part / (double)whole : 0.0;
}

static uint64_t file_size(const char *path)
{
    struct stat file;
    return stat(path, &file) == 0 ? (uint64_t)file.st_size : 0;
}

static void print_draws(const trace_info *info)
{
    printf("\n%-32s %-12s %12s %12s %14s\n", "draw", "class", "triangles", "vertices", "fragments");
    for (uint32_t d = 0; d < info->draw_count; d++) {
        const trace_draw *draw = &info->draws[d];
        printf("%-32s %-12s %12" PRIu64 " %12" PRIu64 " %14" PRIu64 "\n", draw->name, draw_class_names[draw->class],
               draw->triangles, draw->vertices, draw->fragments);
    }
}

// Bins of doubling width: 1, 2, 3-4, 5-8, ...
static void print_histogram(const trace_summary *summary)
{
    printf("  samples by fragments:     0: %" PRIu64 "\n", summary->histogram[0]);
    for (unsigned from = 1, to = 1; from < SUMMARY_BINS && from <= summary->deepest; from = to + 1, to *= 2) {
        uint64_t samples = 0;
        for (unsigned k = from; k <= to && k < SUMMARY_BINS; k++)
            samples += summary->histogram[k];
        char label[32];
        if (from == to)
            snprintf(label, sizeof label, "%u", from);
        else if (to < SUMMARY_BINS)
            snprintf(label, sizeof label, "%u-%u", from, to);
        else
            snprintf(label, sizeof label, "%u and more", from);
        printf("  %25s: %" PRIu64 " (%.1f %% of the covered)\n", label, samples,
               100 * ratio(samples, summary->covered_samples));
    }
}

static void print_text(const char *path, const trace_info *info, const trace_summary *summary)
{
    printf("%s\n  size                      %u x %u pixels, %u %s a pixel\n", path, info->width, info->height,
           info->samples, info->samples == 1 ? "sample" : "samples");
    printf("  background                %g %g %g %g\n", (double)info->background[0], (double)info->background[1],
           (double)info->background[2], (double)info->background[3]);
    printf("  depth                     %d bits%s, from %.9g to %.9g\n", info->depth_bits,
           info->reversed_depth ? ", reversed" : "", summary->depth_min, summary->depth_max);
    if (summary->depth_outside > 0)
        printf("  depths outside 0 to 1     %" PRIu64 " (the ROP clamps them)\n", summary->depth_outside);
    if (info->nonfinite)
        printf("  not finite                %" PRIu64 " fragments\n", summary->nonfinite);
    printf("  fragments                 %" PRIu64 ", %.2f bytes each in the file\n", info->fragment_count,
           ratio(file_size(path), info->fragment_count));
    printf("  hash                      %s\n", info->hash);
    print_draws(info);
    printf("\ntransparent and sorted fragments, by sample\n");
    printf("  fragments                 %" PRIu64 " at %" PRIu64 " of %" PRIu64 " samples\n", summary->fragments,
           summary->covered_samples, summary->samples);
    printf("  depth complexity          %.3f a covered sample, %" PRIu64 " at most\n",
           ratio(summary->fragments, summary->covered_samples), summary->deepest);
    print_histogram(summary);
    printf("  in front-to-back order    %.2f %% of %" PRIu64 " neighbours in arrival order (%" PRIu64
           " with equal depths)\n",
           summary->pairs ? 100 * ratio(summary->pairs_in_order, summary->pairs) : 100.0, summary->pairs,
           summary->pairs_tied);
    printf("  front-to-back runs        %.3f a covered sample, %" PRIu64 " at most\n",
           ratio(summary->runs, summary->covered_samples), summary->runs_most);
}

static json_t *json_draws(const trace_info *info)
{
    json_t *draws = json_array();
    for (uint32_t d = 0; d < info->draw_count; d++) {
        const trace_draw *draw = &info->draws[d];
        json_array_append_new(draws, json_pack("{s:s, s:s, s:I, s:I, s:I}", "name", draw->name, "class",
                                               draw_class_names[draw->class], "triangles", (json_int_t)draw->triangles,
                                               "vertices", (json_int_t)draw->vertices, "fragments",
                                               (json_int_t)draw->fragments));
    }
    return draws;
}

static json_t *json_samples(const trace_summary *summary)
{
    json_t *histogram = json_array();
    for (unsigned k = 0; k < SUMMARY_BINS && k <= summary->deepest; k++)
        json_array_append_new(histogram, json_integer((json_int_t)summary->histogram[k]));
    return json_pack("{s:I, s:I, s:I, s:f, s:I, s:o}", "fragments", (json_int_t)summary->fragments, "samples",
                     (json_int_t)summary->samples, "covered_samples", (json_int_t)summary->covered_samples, "mean",
                     ratio(summary->fragments, summary->covered_samples), "max", (json_int_t)summary->deepest,
                     "histogram", histogram);
}

static status print_json(const char *path, const trace_info *info, const trace_summary *summary)
{
    json_t *positions = json_array();
    for (uint32_t s = 0; s < info->samples; s++)
        json_array_append_new(positions,
                              json_pack("[i, i]", info->sample_positions[s][0], info->sample_positions[s][1]));
    uint64_t bytes = file_size(path);
    json_t *object = json_pack(
        "{s:s, s:s, s:s, s:I, s:I, s:I, s:o, s:[f, f, f, f], s:I, s:b, s:b}", "version", ROPSIM_VERSION, "trace", path,
        "trace_hash", info->hash, "width", (json_int_t)info->width, "height", (json_int_t)info->height, "samples",
        (json_int_t)info->samples, "sample_positions", positions, "background", (double)info->background[0],
        (double)info->background[1], (double)info->background[2], (double)info->background[3], "depth_bits",
        (json_int_t)info->depth_bits, "nonfinite", info->nonfinite, "reversed_depth", info->reversed_depth);
    json_t *more = json_pack(
        "{s:I, s:I, s:f, s:[f, f], s:I, s:I, s:o, s:o, s:{s:I, s:I, s:I, s:f, s:I, s:I}}", "fragments",
        (json_int_t)info->fragment_count, "file_bytes", (json_int_t)bytes, "bytes_per_fragment",
        ratio(bytes, info->fragment_count), "depth_range", summary->depth_min, summary->depth_max, "depths_outside",
        (json_int_t)summary->depth_outside, "nonfinite_fragments", (json_int_t)summary->nonfinite, "draws",
        json_draws(info), "depth_complexity", json_samples(summary), "sortedness", "pairs", (json_int_t)summary->pairs,
        "pairs_in_order", (json_int_t)summary->pairs_in_order, "pairs_tied", (json_int_t)summary->pairs_tied,
        "share_in_order", summary->pairs ? ratio(summary->pairs_in_order, summary->pairs) : 1.0, "runs",
        (json_int_t)summary->runs, "runs_max", (json_int_t)summary->runs_most);
    status result = STATUS_OK;
    if (!object || !more || json_object_update(object, more) != 0 || json_dumpf(object, stdout, JSON_INDENT(2)) != 0)
        result = report_error(&command_report, STATUS_IO, "%s: the figures cannot be put as JSON", path);
    putchar('\n');
    json_decref(object);
    json_decref(more);
    return result;
}

int command_info(int argc, char **argv)
{
    const char *path = NULL;
    bool json = false;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        switch (option) {
        case COMMAND_HELP: return STATUS_OK;
        case COMMAND_ERROR: return STATUS_USAGE;
        case ROW_JSON: json = true; break;
        default:
            if (path)
                return (int)command_usage("info", "one trace at a time");
            path = line.value;
        }
    }
    if (!path)
        return (int)command_usage("info", "no trace was named");
    trace *trace = NULL;
    trace_summary summary;
    status result = trace_open(path, &command_report, &trace);
    if (result == STATUS_OK)
        result = trace_summarize(trace, &command_report, &summary);
    if (result == STATUS_OK && json)
        result = print_json(path, trace_get_info(trace), &summary);
    else if (result == STATUS_OK)
        print_text(path, trace_get_info(trace), &summary);
    trace_close(trace);
    return (int)result;
}
