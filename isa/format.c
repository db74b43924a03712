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

// floor(depth * far_code + 1/2) in exact arithmetic. The product in double can round up to a tie from below; what it lost
// decides. Otherwise its rounding cannot cross the tie.
static uint32_t unorm_code(double depth, uint32_t far_code)
{
    const double scaled = depth * far_code, whole = (double)(int64_t)scaled, fraction = scaled - whole;
    const bool up = fraction > 0.5 || (fraction == 0.5 && fma(depth, far_code, -scaled) >= 0.0);
    return (uint32_t)whole + up;
}

uint32_t format_depth_to_code(format format, double depth, bool reversed)
{
    double device = reversed ? 1.0 - depth : depth;
    if (!(device > 0.0))  // also NaN and -0
        device = 0.0;
    if (device > 1.0)
        device = 1.0;
    const uint32_t far_code = format_far_code(format);
    // Non-negative floats order as their bits do, so a float's bits serve as its code.
    const uint32_t code = format == FORMAT_z32f ? float_bits((float)device) : unorm_code(device, far_code);
    return reversed ? far_code - code : code;
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
