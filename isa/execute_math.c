// Scalar operations that have no vector form. Own arithmetic instead of the C library's powf, whose last
// bit depends on the library's version and the processor.
#include "execute_math.h"
#include "float_bits.h"

#include <math.h>
#include <string.h>

static const uint32_t QUIET_NAN = 0x7fc00000u;  // the only one that arithmetic makes

// log2 of a finite x > 0, to about 1e-16 relative: x = 2^e m with m in [sqrt 1/2, sqrt 2), and the
// series of log((1 + t) / (1 - t)) with t = (m - 1) / (m + 1), |t| < 0.172.
static double log2_of(double x)
{
    int exponent;
    double m = frexp(x, &exponent);
    if (m < 0.70710678118654752440) {
        m *= 2.0;
        exponent--;
    }
    const double t = (m - 1.0) / (m + 1.0), t2 = t * t;
    double sum = 0.0;
    for (int k = 23; k >= 1; k -= 2)
        sum = sum * t2 + 1.0 / k;
    return exponent + 2.0 * t * sum * 1.44269504088896340736;
}

// 2 to the power y for |y| <= 1000: Taylor's series of exp on [-ln 2 / 2, ln 2 / 2].
static double exp2_of(double y)
{
    const double whole = floor(y + 0.5), x = (y - whole) * 0.69314718055994530942;
    double sum = 1.0;
    for (int k = 14; k >= 1; k--)
        sum = 1.0 + sum * x / k;
    return ldexp(sum, (int)whole);
}

uint32_t execute_fpow(uint32_t a, uint32_t b)
{
    const double x = (double)bits_float(a), y = (double)bits_float(b);
    if (y == 0.0 || x == 1.0)
        return float_bits(1.0f);
    if (isnan(x) || isnan(y) || x < 0.0)
        return QUIET_NAN;
    if (x == 0.0 || isinf(x) || isinf(y))
        return float_bits((x < 1.0) == (y > 0.0) ? 0.0f : INFINITY);
    double power = y * log2_of(x);
    power = power > 1000.0 ? 1000.0 : power < -1000.0 ? -1000.0 : power;
    return float_bits((float)exp2_of(power));
}

uint32_t execute_ftou(uint32_t a)
{
    const float value = bits_float(a);
    if (!(value > 0.0f))
        return 0;
    return value >= 4294967296.0f ? UINT32_MAX : (uint32_t)value;
}

uint32_t execute_utof(uint32_t a)
{
    return float_bits((float)a);
}

uint32_t execute_ztof(format format, uint32_t code, bool reversed)
{
    const float depth = (float)format_code_to_depth(format, code, reversed);
    return isnan(depth) ? QUIET_NAN : float_bits(depth);  // a z32f code may be any bits
}
