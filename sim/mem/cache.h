// A set-associative cache of tags, least recently used line replaced: which lanes of a line are there and which were changed.
// It holds no data; contents are the replay's.
#ifndef ROPSIM_CACHE_H
#define ROPSIM_CACHE_H

#include "../levels.h"

typedef struct cache_line {
    uint64_t id;            // CACHE_NONE: empty
    uint64_t valid, dirty;  // lanes of the block
    uint64_t age;           // of its last use
} cache_line;
#define CACHE_NONE UINT64_MAX

typedef struct cache {
    cache_line *lines;      // set * ways + way
    uint32_t sets, ways;
    uint64_t uses;
} cache;

bool cache_make(cache *cache, uint64_t bytes, uint64_t line_bytes, uint64_t ways);  // false: out of memory
void cache_free(cache *cache);
// The line of that id in its set, or NULL.
cache_line *cache_find(cache *cache, uint32_t set, uint64_t id);
// The line that makes room: an empty one, else the least recently used. It is not emptied.
cache_line *cache_victim(cache *cache, uint32_t set);
static inline void cache_use(cache *cache, cache_line *line) { line->age = ++cache->uses; }
static inline uint32_t cache_slot(const cache *cache, const cache_line *line) { return (uint32_t)(line - cache->lines); }
// Forgets every line.
void cache_forget(cache *cache);

#endif
