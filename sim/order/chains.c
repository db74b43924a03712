// Fragments in, each sample's ids from front to back out; and whether layers keep to them. The layers themselves do not
// come from here: this names what they could not take, and holds them against the trace.
#include "order.h"

#include <stdlib.h>
#include <string.h>

typedef struct link {
    double key;
    uint32_t arrival, id;
} link;

static int front_first(const void *a, const void *b)
{
    const link *x = a, *y = b;
    if (x->key != y->key)
        return x->key < y->key ? -1 : 1;
    return x->arrival < y->arrival ? -1 : x->arrival > y->arrival;
}

// As the device compares: what lies outside is clamped first, NaN is the near plane.
static double depth_key(const geometry *g, format format, double depth)
{
    if (format != FORMAT_COUNT)
        return format_depth_to_code(format, depth, g->info->reversed_depth);
    return depth > 0 ? depth < 1 ? depth : 1 : 0;
}

static void place_links(const geometry *g, format format, const uint64_t *start, uint32_t *used, link *links)
{
    for (uint64_t i = 0; i < g->count; i++) {
        const uint64_t s = geometry_sample(g, i);
        const uint32_t arrival = used[s]++;
        links[start[s] + arrival] = (link){depth_key(g, format, g->depth[i]), arrival, g->id[i]};
    }
}

status chains_make(const geometry *g, format format, const report *report, chains *chains)
{
    const uint64_t samples = geometry_sample_count(g);
    chains->start = calloc(samples + 1, sizeof *chains->start);
    chains->ids = malloc((g->count + 1) * sizeof *chains->ids);
    uint32_t *used = calloc(samples, sizeof *used);
    link *links = malloc((g->count + 1) * sizeof *links);
    const bool good = chains->start && chains->ids && used && links;
    if (good) {
        for (uint64_t i = 0; i < g->count; i++)
            chains->start[geometry_sample(g, i) + 1]++;
        for (uint64_t s = 0; s < samples; s++)
            chains->start[s + 1] += chains->start[s];
        place_links(g, format, chains->start, used, links);
        for (uint64_t s = 0; s < samples; s++)
            if (used[s] > 1)
                qsort(links + chains->start[s], used[s], sizeof *links, front_first);
        for (uint64_t i = 0; i < g->count; i++)
            chains->ids[i] = links[i].id;
    } else {
        chains_free(chains);
    }
    free(used);
    free(links);
    return good ? STATUS_OK
                : report_error(report, STATUS_IO, "out of memory: chains of %llu fragments",
                               (unsigned long long)g->count);
}

void chains_free(chains *chains)
{
    free(chains->start);
    free(chains->ids);
    memset(chains, 0, sizeof *chains);
}

void chains_check(const geometry *g, const chains *chains, const uint32_t *layers, order_result *result)
{
    const uint64_t samples = geometry_sample_count(g);
    for (uint64_t s = 0; s < samples; s++) {
        for (uint64_t i = chains->start[s] + 1; i < chains->start[s + 1]; i++) {
            const uint32_t before = layers[chains->ids[i - 1]], behind = layers[chains->ids[i]];
            if (behind == LAYER_NONE)
                continue;
            result->pairs++;
            result->pairs_wrong += before == LAYER_NONE || before >= behind;
        }
    }
}
