// Number formats: a double depth or a float colour goes in, what a plane of that format keeps comes out.
//
// Depth is quantised in double arithmetic: in float, `d * 16777215 + 0.5f` misrounds a quarter of all
// 24-bit codes, since 0.5 is not representable above 2^23.
#include "float_bits.h"
#include "isa.h"

#include <math.h>

static const uint32_t FLOAT_ONE = 0x3f800000u;

uint32_t format_far_code(format format)
{
    return format == FORMAT_z32f ? FLOAT_ONE : (uint32_t)((1ull << format_table[format].bits) - 1);
}

// What the device stores, origin + direction * depth, which is exact: NaN and -0 become 0.
static double device_depth(double depth, double origin, double direction)
{
    const double device = origin + direction * depth, positive = device > 0.0 ? device : 0.0;
    return positive > 1.0 ? 1.0 : positive;
}

// floor(depth * far_code + 1/2) in exact arithmetic. The product in double can round up to a tie from below; what it lost
// decides. Otherwise it is farther from the tie than what it lost. The loss is exact: Veltkamp's halves of the depth have products
// without rounding. There is no branch and no call, so that loops over depths become vectors.
static uint32_t unorm_code(double depth, double far_code)
{
    const double scaled = depth * far_code, whole = (int32_t)scaled;
    const double split = depth * 0x8000001p0, high = split - (split - depth), low = depth - high;
    const double lost = (high * far_code - scaled) + low * far_code;
    return (uint32_t)(int32_t)(whole + (scaled - whole - 0.5 + lost >= 0.0 ? 1.0 : 0.0));
}

// Non-negative floats order as their bits do, so a float's bits serve as its code.
static uint32_t float_code(double depth)
{
    return float_bits((float)depth);
}

uint32_t format_depth_to_code(format format, double depth, bool reversed)
{
    uint32_t code;
    format_depths_to_codes(format, &depth, 1, reversed, &code);
    return code;
}

void format_depths_to_codes(format format, const double *depth, uint32_t count, bool reversed, uint32_t *codes)
{
    const uint32_t far_code = format_far_code(format);
    const double origin = reversed ? 1.0 : 0.0, direction = reversed ? -1.0 : 1.0;
    if (format == FORMAT_z32f)
        for (uint32_t i = 0; i < count; i++)
            codes[i] = float_code(device_depth(depth[i], origin, direction));
    else
        for (uint32_t i = 0; i < count; i++)
            codes[i] = unorm_code(device_depth(depth[i], origin, direction), far_code);
    for (uint32_t i = 0; reversed && i < count; i++)
        codes[i] = far_code - codes[i];
}

double format_code_to_depth(format format, uint32_t code, bool reversed)
{
    const uint32_t far_code = format_far_code(format);
    if (reversed)
        code = far_code - code;
    const double device = format == FORMAT_z32f ? (double)bits_float(code) : (double)code / far_code;
    return reversed ? 1.0 - device : device;
}

float format_half_to_float(uint16_t half)
{
    const uint32_t sign = (uint32_t)(half & 0x8000u) << 16, exponent = (half >> 10) & 31u, mantissa = half & 0x3ffu;
    if (exponent == 31)
        return bits_float(sign | 0x7f800000u | mantissa << 13);
    if (exponent == 0)  // zero and denormals: a multiple of 2^-24, exact in binary32
        return bits_float(sign | float_bits((float)mantissa * 0x1p-24f));
    return bits_float(sign | (exponent + 112) << 23 | mantissa << 13);
}

uint16_t format_float_to_half_toward_zero(float value)
{
    const uint32_t bits = float_bits(value), magnitude = bits & 0x7fffffffu;
    const uint16_t sign = (uint16_t)(bits >> 16 & 0x8000u);
    if (magnitude > 0x7f800000u)
        return sign | 0x7e00;
    if (magnitude == 0x7f800000u)
        return sign | 0x7c00;
    if (magnitude >= 0x47800000u)  // 65536 and above stay finite under rounding toward zero
        return sign | 0x7bff;
    if (magnitude < 0x38800000u)  // below 2^-14: denormal halves
        return sign | (uint16_t)(bits_float(magnitude) * 0x1p24f);
    return sign | (uint16_t)((magnitude >> 13) - (112u << 10));
}

float format_round_component(format format, float value)
{
    switch (format) {
    case FORMAT_rgba8: {
        const float clamped = !(value > 0.0f) ? 0.0f : value > 1.0f ? 1.0f : value;
        return (float)(uint32_t)(clamped * 255.0f + 0.5f) / 255.0f;
    }
    case FORMAT_rgba16f:
        return format_half_to_float(format_float_to_half_toward_zero(value));
    default:
        return value;
    }
}
