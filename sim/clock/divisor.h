// Division by a number that stays the same: a multiplication by its reciprocal and at most one correction, exact for
// every 64-bit dividend; by a power of two, as most are, a shift. A request to a channel divides eight times; a division each would
// cost more than all the rest.
#ifndef ROPSIM_CLOCK_DIVISOR_H
#define ROPSIM_CLOCK_DIVISOR_H

#include <stdint.h>

typedef struct divisor {
    uint64_t value, reciprocal;  // reciprocal: (2^64 - 1) / value, rounded down; 0: value is a power of two
    uint32_t shift;              // then: its logarithm
} divisor;

// value: at least 1.
static inline divisor divisor_of(uint64_t value)
{
    return (divisor){value, value & (value - 1) ? UINT64_MAX / value : 0, (uint32_t)__builtin_ctzll(value)};
}

static inline uint64_t divide(uint64_t dividend, const divisor *by, uint64_t *remainder)
{
    __extension__ typedef unsigned __int128 wide;
    if (!by->reciprocal) {
        *remainder = dividend & (by->value - 1);
        return dividend >> by->shift;
    }
    // The reciprocal falls short of 2^64 / value by at most 1, so this falls short of the quotient by less than one
    // before rounding: after it, by one at most.
    uint64_t quotient = (uint64_t)((wide)dividend * by->reciprocal >> 64);
    uint64_t rest = dividend - quotient * by->value;
    uint64_t short_by_one = rest >= by->value;
    *remainder = rest - (short_by_one ? by->value : 0);
    return quotient + short_by_one;
}

#endif
