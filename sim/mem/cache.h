// A set-associative cache of tags, least recently used line replaced: which lanes of a line are there and which were changed.
// It holds no data; contents are the replay's.
//
// Nothing is searched for: whoever puts a line in keeps its slot, where the line is or has since been replaced. Its id tells.
#ifndef ROPSIM_CACHE_H
#define ROPSIM_CACHE_H

#include "../levels.h"

typedef struct cache_line {
    uint64_t id;            // CACHE_NONE: empty
    uint64_t valid, dirty;  // lanes of the block
    uint64_t age;           // of its last use, from 1; 0: empty
} cache_line;
#define CACHE_NONE UINT64_MAX

typedef struct cache {
    cache_line *lines;      // set * ways + way
    uint32_t sets, ways;
    uint32_t set_mask;      // sets - 1, if that is all that `number % sets` takes; else 0
    uint64_t uses;
} cache;

bool cache_make(cache *cache, uint64_t bytes, uint64_t line_bytes, uint64_t ways);  // false: out of memory
void cache_free(cache *cache);
// The line of that id, or NULL. `slot`: in which it was put last; any, if it never was.
static inline cache_line *cache_find(const cache *cache, uint32_t slot, uint64_t id)
{
    cache_line *line = &cache->lines[slot];
    return line->id == id ? line : NULL;
}
static inline void cache_use(cache *cache, cache_line *line) { line->age = ++cache->uses; }
// Of the line of that number.
static inline uint32_t cache_set(const cache *cache, uint32_t number) { return cache->set_mask ? number & cache->set_mask : number % cache->sets; }
// The line that makes room: an empty one, else the least recently used. It is not emptied.
cache_line *cache_victim(const cache *cache, uint32_t set);
// In its place: a line of that id, with no lanes yet, which is to be used at once. Its slot.
static inline uint32_t cache_put(const cache *cache, cache_line *victim, uint64_t id)
{
    *victim = (cache_line){.id = id};
    return (uint32_t)(victim - cache->lines);
}
// Forgets every line.
void cache_forget(cache *cache);

#endif
