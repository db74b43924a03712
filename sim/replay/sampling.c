// Which stamps of a pass are looked at: its head, then windows at random places, one for each stratum.
//
// The head is as long as queues take to fill, and so are leads; the pass's last stamps are a lead, so that its drain is met with units
// and caches filled.
#include "arrival.h"

sampling sampling_default(void)
{
    return (sampling){.head = 256, .warm = 8192, .lead = 2048, .window = 512, .period = 8192, .lead_and_window = 3584, .seed = 1};
}

sampling sampling_of(uint64_t every, uint64_t window, uint64_t seed)
{
    sampling s = sampling_default();
    s.window = (uint32_t)window;
    s.period = (uint32_t)(window * every);
    s.seed = seed;
    return s;
}

// A random number below `below`, itself below 2^36, from the seed, the pass and the stratum (splitmix64). It is a part of `below`, not a
// remainder: machines whose heads differ by little have windows at nearly the same places, and can be compared.
static uint64_t draw_place(const arrival *a, uint64_t below)
{
    uint64_t x = a->options.sampling->seed * UINT64_C(0x9e3779b97f4a7c15) + a->passes_begun * UINT64_C(0xbf58476d1ce4e5b9) +
                 a->plan_of_phases.stratum * UINT64_C(0x94d049bb133111eb);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return ((x ^ x >> 31) >> 36) * below >> 28;
}

// Long passes have longer windows, so that leads weigh less; the part that is measured stays the same. Few windows miss what is rare,
// so windows that are long already grow only where twice as many are left.
static uint64_t window_length(const sampling *s, uint64_t behind)
{
    enum { STRATA = 8, LONG = 8, STRATA_OF_LONG = 16, LONGEST = 32 };
    const uint64_t every = s->period / s->window, least = s->window, most = LONG * least, longest = LONGEST * least;
    const uint64_t window = behind / (every * STRATA), longer = behind / (every * STRATA_OF_LONG);
    if (longer > most)
        return longer < longest ? longer : longest;
    return window < least ? least : window < most ? window : most;
}

static void cut(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    const sampling *s = a->options.sampling;
    const uint64_t behind = p->stamps - p->head, every = s->period / s->window;
    p->window = window_length(s, behind);
    p->strata = behind / (every * p->window);
    p->strata = p->strata > 2 ? p->strata : 2;  // one window alone tells nothing of how windows differ
}

// A window is drawn by its last stamp. Those places, shared evenly among strata, begin with the first stamp behind the head and end where of
// a window only the pass's last stamp is left: so windows reach into the strata before, and are cut off at the pass's ends, and no stamp is likelier
// to be measured than another. (Windows that lay in their strata would rarely have the stamps at strata's ends, and those can be special: where each
// stratum is a layer of a scene, it begins and ends at the layer's rim.)
static uint64_t stratum_start(const phase_plan *p, uint64_t number)
{
    const uint64_t places = p->stamps - p->head + p->window - 1;
    return p->head + places / p->strata * number + places % p->strata * number / p->strata;
}

// Room in all queues of units.
static uint64_t room_for_quads(const machine *m) { return (uint64_t)m->partitions * (uint64_t)m->shader_queue; }
static uint64_t room_for_stamps(const machine *m) { return (uint64_t)m->partitions * (uint64_t)(m->raster_queue + m->depth_queue + m->color_queue); }

enum { FILL_MOST = 4096 };  // stamps that fill queues, at most, unless half as many wait: where most are discarded these need not fill at all

// Stamps before windows of this length: as many as fill all queues, by those of the pass that were looked at so far. What waits for units at a
// window's start came to them since; of what a lead finds there, nothing is left. But which partition is behind the others takes longer to
// become what it would have been, so short windows, of which that is more, have longer leads; and where thousands wait, a lead is as long as
// these twice.
static uint64_t lead_length(const arrival *a, uint64_t window)
{
    const phase_plan *p = &a->plan_of_phases;
    const sampling *s = a->options.sampling;
    const uint64_t rest = window < s->lead_and_window ? s->lead_and_window - window : 0;
    const uint64_t least = rest > s->lead ? rest : s->lead, most = least < FILL_MOST ? FILL_MOST : least;
    if (2 * p->waiting > most)
        return 2 * p->waiting;
    const uint64_t quads = p->filled_quads ? room_for_quads(a->machine) * p->looked / p->filled_quads : most;
    const uint64_t stamps = p->filled_stamps ? room_for_stamps(a->machine) * p->looked / p->filled_stamps : most;
    const uint64_t length = quads > stamps ? quads : stamps;
    return length < least ? least : length < most ? length : most;
}

static void place_window(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    p->lead = lead_length(a, p->window);
    p->window_start = p->window_end = p->stamps;
    if (p->stratum == p->strata)
        return;
    const uint64_t from = stratum_start(p, p->stratum), end = from + draw_place(a, stratum_start(p, p->stratum + 1) - from) + 1;
    const uint64_t start = end < p->window ? 0 : end - p->window;
    p->window_start = start < p->at ? p->at : start;  // the head or the window before has those
    p->window_end = end < p->stamps ? end : p->stamps;
}

