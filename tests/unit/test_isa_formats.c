// Number formats against independent arithmetic: every code of the depth formats, every half, exact rational rounding.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../isa/isa.h"

#include <float.h>
#include <math.h>
#include <string.h>

static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static uint64_t random_next(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return *seed >> 16 ^ *seed << 24;
}

// ---- Depth -----------------------------------------------------------------------------------------------

// All codes come back, grow with distance, and end at depth 0 and 1. Checked by one flag: cmocka's asserts are slow.
static void expect_codes(format format, uint32_t step)
{
    const uint32_t far = format_far_code(format);
    assert_int_equal(format_depth_to_code(format, 0.0, false), 0);
    assert_int_equal(format_depth_to_code(format, 1.0, false), far);
    assert_int_equal(format_depth_to_code(format, 0.0, true), 0);
    assert_int_equal(format_depth_to_code(format, 1.0, true), far);
    for (int reversed = 0; reversed < 2; reversed++) {
        double last = -1;
        bool good = true;
        for (uint64_t code = 0; code <= far; code += step) {
            const double depth = format_code_to_depth(format, (uint32_t)code, reversed);
            // A reversed binary32 depth below 2^-29 is finer than what 1 - depth leaves in a double.
            const bool exact = !(reversed && format == FORMAT_z32f && code > far - 0x31000000u);
            good &= !exact || format_depth_to_code(format, depth, reversed) == code;
            good &= depth >= last;
            last = depth;
        }
        assert_true(good);
    }
}

static void test_depth_codes(void **state)
{
    (void)state;
    assert_int_equal(format_far_code(FORMAT_z16), 65535);
    assert_int_equal(format_far_code(FORMAT_z24), 16777215);
    assert_int_equal(format_far_code(FORMAT_z32f), 0x3f800000);
    expect_codes(FORMAT_z16, 1);
    expect_codes(FORMAT_z24, 1);
    expect_codes(FORMAT_z32f, 1021);
}

__extension__ typedef unsigned __int128 wide;

// floor(depth * far + 1/2) in integers: depth = mantissa * 2^-shift.
static uint32_t round_exactly(double depth, uint32_t far)
{
    int exponent;
    const double fraction = frexp(depth, &exponent);
    const uint64_t mantissa = (uint64_t)ldexp(fraction, 53);
    const int shift = 53 - exponent;
    if (shift > 120)
        return 0;
    const wide product = (wide)mantissa * far * 2 + ((wide)1 << shift);
    return (uint32_t)(product >> (shift + 1));
}

static void test_depth_rounding(void **state)
{
    (void)state;
    uint64_t seed = 1;
    const format formats[] = {FORMAT_z16, FORMAT_z24};
    for (int f = 0; f < 2; f++) {
        const uint32_t far = format_far_code(formats[f]);
        int wrong = 0, wrong_at_tie = 0;
        for (int i = 0; i < 2000000; i++) {
            const double depth = (double)(random_next(&seed) >> 11) * 0x1p-53;
            wrong += format_depth_to_code(formats[f], depth, false) != round_exactly(depth, far);
        }
        assert_int_equal(wrong, 0);
        // Beside a tie a double's product with `far` is rounded itself: a depth within 2^-53 of the tie may go up.
        for (uint32_t code = 0; code < far; code += 7) {
            const double tie = (code + 0.5) / far;
            for (int side = -2; side <= 2; side++) {
                double depth = tie;
                for (int step = 0; step < (side < 0 ? -side : side); step++)
                    depth = nextafter(depth, side < 0 ? 0 : 1);
                const uint32_t got = format_depth_to_code(formats[f], depth, false), exact = round_exactly(depth, far);
                wrong += got != exact && (got != exact + 1 || side < -1 || side > 0);
                wrong_at_tie += got != exact;
            }
        }
        assert_int_equal(wrong, 0);
        assert_true(wrong_at_tie < (int)(far / 7 + 1));
    }
}

