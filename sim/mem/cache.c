// Tags of one cache: find, replace, forget.
#include "cache.h"

#include <stdlib.h>

bool cache_make(cache *c, uint64_t bytes, uint64_t line_bytes, uint64_t ways)
{
    *c = (cache){.sets = (uint32_t)(bytes / (line_bytes * ways)), .ways = (uint32_t)ways};
    c->lines = malloc((size_t)c->sets * c->ways * sizeof *c->lines);
    if (c->lines)
        cache_forget(c);
    return c->lines;
}

void cache_free(cache *c)
{
    free(c->lines);
    c->lines = NULL;
}

void cache_forget(cache *c)
{
    for (size_t i = 0; i < (size_t)c->sets * c->ways; i++)
        c->lines[i] = (cache_line){.id = CACHE_NONE};
}

cache_line *cache_find(cache *c, uint32_t set, uint64_t id)
{
    cache_line *line = c->lines + (size_t)set * c->ways;
    for (uint32_t way = 0; way < c->ways; way++, line++)
        if (line->id == id)
            return line;
    return NULL;
}

cache_line *cache_victim(cache *c, uint32_t set)
{
    cache_line *line = c->lines + (size_t)set * c->ways, *oldest = line;
    for (uint32_t way = 0; way < c->ways; way++, line++) {
        if (line->id == CACHE_NONE)
            return line;
        if (line->age < oldest->age)
            oldest = line;
    }
    return oldest;
}