void phases_begin(arrival *a, uint64_t stamps)
{
    a->plan_of_phases = (phase_plan){.stamps = stamps, .phase = PHASE_HEAD, .until = UINT64_MAX};
    a->passes_begun++;
}

void phases_fill(arrival *a, const stamp *stamp)
{
    if (!a->options.sampling)
        return;
    a->plan_of_phases.looked++;
    a->plan_of_phases.filled_stamps += !stamp->hierarchical;
    a->plan_of_phases.filled_quads += stamp->hierarchical ? 0 : stamp->quads;
    for (int i = 0; i < stamp->access_count; i++)
        a->plan_of_phases.accesses[stamp->accesses[i].unit] += (stamp->accesses[i].read | stamp->accesses[i].written) != 0;
}

static uint64_t waiting_now(const arrival *a) { return a->sink->waiting ? a->sink->waiting(a->sink->user) : 0; }

static bool many_more(uint64_t waiting, uint64_t before)
{
    enum { FEW = 64 };
    return waiting > before + before / 10 + FEW;
}

// Whether as many stamps wait as a third of the head ago, or a tenth more. Queues that take stamps in not much slower than these come fill late.
static bool steady(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    if (p->at < p->steady_at)
        return p->steady;
    const uint64_t waiting = waiting_now(a);
    p->steady = p->steady_at && !many_more(waiting, p->waiting);
    p->waiting = waiting;
    p->steady_at = p->at + p->at / 2 + 1;
    return p->steady;
}

// Windows, their leads and the pass's end must be worth it: several windows, and a quarter of the stamps passed over. Else the rest is measured, too.
static bool worth(const arrival *a)
{
    const phase_plan *p = &a->plan_of_phases;
    const sampling *s = a->options.sampling;
    const uint64_t behind = p->stamps - p->at, window = window_length(s, behind);
    return behind >= 8 * (lead_length(a, s->window) + s->window) && 3 * (s->period / s->window) * window >= 4 * (lead_length(a, window) + window);
}

// The head ends when stamps came that fill all queues, and these stay as full as they are: until then the rasterizer runs ahead at a
// speed of its own.
static void end_head(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    const machine *m = a->machine;
    const sampling *s = a->options.sampling;
    const bool full = p->filled_quads >= room_for_quads(m) && p->filled_stamps >= room_for_stamps(m);
    if (p->whole || m->tile_based || p->at < s->head || (!full && p->at < FILL_MOST) || !steady(a) || !worth(a))
        return;
    p->head = p->until = p->at;
    cut(a);
    place_window(a);
}

// Where few stamps touch a cache, what it holds is older.
static uint64_t warm_length(const arrival *a)
{
    enum { LONGER = 4 };
    const phase_plan *p = &a->plan_of_phases;
    const uint64_t length = a->options.sampling->warm, textures = p->accesses[ACCESS_TEXTURE], rop = p->accesses[ACCESS_DEPTH] + p->accesses[ACCESS_COLOR];
    const uint64_t fewest = textures && textures < rop ? textures : rop;
    if (!fewest || fewest >= p->looked)
        return length;
    return fewest < p->looked / LONGER ? length * LONGER : length * p->looked / fewest;
}

// Whether more wait than ever in this pass, by a tenth, and more than a lead makes up for: queues that were not full when the head ended.
static bool deeper(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    const uint64_t waiting = waiting_now(a);
    if (2 * waiting <= p->lead || !many_more(waiting, p->waiting))
        return false;
    p->waiting = waiting;
    return true;
}

static void enter(phase_plan *p, stamp_phase phase, uint64_t until)
{
    p->phase = phase;
    p->until = until;
}

// The phase that begins with the next stamp, and where it ends. While queues become deeper no stamp is passed over.
static void next_phase(arrival *a)
{
    phase_plan *p = &a->plan_of_phases;
    p->deepens = (p->phase == PHASE_MEASURE || p->deepens) && deeper(a);
    if (p->phase == PHASE_MEASURE) {
        p->stratum++;
        place_window(a);
    }
    const uint64_t start = p->window_start, lead = p->deepens || start - p->at < p->lead ? p->at : start - p->lead;
    const uint64_t length = warm_length(a), warm = lead - p->at < length ? p->at : lead - length;
    if (p->at < warm)
        enter(p, PHASE_SKIP, warm);
    else if (p->at < lead)
        enter(p, PHASE_WARM, lead);
    else if (p->at == start)
        enter(p, PHASE_MEASURE, p->window_end);
    else if (p->deepens)
        enter(p, PHASE_FILL, start - p->at < p->lead ? start : p->at + p->lead);
    else
        enter(p, PHASE_LEAD, start);
}

status phases_next(arrival *a, bool begins_primitive, stamp_phase *phase)
{
    phase_plan *p = &a->plan_of_phases;
    status status = STATUS_OK;
    *phase = PHASE_HEAD;
    if (!a->options.sampling)
        return status;
    if (p->phase == PHASE_HEAD)
        end_head(a);
    if (p->at == p->until)
        next_phase(a);
    if (p->at == 0 || p->phase != p->told || p->stratum != p->told_stratum)
        status = a->sink->phase(a->sink->user, p->phase, p->begun);
    p->told = p->phase;
    p->told_stratum = p->stratum;
    p->at++;
    p->begun += begins_primitive;
    *phase = p->phase;
    return status;
}
