// A trace and a sample's position in, its fragments in raster order out.
#include "history.h"

#include <stdlib.h>

static bool append(history *h, uint64_t *capacity, const fragments *run, uint32_t i)
{
    if (h->fragment_count == *capacity) {
        const uint64_t grown = *capacity ? 2 * *capacity : 64;
        sample_fragment *fragments = realloc(h->fragments, grown * sizeof *fragments);
        if (!fragments)
            return false;
        h->fragments = fragments;
        *capacity = grown;
    }
    h->fragments[h->fragment_count++] = (sample_fragment){
        run->draw,
        h->info->draws[run->draw].class,
        {run->depth[i], {run->rgba[0][i], run->rgba[1][i], run->rgba[2][i], run->rgba[3][i]}, run->primitive[i]}};
    return true;
}

status fragments_gather(trace *trace, const report *report, history *h)
{
    uint64_t capacity = 0;
    trace_select(trace, h->x, h->y, h->x + 1, h->y + 1);
    status status = trace_rewind(trace);
    for (fragments run; status == STATUS_OK && (status = trace_next(trace, &run)) == STATUS_OK && run.count;)
        for (uint32_t i = 0; i < run.count; i++)
            if (run.x[i] == h->x && run.y[i] == h->y && run.sample[i] == h->sample && !append(h, &capacity, &run, i))
                return report_error(report, STATUS_IO, "out of memory: fragments of one sample");
    trace_select(trace, 0, 0, h->info->width, h->info->height);
    return status;
}
