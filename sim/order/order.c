// A trace and a machine in, the visibility order of its primitives out.
#include "order.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

static const uint64_t DEFAULT_MEMORY = 4ull << 30;

typedef struct run {
    trace *trace;
    const machine *machine;
    const order_options *options;
    const report *report;
    uint64_t memory_bytes;
    geometry geometry;
    passes passes;
    uint32_t *layers;     // by id
    order_place *places;  // by id
    order_result *result;
} run;

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

// Names who has no layer, by the depths that the machine compares, and checks the layers by those of the trace.
static status classify(run *r)
{
    chains chains;
    status status = chains_make(&r->geometry, r->machine->depth_format, r->report, &chains);
    if (status != STATUS_OK)
        return status;
    status = cycles_find(&r->geometry, &chains, r->layers, r->report, r->places);
    chains_free(&chains);
    if (status == STATUS_OK)
        status = chains_make(&r->geometry, FORMAT_COUNT, r->report, &chains);
    if (status != STATUS_OK)
        return status;
    chains_check(&r->geometry, &chains, r->layers, r->result);
    chains_free(&chains);
    return STATUS_OK;
}

static int compare_uint(uint32_t a, uint32_t b)
{
    return a < b ? -1 : a > b;
}

static int by_number(const void *a, const void *b)
{
    const order_primitive *x = a, *y = b;
    return compare_uint(x->primitive, y->primitive);
}

static int by_place(const void *a, const void *b)
{
    const order_primitive *x = a, *y = b;
    int order = compare_uint(x->place, y->place);
    order = order ? order : compare_uint(x->layer, y->layer);
    order = order ? order : compare_uint(x->draw, y->draw);
    return order ? order : compare_uint(x->primitive, y->primitive);
}

static status list_primitives(run *r)
{
    order_result *result = r->result;
    const geometry *g = &r->geometry;
    identity *missing = NULL;
    uint64_t missing_count;
    status status = nowhere_find(g, r->memory_bytes, r->report, &missing, &missing_count, &result->nowhere_unnamed);
    const uint64_t count = status == STATUS_OK ? g->id_count + missing_count : 0;
    result->primitives = malloc((count + 1) * sizeof *result->primitives);
    if (status == STATUS_OK && !result->primitives)
        status = report_error(r->report, STATUS_IO, "out of memory: %llu primitives", (unsigned long long)count);
    if (status == STATUS_OK) {
        result->primitive_count = count;
        for (uint64_t i = 0; i < count; i++) {
            const bool met = i < g->id_count;
            const identity name = met ? g->names[i] : missing[i - g->id_count];
            const order_place place = met ? r->places[i] : PLACE_NOWHERE;
            const uint32_t layer = place == PLACE_LAYER ? r->layers[i] : 0;
            result->primitives[i] = (order_primitive){name.draw, name.primitive, place, layer};
            result->place_counts[place]++;
        }
        qsort(result->primitives, count, sizeof *result->primitives, by_number);
        for (uint64_t i = 1; i < count; i++)
            result->several_draws |= result->primitives[i].primitive == result->primitives[i - 1].primitive;
        qsort(result->primitives, count, sizeof *result->primitives, by_place);
    }
    free(missing);
    return status;
}

static void describe(const run *r)
{
    order_result *result = r->result;
    const trace_info *info = r->geometry.info;
    memcpy(result->machine, r->machine->name, NAME_SIZE);
    machine_hash(r->machine, result->machine_hash);
    memcpy(result->trace_hash, info->hash, sizeof result->trace_hash);
    result->width = info->width;
    result->height = info->height;
    result->samples = info->samples;
    result->block_pixels = r->options->block_pixels;
    result->printed = r->options->printed;
    result->fragments = r->geometry.count;
}

static status run_loaded(run *r)
{
    const size_t ids = (size_t)r->geometry.id_count + 1;
    r->layers = malloc(ids * sizeof *r->layers);
    r->places = malloc(ids * sizeof *r->places);
    if (!r->layers || !r->places)
        return report_error(r->report, STATUS_IO, "out of memory: %u primitives", r->geometry.id_count);
    describe(r);
    const double start = now();
    status status = layers_extract(&r->geometry, &r->passes, r->options, r->report, r->layers, r->result);
    r->result->wall_seconds = now() - start;
    if (status == STATUS_OK)
        status = classify(r);
    return status == STATUS_OK ? list_primitives(r) : status;
}

status order_run(trace *trace, const machine *machine, const order_options *options, const report *report,
                 order_result **result)
{
    *result = NULL;
    run r = {.trace = trace, .machine = machine, .options = options, .report = report};
    r.memory_bytes = options->memory_bytes ? options->memory_bytes : DEFAULT_MEMORY;
    status status = passes_load(machine, options->threads, report, &r.passes);
    if (status == STATUS_OK)
        status = geometry_load(trace, r.memory_bytes, report, &r.geometry);
    if (status == STATUS_OK && !(r.result = calloc(1, sizeof *r.result)))
        status = report_error(report, STATUS_IO, "out of memory");
    if (status == STATUS_OK)
        status = run_loaded(&r);
    free(r.layers);
    free(r.places);
    geometry_free(&r.geometry);
    passes_free(&r.passes);
    if (status == STATUS_OK)
        *result = r.result;
    else
        order_destroy(r.result);
    return status;
}

void order_destroy(order_result *result)
{
    if (!result)
        return;
    free(result->primitives);
    free(result);
}
