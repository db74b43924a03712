// What happened at a sample, for who wonders about a failure: its fragments in raster order, and what each pass did to
// them. Long ones are cut: `ropsim history` tells all.
#include "rtest.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { FRAGMENTS_SHOWN = 24, LINES_SHOWN = 80 };

static bool is_there(const fragments *run, uint32_t i, uint32_t x, uint32_t y, int sample)
{
    return run->x[i] == x && run->y[i] == y && (sample < 0 || run->sample[i] == sample);
}

static void print_fragments(trace *trace, uint32_t x, uint32_t y, int sample, FILE *out)
{
    const trace_info *info = trace_get_info(trace);
    uint64_t count = 0;
    fragments run;
    status status = trace_rewind(trace);
    fprintf(out, "      fragments of pixel %u %u in raster order:\n", x, y);
    for (;;) {
        if (status == STATUS_OK)
            status = trace_next(trace, &run);
        if (status != STATUS_OK || run.count == 0)
            break;
        const trace_draw *draw = &info->draws[run.draw];
        for (uint32_t i = 0; i < run.count; i++) {
            if (!is_there(&run, i, x, y, sample) || count++ >= FRAGMENTS_SHOWN)
                continue;
            fprintf(out, "        %s %s  depth %.9g  rgba %.6g %.6g %.6g %.6g  primitive %" PRIu32, draw->name,
                    draw_class_names[draw->class], run.depth[i], (double)run.rgba[0][i], (double)run.rgba[1][i],
                    (double)run.rgba[2][i], (double)run.rgba[3][i], run.primitive[i]);
            if (info->samples > 1)
                fprintf(out, "  sample %d", run.sample[i]);
            fputc('\n', out);
        }
    }
    if (count == 0)
        fputs("        none\n", out);
    if (count > FRAGMENTS_SHOWN)
        fprintf(out, "        ... and %" PRIu64 " more\n", count - FRAGMENTS_SHOWN);
}

static void print_history(const rtest_scene *scene, const expectation *e, FILE *out)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return;
    history_options options = {.run = scene->options};
    if (e->moment.kind == MOMENT_PASS)
        options.pass = e->moment.number;
    if (e->moment.kind == MOMENT_ITERATION)
        options.iteration = e->moment.number;
    options.run.stop_after_pass = 0;
    const status status =
        history_print(scene->program, scene->machine, scene->trace, e->x, e->y, e->sample, &options, NULL, stream);
    fclose(stream);
    int lines = 0;
    for (const char *line = text; status == STATUS_OK && *line && lines < LINES_SHOWN; lines++) {
        const int length = (int)strcspn(line, "\n");
        fprintf(out, "%s%.*s\n", length ? "      " : "", length, line);
        line += length + (line[length] == '\n');
    }
    if (lines == LINES_SHOWN)
        fputs("      ... (`ropsim history` tells the rest)\n", out);
    free(text);
}

void rtest_print_sample(const rtest_scene *scene, const expectation *e, FILE *out)
{
    const bool whole_pixel = e->kind == EXPECT_pixel && !e->has_sample;
    print_fragments(scene->trace, e->x, e->y, whole_pixel ? -1 : (int)e->sample, out);
    print_history(scene, e, out);
}
