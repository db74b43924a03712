// Fragments in memory in, a trace of some primitives out: what the replay reads in a pass.
//
// One draw of class transparent: opaque draws are not part of the order, and a pass replays transparent and sorted ones
// alike.
#include "order.h"

#include <stdlib.h>
#include <string.h>

enum { RUN_MAX = 65536 };

struct subset {
    const geometry *geometry;
    const uint8_t *const *set;
    uint64_t at;
    trace_draw draw;
    trace *trace;
    uint16_t x[RUN_MAX], y[RUN_MAX];
    uint8_t sample[RUN_MAX];
    double depth[RUN_MAX];
    uint32_t id[RUN_MAX];
    float zero[RUN_MAX];  // the passes look at no colour
};

static status next(void *user, fragments *run)
{
    subset *s = user;
    const geometry *g = s->geometry;
    const uint8_t *set = *s->set;
    uint32_t count = 0;
    for (; s->at < g->count && count < RUN_MAX; s->at++) {
        if (!set[g->id[s->at]])
            continue;
        s->x[count] = g->x[s->at];
        s->y[count] = g->y[s->at];
        s->sample[count] = g->sample[s->at];
        s->depth[count] = g->depth[s->at];
        s->id[count++] = g->id[s->at];
    }
    *run = (fragments){.count = count,
                       .x = s->x,
                       .y = s->y,
                       .sample = s->sample,
                       .depth = s->depth,
                       .rgba = {s->zero, s->zero, s->zero, s->zero},
                       .primitive = s->id};
    return STATUS_OK;
}

static status start_again(void *user)
{
    subset *s = user;
    s->at = 0;
    return STATUS_OK;
}

status subset_open(const geometry *geometry, const uint8_t *const *set, const report *report, subset **subset)
{
    struct subset *s = *subset = calloc(1, sizeof *s);
    if (!s)
        return report_error(report, STATUS_IO, "out of memory");
    s->geometry = geometry;
    s->set = set;
    s->draw = (trace_draw){.name = "subset", .class = CLASS_TRANSPARENT, .fragments = geometry->count};
    trace_info info = *geometry->info;
    info.draws = &s->draw;
    info.draw_count = 1;
    info.fragment_count = geometry->count;
    const trace_source source = {next, start_again, s};
    const status status = trace_from_source(&info, &source, report, &s->trace);
    if (status != STATUS_OK) {
        free(s);
        *subset = NULL;
    }
    return status;
}

void subset_close(subset *subset)
{
    if (!subset)
        return;
    trace_close(subset->trace);
    free(subset);
}

trace *subset_trace(subset *subset)
{
    return subset->trace;
}
