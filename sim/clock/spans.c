// What units do and wait for, as slices of a timeline: two tracks a unit, its operations and its lookups. Slices of one kind that
// follow each other closely become one, so that a file stays small enough for a viewer.
#include "clock.h"

enum { SPAN_GAP_CYCLES = 16 };

static void flush(const clock_state *c, const unit *u, bool lookups)
{
    const span *span = &u->spans[lookups];
    char track[NAME_SIZE];
    snprintf(track, sizeof track, "partition %d %s%s", u->partition, unit_names[u->kind], lookups ? ", lookups" : "");
    if (span->end > span->start)
        timeline_slice(c->timeline, track, span->name, span->start, span->end);
}

void spans_note(const clock_state *c, unit *u, bool lookups, const char *name, uint64_t start, uint64_t end)
{
    span *span = &u->spans[lookups];
    start = start < span->end ? span->end : start;  // a track's slices do not overlap
    if (end <= start)
        return;
    if (span->name == name && start <= span->end + SPAN_GAP_CYCLES) {
        span->end = end;
        return;
    }
    flush(c, u, lookups);
    *span = (struct span){name, start, end};
}

void spans_end(const clock_state *c, unit *u)
{
    for (int lookups = 0; c->timeline && lookups < 2; lookups++) {
        flush(c, u, lookups);
        u->spans[lookups].start = u->spans[lookups].end;
    }
}
