// Division by a number that stays the same: a multiplication by its reciprocal and at most one correction, exact for
// every 64-bit dividend. A request to a channel divides eight times; a division each would cost more than all the rest.
#ifndef ROPSIM_CLOCK_DIVISOR_H
#define ROPSIM_CLOCK_DIVISOR_H

#include <stdint.h>

typedef struct divisor {
    uint64_t value, reciprocal;  // reciprocal: (2^64 - 1) / value, rounded down
} divisor;

// value: at least 1.
static inline divisor divisor_of(uint64_t value)
{
    return (divisor){value, UINT64_MAX / value};
}

static inline uint64_t divide(uint64_t dividend, const divisor *by, uint64_t *remainder)
{
    __extension__ typedef unsigned __int128 wide;
    // The reciprocal falls short of 2^64 / value by at most 1, so this falls short of the quotient by less than one
    // before rounding: after it, by one at most.
    uint64_t quotient = (uint64_t)((wide)dividend * by->reciprocal >> 64);
    uint64_t rest = dividend - quotient * by->value;
    uint64_t short_by_one = rest >= by->value;
    *remainder = rest - (short_by_one ? by->value : 0);
    return quotient + short_by_one;
}

#endif