// Many at once come out as one by one, however many there are: random depths, ties and their neighbours, beyond both ends.
static void test_depth_runs(void **state)
{
    (void)state;
    enum { COUNT = 67 };
    uint64_t seed = 2;
    const format formats[] = {FORMAT_z16, FORMAT_z24, FORMAT_z32f};
    int wrong = 0;
    for (int turn = 0; turn < 20000; turn++) {
        const format format = formats[turn % 3];
        const uint32_t far = format_far_code(format), count = (uint32_t)(random_next(&seed) % (COUNT + 1));
        const bool reversed = random_next(&seed) & 1;
        double depth[COUNT];
        uint32_t codes[COUNT];
        for (uint32_t i = 0; i < count; i++) {
            const double tie = ((double)(random_next(&seed) % far) + 0.5) / far;
            depth[i] = i % 4 == 0 ? tie : i % 4 == 1 ? nextafter(tie, 0.0) : (double)(random_next(&seed) >> 11) * 0x1.4p-53 - 0.125;
        }
        format_depths_to_codes(format, depth, count, reversed, codes);
        for (uint32_t i = 0; i < count; i++)
            wrong += codes[i] != format_depth_to_code(format, depth[i], reversed);
    }
    assert_int_equal(wrong, 0);
}

// Why depth is quantised in double: in float, a quarter of all 24-bit codes does not come back.
static void test_float_misrounds(void **state)
{
    (void)state;
    uint32_t misrounded = 0;
    for (uint32_t code = 0; code <= 16777215; code++) {
        const float depth = (float)((double)code / 16777215.0);
        misrounded += (uint32_t)(depth * 16777215.0f + 0.5f) != code;
    }
    assert_int_equal(misrounded, 4194304);
}

static void test_depth_specials(void **state)
{
    (void)state;
    const format formats[] = {FORMAT_z16, FORMAT_z24, FORMAT_z32f};
    for (int f = 0; f < 3; f++) {
        const uint32_t far = format_far_code(formats[f]);
        for (int reversed = 0; reversed < 2; reversed++) {
            assert_int_equal(format_depth_to_code(formats[f], -INFINITY, reversed), 0);
            assert_int_equal(format_depth_to_code(formats[f], -0.0, reversed), 0);
            assert_int_equal(format_depth_to_code(formats[f], -1e-300, reversed), 0);
            assert_int_equal(format_depth_to_code(formats[f], INFINITY, reversed), far);
            assert_int_equal(format_depth_to_code(formats[f], 1.5, reversed), far);
            // The device's depth becomes 0: nearest, or farthest where it is reversed.
            assert_int_equal(format_depth_to_code(formats[f], (double)NAN, reversed), reversed ? far : 0);
        }
    }
    // binary32 keeps denormals; reversed, it is fine at the far end.
    assert_int_equal(format_depth_to_code(FORMAT_z32f, 0x1p-149, false), 1);
    assert_int_equal(format_depth_to_code(FORMAT_z32f, 0x1p-151, false), 0);
    assert_int_equal(format_depth_to_code(FORMAT_z32f, 1.0 - 0x1p-53, true), 0x3f800000 - bits_of(0x1p-53f));
    assert_int_equal(format_depth_to_code(FORMAT_z32f, 1.0 - 0x1p-53, false), 0x3f800000);
}

// ---- Halves ----------------------------------------------------------------------------------------------

// A half's value from its fields, by definition.
static double half_value(uint32_t half)
{
    const int exponent = (int)(half >> 10 & 31), mantissa = (int)(half & 1023);
    const double magnitude = exponent == 0 ? ldexp(mantissa, -24) : ldexp(1024 + mantissa, exponent - 25);
    return half >> 15 ? -magnitude : magnitude;
}

static void test_half_to_float(void **state)
{
    (void)state;
    for (uint32_t half = 0; half < 65536; half++) {
        const float value = format_half_to_float((uint16_t)half);
        const bool special = (half >> 10 & 31) == 31;
        if (special && half & 1023)
            assert_true(isnan(value));
        else if (special)
            assert_true(isinf(value));
        else
            assert_true((double)value == half_value(half) && !signbit(value) == !(half >> 15));
        if (!(special && half & 1023))
            assert_int_equal(format_float_to_half_toward_zero(value), half);
    }
    assert_true(signbit(format_half_to_float(0xfc00)) && !signbit(format_half_to_float(0x7c00)));
}

// The largest finite half of at most |value|, by bisection over the patterns.
static uint32_t half_toward_zero(float value)
{
    uint32_t low = 0, high = 0x7bff;
    while (low < high) {
        const uint32_t middle = (low + high + 1) / 2;
        if (half_value(middle) <= fabs((double)value))
            low = middle;
        else
            high = middle - 1;
    }
    return low | (signbit(value) ? 0x8000 : 0);
}

