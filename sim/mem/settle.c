// A lookup that did not find the whole line in; the line, with room made for it and what it needs fetched, out.
#include "memory.h"

static void count_miss(access_unit unit, statistics *s)
{
    s->texture_misses += unit == ACCESS_TEXTURE;
    s->depth_misses += unit == ACCESS_DEPTH;
    s->color_misses += unit == ACCESS_COLOR;
}

// For a line that was not there: whose place it takes.
static cache_line *make_room(memory *m, cache *cache, access_unit unit, line_place at, statistics *s, line_touch *touch)
{
    cache_line *line = cache_victim(cache, line_set(m, cache, at));
    touch->miss = true;
    touch->replaces = line->id != CACHE_NONE;
    if (touch->replaces && line->dirty) {
        write_line(m, line_of(line->id), line->valid, line->dirty, s, &touch->spill);
        s->depth_writebacks += unit == ACCESS_DEPTH;
        s->color_writebacks += unit == ACCESS_COLOR;
    }
    return line;
}

uint32_t settle_line(memory *m, const plane_access *access, uint64_t id, uint64_t lanes, cache *cache, uint32_t *slot, statistics *s, line_touch *touch)
{
    const line_place at = line_of(id);
    cache_line *line = cache_find(cache, *slot, id);
    if (!line) {
        line = make_room(m, cache, access->unit, at, s, touch);
        *slot = cache_put(cache, line, id);
    }
    line->valid = complete_line(m, at, lanes, line->valid, access->read & lanes, access->written & lanes, s, touch);
    if (touch->miss)
        count_miss(access->unit, s);
    return *slot;
}
