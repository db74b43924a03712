// Tags of one cache: make room, replace, forget.
#include "cache.h"

#include <stdlib.h>

bool cache_make(cache *c, uint64_t bytes, uint64_t line_bytes, uint64_t ways)
{
    const uint32_t sets = (uint32_t)(bytes / (line_bytes * ways));
    *c = (cache){.sets = sets, .ways = (uint32_t)ways, .set_mask = sets & (sets - 1) ? 0 : sets - 1};
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

cache_line *cache_victim(const cache *c, uint32_t set)
{
    cache_line *line = c->lines + (size_t)set * c->ways;
    uint64_t least = line->age;
    uint32_t oldest = 0;
    for (uint32_t way = 1; way < c->ways; way++) {  // two choices and no branch, which would be missed
        const uint64_t age = line[way].age;
        oldest = age < least ? way : oldest;
        least = age < least ? age : least;
    }
    return line + oldest;
}
