// A float's 32 bits and back, and the one NaN that arithmetic gives.
#ifndef ROPSIM_FLOAT_BITS_H
#define ROPSIM_FLOAT_BITS_H

#include <math.h>
#include <stdint.h>
#include <string.h>

static inline uint32_t float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline float bits_float(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

// The value; of any NaN, the quiet one with nothing in it, so that bits do not depend on processor or compiler.
static inline float float_canonical(float value)
{
    return isnan(value) ? bits_float(0x7fc00000u) : value;
}

#endif
