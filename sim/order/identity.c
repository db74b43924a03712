// (draw, primitive) in, dense ids out: open addressing over a table that doubles when it is half full.
#include "order.h"

#include <stdlib.h>

struct identity_map {
    identity *names;
    uint32_t count, capacity;  // of names
    uint32_t *slots;           // id + 1; 0: free
    uint64_t slot_mask;
    uint32_t last;  // fragments of one primitive come together
};

enum { SLOTS_FIRST = 1024 };

identity_map *identity_map_create(void)
{
    identity_map *map = calloc(1, sizeof *map);
    if (!map)
        return NULL;
    map->slots = calloc(SLOTS_FIRST, sizeof *map->slots);
    map->slot_mask = SLOTS_FIRST - 1;
    if (map->slots)
        return map;
    free(map);
    return NULL;
}

void identity_map_destroy(identity_map *map)
{
    if (!map)
        return;
    free(map->names);
    free(map->slots);
    free(map);
}

// The mix of SplitMix64: neighbours in number land far apart.
static uint64_t mix(identity identity)
{
    uint64_t z = ((uint64_t)identity.draw << 32 | identity.primitive) + 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static bool same(identity a, identity b)
{
    return a.draw == b.draw && a.primitive == b.primitive;
}

static uint32_t *find_slot(const identity_map *map, identity identity)
{
    uint64_t at = mix(identity) & map->slot_mask;
    while (map->slots[at] && !same(map->names[map->slots[at] - 1], identity))
        at = (at + 1) & map->slot_mask;
    return &map->slots[at];
}

static bool grow(identity_map *map)
{
    const uint32_t capacity = map->capacity ? 2 * map->capacity : SLOTS_FIRST / 2;
    const uint64_t slot_count = 2 * (uint64_t)capacity;
    identity *names = realloc(map->names, capacity * sizeof *names);
    if (names)
        map->names = names;
    uint32_t *slots = calloc(slot_count, sizeof *slots);
    if (!names || !slots) {
        free(slots);
        return false;
    }
    free(map->slots);
    map->slots = slots;
    map->slot_mask = slot_count - 1;
    map->capacity = capacity;
    for (uint32_t i = 0; i < map->count; i++)
        *find_slot(map, names[i]) = i + 1;
    return true;
}

bool identity_map_id(identity_map *map, identity identity, uint32_t *id)
{
    if (map->count && same(map->names[map->last], identity)) {
        *id = map->last;
        return true;
    }
    uint32_t *slot = find_slot(map, identity);
    if (!*slot) {
        if (map->count == map->capacity) {
            if (map->count > UINT32_MAX / 4 || !grow(map))
                return false;
            slot = find_slot(map, identity);
        }
        map->names[map->count++] = identity;
        *slot = map->count;
    }
    *id = map->last = *slot - 1;
    return true;
}

identity *identity_map_take(identity_map *map, uint32_t *count)
{
    identity *names = map->names;
    *count = map->count;
    map->names = NULL;
    map->count = map->capacity = 0;
    return names;
}
