// The scalar operations against the C library in extended precision, and at their edges.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../isa/execute_math.h"

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

static float power(float a, float b)
{
    return float_of(execute_fpow(bits_of(a), bits_of(b)));
}

// Within one step of the nearest float.
static bool close_to(float got, long double exact)
{
    const float nearest = (float)exact;
    return got == nearest || nextafterf(got, INFINITY) == nearest || nextafterf(got, -INFINITY) == nearest;
}

static void expect_power(float a, float b)
{
    const float got = power(a, b);
    const long double exact = powl((long double)a, (long double)b);
    if (isnan(exact) ? !isnan(got) : !close_to(got, exact))
        fail_msg("%a to the power %a is %a, not %La", (double)a, (double)b, (double)got, exact);
}

static void test_fpow(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int i = 0; i < 300000; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        float a = float_of((uint32_t)(seed >> 33)), b = float_of((uint32_t)(seed >> 20));  // a is not negative
        if (i % 4 == 1) {  // what programs ask: (1 - alpha) to a count
            a = (float)(seed >> 40) * 0x1p-24f;
            b = (float)(seed >> 20 & 255);
        } else if (i % 4 == 2) {  // near 1, to a large power
            a = 1.0f + ((float)(seed >> 40) * 0x1p-24f - 0.5f) * 0x1p-10f;
            b = (float)(seed >> 20 & 0xffffff) - 0x1p23f;
        } else if (i % 4 == 3) {
            b = (float)(int)(seed >> 20 & 63) / 8.0f - 4.0f;
        }
        if (!isnan(a) && !isnan(b))
            expect_power(a, b);
    }
    static const float specials[] = {0.0f,           FLT_TRUE_MIN, FLT_MIN, 0.5f,    0x1.fffffep-1f, 1.0f,
                                     0x1.000002p+0f, 2.0f,         3.0f,    0x1p24f, FLT_MAX,        INFINITY};
    enum { SPECIALS = sizeof specials / sizeof specials[0] };
    for (int i = 0; i < SPECIALS; i++) {
        for (int j = 0; j < SPECIALS; j++) {
            expect_power(specials[i], specials[j]);
            expect_power(specials[i], -specials[j]);
        }
    }
    assert_true(power(0.0f, 0.0f) == 1.0f);
    assert_true(power(NAN, 0.0f) == 1.0f && power(1.0f, NAN) == 1.0f);  // as IEEE 754 pow
    assert_true(isnan(power(NAN, 1.0f)) && isnan(power(2.0f, NAN)));
    assert_true(isnan(power(-1.0f, 2.0f)) && isnan(power(-INFINITY, 1.0f)));  // defined for a >= 0 only
    assert_true(power(-0.0f, 2.0f) == 0.0f && power(-0.0f, -1.0f) == INFINITY);
}

static void test_ftou(void **state)
{
    (void)state;
    static const struct {
        float value;
        uint32_t integer;
    } cases[] = {{0.0f, 0},
                 {-0.0f, 0},
                 {0.999999f, 0},
                 {1.0f, 1},
                 {1.5f, 1},
                 {-1.0f, 0},
                 {-INFINITY, 0},
                 {INFINITY, UINT32_MAX},
                 {FLT_TRUE_MIN, 0},
                 {16777216.0f, 16777216},
                 {2147483648.0f, 2147483648u},
                 {4294967040.0f, 4294967040u},
                 {4294967296.0f, UINT32_MAX},
                 {FLT_MAX, UINT32_MAX},
                 {NAN, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(execute_ftou(bits_of(cases[i].value)), cases[i].integer);
    assert_int_equal(execute_ftou(0xffc00000u), 0);
}

static void test_utof(void **state)
{
    (void)state;
    static const struct {
        uint32_t integer;
        float value;
    } cases[] = {{0, 0.0f},
                 {1, 1.0f},
                 {16777215, 16777215.0f},
                 {16777217, 16777216.0f},
                 {16777219, 16777220.0f},
                 {2147483648u, 2147483648.0f},
                 {4294967167u, 4294967040.0f},
                 {4294967168u, 4294967296.0f},
                 {UINT32_MAX, 4294967296.0f}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_int_equal(execute_utof(cases[i].integer), bits_of(cases[i].value));
}

static void test_ztof(void **state)
{
    (void)state;
    for (int reversed = 0; reversed < 2; reversed++) {
        assert_int_equal(execute_ztof(FORMAT_z16, 0, reversed), bits_of(0.0f));
        assert_int_equal(execute_ztof(FORMAT_z16, 65535, reversed), bits_of(1.0f));
        assert_int_equal(execute_ztof(FORMAT_z24, 16777215, reversed), bits_of(1.0f));
        assert_int_equal(execute_ztof(FORMAT_z32f, 0x3f800000, reversed), bits_of(1.0f));
    }
    assert_int_equal(execute_ztof(FORMAT_z32f, bits_of(0.3f), false), bits_of(0.3f));
    assert_int_equal(execute_ztof(FORMAT_z24, 1, false), bits_of((float)(1.0 / 16777215.0)));
    assert_int_equal(execute_ztof(FORMAT_z24, 1, true), bits_of((float)(1.0 - 16777214.0 / 16777215.0)));
    for (uint32_t code = 1; code <= 65535; code++)
        assert_true(float_of(execute_ztof(FORMAT_z16, code, false)) >
                    float_of(execute_ztof(FORMAT_z16, code - 1, false)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fpow),
        cmocka_unit_test(test_ftou),
        cmocka_unit_test(test_utof),
        cmocka_unit_test(test_ztof),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
