// A trace's draws in, the primitives that have no fragment out: edge-on, outside the view, or between the samples.
//
// A trace holds fragments only. Who is missing can be told where a draw says how many triangles it has and they are
// numbered one after another, counted on through the draws, as the recorder does it (docs/record.md).
#include "order.h"

#include <stdlib.h>
#include <string.h>

typedef struct missing {
    const geometry *geometry;
    identity *names;
    uint64_t count, unnamed;
    uint64_t room;        // bytes
    uint32_t first, end;  // ids of the draw at hand: they come in order of draws
    uint64_t base;        // its first number
    uint64_t triangles;
} missing;

static bool numbered(const missing *m)
{
    for (uint32_t i = m->first; i < m->end; i++) {
        const uint32_t primitive = m->geometry->names[i].primitive;
        if (primitive < m->base || primitive - m->base >= m->triangles)
            return false;
    }
    return true;
}

static bool name_missing(missing *m, uint32_t draw, uint64_t count)
{
    uint8_t *seen = calloc(m->triangles, 1);
    identity *names = realloc(m->names, (m->count + count) * sizeof *names);
    if (names)
        m->names = names;
    if (!seen || !names) {
        free(seen);
        return false;
    }
    for (uint32_t i = m->first; i < m->end; i++)
        seen[m->geometry->names[i].primitive - m->base] = 1;
    for (uint64_t i = 0; i < m->triangles; i++)
        if (!seen[i])
            names[m->count++] = (identity){draw, (uint32_t)(m->base + i)};
    free(seen);
    return true;
}

static bool add_draw(missing *m, uint32_t draw)
{
    const uint64_t bytes_each = sizeof(identity) + sizeof(order_primitive) + 1, met = m->end - m->first;
    if (met >= m->triangles)
        return true;
    const uint64_t count = m->triangles - met;
    const bool fits = m->triangles <= m->room / bytes_each && m->base + m->triangles - 1 <= UINT32_MAX;
    if (!fits || !numbered(m)) {
        m->unnamed = count < INT64_MAX - m->unnamed ? m->unnamed + count : INT64_MAX;
        return true;
    }
    m->room -= m->triangles * bytes_each;
    return name_missing(m, draw, count);
}

status nowhere_find(const geometry *g, uint64_t memory_bytes, const report *report, identity **names, uint64_t *count,
                    uint64_t *unnamed)
{
    missing m = {.geometry = g, .room = memory_bytes};
    bool good = true;
    for (uint32_t d = 0; good && d < g->info->draw_count; d++) {
        m.triangles = g->info->draws[d].triangles;
        for (m.first = m.end; m.end < g->id_count && g->names[m.end].draw == d;)
            m.end++;
        if (g->info->draws[d].class != CLASS_OPAQUE && m.triangles)
            good = add_draw(&m, d);
        m.base = m.triangles < INT64_MAX - m.base ? m.base + m.triangles : INT64_MAX;
    }
    *names = m.names;
    *count = m.count;
    *unnamed = m.unnamed;
    return good ? STATUS_OK : report_error(report, STATUS_IO, "out of memory: primitives without a fragment");
}
