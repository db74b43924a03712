// A trace in, the fragments that are to be ordered as columns in memory out: every pass of the ordering replays a part
// of them, and reading a file that often would cost more than the passes.
#include "order.h"

#include <stdlib.h>
#include <string.h>

// Of a fragment: here, in the chains of chains.c, in the bins of one pass. Of a sample: planes, colours and readback of
// the two passes that stand in memory together, and a chain's place.
enum { FRAGMENT_BYTES = 17 + 20 + 24, SAMPLE_BYTES = 48 + 52 + 12 };

static uint64_t count_fragments(const trace_info *info)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < info->draw_count; i++)
        count += info->draws[i].class == CLASS_OPAQUE ? 0 : info->draws[i].fragments;
    return count;
}

static status allocate(geometry *g, uint64_t capacity, const report *report)
{
    const size_t length = capacity ? (size_t)capacity : 1;
    g->x = malloc(length * sizeof *g->x);
    g->y = malloc(length * sizeof *g->y);
    g->sample = malloc(length * sizeof *g->sample);
    g->depth = malloc(length * sizeof *g->depth);
    g->id = malloc(length * sizeof *g->id);
    if (g->x && g->y && g->sample && g->depth && g->id)
        return STATUS_OK;
    return report_error(report, STATUS_IO, "out of memory: %llu fragments", (unsigned long long)capacity);
}

static status take_run(geometry *g, const fragments *run, uint64_t capacity, identity_map *map, const report *report)
{
    if (run->count > capacity - g->count)
        return report_error(report, STATUS_REFUSED, "the trace has more fragments than its draws say");
    memcpy(g->x + g->count, run->x, run->count * sizeof *g->x);
    memcpy(g->y + g->count, run->y, run->count * sizeof *g->y);
    memcpy(g->sample + g->count, run->sample, run->count * sizeof *g->sample);
    memcpy(g->depth + g->count, run->depth, run->count * sizeof *g->depth);
    for (uint32_t i = 0; i < run->count; i++)
        if (!identity_map_id(map, (identity){run->draw, run->primitive[i]}, &g->id[g->count + i]))
            return report_error(report, STATUS_IO, "out of memory: more than %u primitives", g->id_count);
    g->count += run->count;
    return STATUS_OK;
}

static status take_fragments(trace *trace, geometry *g, uint64_t capacity, const report *report)
{
    identity_map *map = identity_map_create();
    if (!map)
        return report_error(report, STATUS_IO, "out of memory");
    trace_select(trace, 0, 0, g->info->width, g->info->height);
    status status = trace_rewind(trace);
    for (fragments run; status == STATUS_OK && (status = trace_next(trace, &run)) == STATUS_OK && run.count;)
        if (g->info->draws[run.draw].class != CLASS_OPAQUE &&
            (status = take_run(g, &run, capacity, map, report)) != STATUS_OK)
            break;
    if (status == STATUS_OK)
        status = trace_rewind(trace);
    g->names = identity_map_take(map, &g->id_count);
    identity_map_destroy(map);
    return status;
}

status geometry_load(trace *trace, uint64_t memory_bytes, const report *report, geometry *g)
{
    memset(g, 0, sizeof *g);
    g->info = trace_get_info(trace);
    const uint64_t capacity = count_fragments(g->info);
    const uint64_t sample_bytes = SAMPLE_BYTES * geometry_sample_count(g);
    if (sample_bytes > memory_bytes || capacity > (memory_bytes - sample_bytes) / FRAGMENT_BYTES)
        return report_error(
            report, STATUS_REFUSED,
            "ordering %llu fragments at %llu samples needs %d and %d bytes for each; the budget is %llu MiB",
            (unsigned long long)capacity, (unsigned long long)geometry_sample_count(g), FRAGMENT_BYTES, SAMPLE_BYTES,
            (unsigned long long)(memory_bytes >> 20));
    status status = allocate(g, capacity, report);
    if (status == STATUS_OK)
        status = take_fragments(trace, g, capacity, report);
    if (status != STATUS_OK)
        geometry_free(g);
    return status;
}

void geometry_free(geometry *g)
{
    free(g->x);
    free(g->y);
    free(g->sample);
    free(g->depth);
    free(g->id);
    free(g->names);
    memset(g, 0, sizeof *g);
}
