// Seeded random numbers: SplitMix64 (Steele, Lea and Flood, 2014), the same on every machine.
#include "raster.h"

uint64_t random_next(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double random_unit(uint64_t *state)
{
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

// Draws again where the last, incomplete block of `bound` values was hit: every value is equally likely.
uint64_t random_below(uint64_t *state, uint64_t bound)
{
    uint64_t limit = UINT64_MAX - UINT64_MAX % bound;
    uint64_t value = random_next(state);
    while (value >= limit)
        value = random_next(state);
    return value % bound;
}
