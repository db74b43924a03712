// Primitives without a layer in, who lies on a cycle and who only behind one out: the strongly connected components of
// "in front of" among them (Tarjan 1972), walked with a stack of its own, since a chain can be as long as there are
// primitives.
//
// Neighbours at a sample suffice: whoever is farther behind is reached through them. A primitive that is its own
// neighbour lies on a cycle of one: the stencil counts it twice, so that it is never seen alone.
#include "order.h"

#include <stdlib.h>
#include <string.h>

#define UNSEEN 0u

typedef struct search {
    uint64_t *start;  // of each id's targets
    uint32_t *targets;
    uint64_t *next;    // the target to follow next
    uint32_t *number;  // in order of discovery, from 1
    uint32_t *low;     // the least number that can be reached
    uint32_t *path;    // ids being followed
    uint32_t *open;    // ids whose component is not closed yet
    uint8_t *is_open;
    uint32_t count, path_count, open_count;
    order_place *places;
} search;

// Calls `take` for each pair of neighbours that have no layer, others between them left out.
static void each_edge(const geometry *g, const chains *chains, const uint32_t *layers, search *s,
                      void (*take)(search *, uint32_t from, uint32_t to))
{
    const uint64_t samples = geometry_sample_count(g);
    for (uint64_t sample = 0; sample < samples; sample++) {
        uint32_t last = LAYER_NONE;
        for (uint64_t i = chains->start[sample]; i < chains->start[sample + 1]; i++) {
            const uint32_t id = chains->ids[i];
            if (layers[id] != LAYER_NONE)
                continue;
            if (last != LAYER_NONE)
                take(s, last, id);
            last = id;
        }
    }
}

static void count_edge(search *s, uint32_t from, uint32_t to)
{
    (void)to;
    s->start[from + 1]++;
}

static void put_edge(search *s, uint32_t from, uint32_t to)
{
    s->targets[s->next[from]++] = to;
    if (from == to)
        s->places[from] = PLACE_CYCLE;
}

static void enter(search *s, uint32_t id)
{
    s->number[id] = s->low[id] = ++s->count;
    s->next[id] = s->start[id];
    s->path[s->path_count++] = s->open[s->open_count++] = id;
    s->is_open[id] = 1;
}

// The ids opened since `id` are its component.
static void close_component(search *s, uint32_t id)
{
    const bool alone = s->open[s->open_count - 1] == id;
    uint32_t member;
    do {
        member = s->open[--s->open_count];
        s->is_open[member] = 0;
        if (!alone)
            s->places[member] = PLACE_CYCLE;
    } while (member != id);
}

static void leave(search *s, uint32_t id)
{
    s->path_count--;
    if (s->low[id] == s->number[id])
        close_component(s, id);
    if (!s->path_count)
        return;
    const uint32_t parent = s->path[s->path_count - 1];
    s->low[parent] = s->low[id] < s->low[parent] ? s->low[id] : s->low[parent];
}

static void walk(search *s, uint32_t root)
{
    enter(s, root);
    while (s->path_count) {
        const uint32_t id = s->path[s->path_count - 1];
        if (s->next[id] == s->start[id + 1]) {
            leave(s, id);
            continue;
        }
        const uint32_t target = s->targets[s->next[id]++];
        if (s->number[target] == UNSEEN)
            enter(s, target);
        else if (s->is_open[target] && s->number[target] < s->low[id])
            s->low[id] = s->number[target];
    }
}

static bool allocate(search *s, uint32_t ids, uint64_t edges_most)
{
    const size_t length = (size_t)ids + 1;
    s->start = calloc(length + 1, sizeof *s->start);
    s->next = calloc(length, sizeof *s->next);
    s->targets = malloc((edges_most + 1) * sizeof *s->targets);
    s->number = calloc(length, sizeof *s->number);
    s->low = calloc(length, sizeof *s->low);
    s->path = malloc(length * sizeof *s->path);
    s->open = malloc(length * sizeof *s->open);
    s->is_open = calloc(length, 1);
    return s->start && s->next && s->targets && s->number && s->low && s->path && s->open && s->is_open;
}

static void release(search *s)
{
    free(s->start);
    free(s->next);
    free(s->targets);
    free(s->number);
    free(s->low);
    free(s->path);
    free(s->open);
    free(s->is_open);
}

status cycles_find(const geometry *g, const chains *chains, const uint32_t *layers, const report *report,
                   order_place *places)
{
    search s = {.places = places};
    const bool good = allocate(&s, g->id_count, g->count);
    if (good) {
        for (uint32_t i = 0; i < g->id_count; i++)
            places[i] = layers[i] == LAYER_NONE ? PLACE_BEHIND : PLACE_LAYER;
        each_edge(g, chains, layers, &s, count_edge);
        for (uint32_t i = 0; i < g->id_count; i++)
            s.start[i + 1] += s.start[i];
        memcpy(s.next, s.start, g->id_count * sizeof *s.next);
        each_edge(g, chains, layers, &s, put_edge);
        for (uint32_t i = 0; i < g->id_count; i++)
            if (layers[i] == LAYER_NONE && s.number[i] == UNSEEN)
                walk(&s, i);
    }
    release(&s);
    return good ? STATUS_OK : report_error(report, STATUS_IO, "out of memory: %u primitives", g->id_count);
}
