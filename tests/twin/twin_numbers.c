// The number formats once more, in double and one step at a time.
#include "twin.h"

#include <math.h>
#include <string.h>

float twin_float(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

uint32_t twin_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return isnan(value) ? 0x7fc00000u : bits;
}

uint32_t twin_far(format format)
{
    switch (format) {
    case FORMAT_z16: return 65535;
    case FORMAT_z24: return 16777215;
    default: return twin_bits(1.0f);
    }
}

// floor(depth * far + 1/2), in integers.
static uint32_t unorm_code(double depth, uint32_t far)
{
    __extension__ typedef unsigned __int128 wide;
    int exponent;
    const uint64_t mantissa = (uint64_t)ldexp(frexp(depth, &exponent), 53);
    const int shift = 53 - exponent;  // depth = mantissa / 2^shift
    return shift > 100 ? 0 : (uint32_t)(((wide)mantissa * far + ((wide)1 << (shift - 1))) >> shift);
}

// The device stores depth, or 1 - depth if it is reversed; a code counts from the near plane on either way.
uint32_t twin_depth_code(format format, double depth, bool reversed)
{
    double stored = reversed ? 1.0 - depth : depth;
    stored = fmin(fmax(stored, 0.0), 1.0);  // NaN to 0
    const uint32_t code =
        format == FORMAT_z32f ? twin_bits((float)(stored + 0.0)) : unorm_code(stored, twin_far(format));
    return reversed ? twin_far(format) - code : code;
}

float twin_code_depth(format format, uint32_t code, bool reversed)
{
    const uint32_t stored_code = reversed ? twin_far(format) - code : code;
    const double stored =
        format == FORMAT_z32f ? (double)twin_float(stored_code) : (double)stored_code / twin_far(format);
    return (float)(reversed ? 1.0 - stored : stored);
}

// Toward zero: the multiple of the last place that is not farther from zero.
static float round_half(float value)
{
    if (isnan(value))
        return copysignf(twin_float(0x7fc00000u), value);
    if (isinf(value))
        return value;
    if (fabsf(value) > 65504.0f)
        return copysignf(65504.0f, value);
    int exponent;
    frexp((double)value, &exponent);  // value = m 2^exponent, m from 1/2 to 1: 11 bits of m are kept
    const double unit = ldexp(1.0, exponent - 11 > -24 ? exponent - 11 : -24);
    return copysignf((float)(trunc((double)value / unit) * unit), value);
}

static float round_byte(float value)
{
    if (!(value > 0.0f))
        return 0.0f;
    const float byte = truncf(fminf(value, 1.0f) * 255.0f + 0.5f);
    return byte / 255.0f;
}

uint32_t twin_round(format format, uint32_t component)
{
    uint32_t bits = component;
    float value = twin_float(component);
    if (format == FORMAT_rgba32f)
        return component;
    value = format == FORMAT_rgba8 ? round_byte(value) : round_half(value);
    memcpy(&bits, &value, sizeof bits);
    return bits;
}
