// Which stamps of a pass are looked at: its head, then windows at random places, one in each stratum.
//
// The head is as long as queues take to fill; the pass's last stamps are a lead, so that its drain is met with units and caches filled.
#include "arrival.h"

sampling sampling_default(void)
{
    return (sampling){.head = 256, .lead = 256, .window = 512, .period = 8192, .seed = 1};
}

// A random number below `below` from the seed, the pass and the stratum (splitmix64).
static uint64_t draw_place(const arrival *a, uint64_t below)
{
    uint64_t x = a->options.sampling->seed * UINT64_C(0x9e3779b97f4a7c15) + a->passes_begun * UINT64_C(0xbf58476d1ce4e5b9) +
                 a->plan_of_phases.window * UINT64_C(0x94d049bb133111eb);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return (x ^ x >> 31) % below;
}

// Strata share what lies behind the head evenly: two at least, since one window alone tells nothing of how windows differ.
static uint64_t strata(const arrival *a)
{
    const uint64_t count = (a->plan_of_phases.stamps - a->plan_of_phases.head) / a->options.sampling->period;
    return count > 2 ? count : 2;
}

static uint64_t stratum_start(const arrival *a, uint64_t number)
{
    const uint64_t middle = a->plan_of_phases.stamps - a->plan_of_phases.head;
    return a->plan_of_phases.head + middle / strata(a) * number + middle % strata(a) * number / strata(a);
}

static void place_window(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    const uint64_t start = stratum_start(a, p->window), end = stratum_start(a, p->window + 1ull);
    p->window_start = p->window < strata(a) ? start + draw_place(a, end - start - a->options.sampling->window + 1) : UINT64_MAX;
}

void phases_begin(arrival *a, uint64_t stamps)
{
    a->plan_of_phases = (phase_plan){.stamps = stamps, .in_head = true};
    a->passes_begun++;
}

void phases_fill(arrival *a, const stamp *stamp)
{
    a->plan_of_phases.filled_stamps += !stamp->hierarchical;
    a->plan_of_phases.filled_quads += stamp->hierarchical ? 0 : stamp->quads;
}

// The head ends when stamps came that fill all queues: until then the rasterizer runs ahead of units at a speed of its own.
static void end_head(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    const machine *m = a->machine;
    const sampling *s = a->options.sampling;
    const uint64_t parts = (uint64_t)m->partitions;
    if (p->whole || p->at < s->head || p->filled_quads < parts * (uint64_t)m->shader_queue ||
        p->filled_stamps < parts * (uint64_t)(m->raster_queue + m->depth_queue + m->color_queue))
        return;
    // Windows, their leads and the pass's end must be worth it; else the rest is measured, too.
    if (p->stamps < p->at + 4ull * (s->lead + s->window))
        return;
    p->in_head = false;
    p->head = p->at;
    place_window(a);
}

static stamp_phase phase_of(const arrival *a, uint64_t at)
{
    const phase_plan *p = &a->plan_of_phases;
    if (p->in_head)
        return PHASE_HEAD;
    if (p->window_start != UINT64_MAX && at >= p->window_start)
        return PHASE_MEASURE;
    const uint64_t next = p->window_start != UINT64_MAX ? p->window_start : p->stamps;
    return at + a->options.sampling->lead >= next ? PHASE_LEAD : PHASE_SKIP;
}

status phases_next(arrival *a, bool begins_primitive, stamp_phase *phase)
{
    phase_plan *p = &a->plan_of_phases;
    if (!a->options.sampling) {
        *phase = PHASE_HEAD;
        return STATUS_OK;
    }
    if (p->in_head)
        end_head(a);
    else if (p->window_start != UINT64_MAX && p->at == p->window_start + a->options.sampling->window) {
        p->window++;
        place_window(a);
    }
    *phase = phase_of(a, p->at++);
    const uint64_t begun = p->begun;
    p->begun += begins_primitive;
    const bool next_window = *phase == PHASE_MEASURE && p->window != p->window_told;
    if (p->told && *phase == p->phase && !next_window)
        return STATUS_OK;
    p->told = true;
    p->window_told = p->window;
    p->phase = *phase;
    return a->sink->phase(a->sink->user, *phase, p->window, begun);
}