static void test_float_to_half(void **state)
{
    (void)state;
    uint64_t seed = 5;
    int wrong = 0;
    for (int i = 0; i < 500000; i++) {
        // Random bits, or a half's neighbours.
        float value = float_of((uint32_t)random_next(&seed));
        if (i % 2)
            value = nextafterf(format_half_to_float((uint16_t)random_next(&seed)), i % 4 == 1 ? 1e9f : -1e9f);
        if (isnan(value) || isinf(value))
            continue;
        wrong += format_float_to_half_toward_zero(value) != half_toward_zero(value);
    }
    assert_int_equal(wrong, 0);
    assert_int_equal(format_float_to_half_toward_zero(FLT_MAX), 0x7bff);  // 65504: stays finite
    assert_int_equal(format_float_to_half_toward_zero(-65520.0f), 0xfbff);
    assert_int_equal(format_float_to_half_toward_zero(INFINITY), 0x7c00);
    assert_int_equal(format_float_to_half_toward_zero(-INFINITY), 0xfc00);
    assert_int_equal(format_float_to_half_toward_zero(NAN) & 0x7e00, 0x7e00);
    assert_int_equal(format_float_to_half_toward_zero(-0.0f), 0x8000);
    assert_int_equal(format_float_to_half_toward_zero(0x1p-25f), 0);
    assert_int_equal(format_float_to_half_toward_zero(FLT_TRUE_MIN), 0);
    assert_true(format_round_component(FORMAT_rgba16f, 2049.0f) == 2048.0f);  // where counting by ones stops
}

// ---- rgba8 -----------------------------------------------------------------------------------------------

static void test_rgba8(void **state)
{
    (void)state;
    for (int code = 0; code < 256; code++) {
        const float value = (float)code / 255.0f;
        assert_true(format_round_component(FORMAT_rgba8, value) == value);
    }
    // A float times 255 and 1/2 more is exact in double. The rule's own float arithmetic differs from that at the
    // floats next to some ties and nowhere else: at most one float a tie, one code too high.
    int beside_ties = 0, wrong = 0;
    for (int code = 0; code < 255; code++) {
        float value = (float)((code + 0.5) / 255.0);
        for (int i = 0; i < 200; i++)
            value = nextafterf(value, 0.0f);
        for (int i = 0; i < 400; i++, value = nextafterf(value, 2.0f)) {
            const uint32_t exact = (uint32_t)((double)value * 255.0 + 0.5);
            const uint32_t got = (uint32_t)lrintf(format_round_component(FORMAT_rgba8, value) * 255.0f);
            const double distance = fabs((double)value * 255.0 - (code + 0.5));
            beside_ties += got == exact + 1 && distance < 0x1p-17;
            wrong += got != exact && !(got == exact + 1 && distance < 0x1p-17);
        }
    }
    assert_int_equal(wrong, 0);
    assert_int_equal(beside_ties, 128);
    uint32_t different = 0;
    for (uint32_t i = 0; i < 1u << 24; i++) {
        const float value = (float)i * 0x1p-24f;
        const uint32_t exact = (uint32_t)((double)value * 255.0 + 0.5);
        different += (float)exact / 255.0f != format_round_component(FORMAT_rgba8, value);
    }
    assert_int_equal(different, 127);  // the same floats: all but one of them are multiples of 2^-24
    assert_true(format_round_component(FORMAT_rgba8, NAN) == 0.0f);
    assert_true(format_round_component(FORMAT_rgba8, -0.0f) == 0.0f);
    assert_true(format_round_component(FORMAT_rgba8, -INFINITY) == 0.0f);
    assert_true(format_round_component(FORMAT_rgba8, INFINITY) == 1.0f);
    assert_true(format_round_component(FORMAT_rgba8, 1.5f) == 1.0f);
    assert_true(format_round_component(FORMAT_rgba8, FLT_TRUE_MIN) == 0.0f);
}

static void test_rgba32f(void **state)
{
    (void)state;
    const uint32_t patterns[] = {0, 0x80000000, 1, 0x7f800000, 0xff800000, 0x7f7fffff, 0x3f800001};
    for (int i = 0; i < 7; i++)
        assert_int_equal(bits_of(format_round_component(FORMAT_rgba32f, float_of(patterns[i]))), patterns[i]);
    assert_true(isnan(format_round_component(FORMAT_rgba32f, NAN)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_depth_codes),     cmocka_unit_test(test_depth_rounding),
        cmocka_unit_test(test_depth_runs),      cmocka_unit_test(test_float_misrounds),
        cmocka_unit_test(test_depth_specials),
        cmocka_unit_test(test_half_to_float),   cmocka_unit_test(test_float_to_half),
        cmocka_unit_test(test_rgba8),           cmocka_unit_test(test_rgba32f),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
