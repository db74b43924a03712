// Sampling: what stamps did to caches that nobody looked at.
//
// Stamps are run late, a block at a time, so what they touched comes here in no order. But each touch comes with its time, and so does each
// stamp that is looked at: a cache that keeps the lines used last keeps the same ones whatever the order in which it hears of them. Nothing
// is counted.
#include "memory.h"

// Uses of a cache within the time of one stamp, at most.
enum { USES_OF_STAMP = 1 << 16 };

static uint64_t age_at(uint64_t time)
{
    return time * USES_OF_STAMP;
}

void memory_at(memory *m, uint32_t tile, uint64_t time)
{
    cache *caches = m->caches[m->homes[tile].partition];
    m->latest = age_at(time + 1) - 1;
    for (int u = 0; u < ACCESS_UNITS; u++)
        caches[u].uses = caches[u].uses > age_at(time) ? caches[u].uses : age_at(time);
}

// As if it had been written back: the second level has it; to memory its size is that of its content, which is looked at when somebody asks.
static void written_back(memory *m, line_place at, uint64_t valid, uint64_t dirty)
{
    transfer spill;
    if (m->l2)
        write_line(m, at, valid, dirty, &m->ignored, &spill);
    else
        *state_of(m, at) = m->planes[at.plane].compressed ? STATE_UNKNOWN : STATE_WHOLE;
}

// The line in its cache, used at that age; NULL: it was not there, and all that its set has room for was used at `least` or later.
static cache_line *use_line(memory *m, access_unit unit, line_place at, uint64_t age, uint64_t least)
{
    cache *cache = &m->caches[m->homes[at.tile].partition][unit];
    uint32_t *slot = &m->slots[unit][line_number(m, at)];
    cache_line *line = cache_find(cache, *slot, line_id(at));
    if (!line) {
        line = cache_victim(cache, line_set(m, cache, at));
        if (line->age >= least)
            return NULL;
        if (line->id != CACHE_NONE && line->dirty)
            written_back(m, line_of(line->id), line->valid, line->dirty);
        *slot = cache_put(cache, line, line_id(at));
    }
    line->age = line->age > age ? line->age : age;
    return line;
}

static void warm_line(memory *m, const plane_access *access, line_place at, uint64_t all, uint64_t age)
{
    const uint64_t read = access->read & all, written = access->written & all;
    line_touch ignored = {0};
    cache_line *line = use_line(m, access->unit, at, age, age);
    if (line) {
        line->valid = complete_line(m, at, all, line->valid, read, written, &m->ignored, &ignored) | written;
        line->dirty |= written;
    } else if (written) {
        written_back(m, at, all, written);
    }
}

void memory_warm(memory *m, const stamp *stamp, const uint64_t *times)
{
    for (int i = 0; i < stamp->access_count; i++) {
        const plane_access *access = &stamp->accesses[i];
        line_place at = {access->plane, stamp->tile, 0};
        for (; at.part < m->planes[at.plane].parts; at.part++) {
            const uint64_t all = lanes_of(m, at);
            if ((access->read | access->written) & all)
                warm_line(m, access, at, all, age_at(times[i]));
        }
    }
}

// Of stamps that are passed over caches hear only what was written: too little to tell that a line outlived others of this pass, so it takes
// no place that this pass has used.
static void pass_over_line(memory *m, line_place at, uint64_t all, uint64_t written, uint64_t age)
{
    cache_line *line = use_line(m, m->planes[at.plane].unit, at, age, m->oldest_of_pass);
    if (!line) {
        written_back(m, at, all, written);
        return;
    }
    line->valid |= *state_of(m, at) == STATE_WHOLE ? written : all;  // what is compressed or cleared has been fetched whole
    line->dirty |= written;
}

void memory_pass_over(memory *m, uint32_t tile, uint32_t planes, uint64_t lanes, uint64_t time)
{
    for (; planes; planes &= planes - 1) {
        line_place at = {(uint8_t)__builtin_ctz(planes), tile, 0};
        for (; at.part < m->planes[at.plane].parts; at.part++) {
            const uint64_t all = lanes_of(m, at);
            if (lanes & all)
                pass_over_line(m, at, all, lanes & all, age_at(time));
        }
    }
}
