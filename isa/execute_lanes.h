// Vector helpers of execute.c, included once for each vector width.

#if defined(__x86_64__)
#include <immintrin.h>
#endif

static inline vu load(const uint32_t *lanes, int v)
{
    return *(const vu *)(lanes + v * LANES);
}

static inline void store(uint32_t *lanes, int v, vu value)
{
    *(vu *)(lanes + v * LANES) = value;
}

// Lane masks of all ones or zero; the compiler turns them into blends.
static inline vu pick(vu mask, vu yes, vu no)
{
    return (mask & yes) | (~mask & no);
}

// Vector v of 64 lanes: `yes` where the lane's bit is set.
static inline vu choose(uint64_t lanes, int v, vu yes, vu no)
{
#if defined(__x86_64__) && EXECUTE_BYTES == 64
    return (vu)_mm512_mask_blend_epi32((__mmask16)(lanes >> (v * LANES)), (__m512i)no, (__m512i)yes);
#else
    vu bit;
    for (int lane = 0; lane < LANES; lane++)
        bit[lane] = 1u << lane;
    const vu spread = (vu){0} + (uint32_t)(lanes >> (v * LANES));
    return pick((vu)((spread & bit) == bit), yes, no);
#endif
}

// One bit a lane from a mask of all ones or zero.
static inline uint64_t mask_bits(vu mask)
{
#if defined(__x86_64__) && EXECUTE_BYTES == 64
    return (uint64_t)_mm512_movepi32_mask((__m512i)mask);
#elif defined(__x86_64__) && EXECUTE_BYTES == 32
    return (uint64_t)(unsigned)_mm256_movemask_ps((__m256)mask);
#elif defined(__x86_64__)
    return (uint64_t)(unsigned)_mm_movemask_ps((__m128)mask);
#else
    uint64_t bits = 0;
    for (int lane = 0; lane < LANES; lane++)
        bits |= (uint64_t)(mask[lane] & 1) << lane;
    return bits;
#endif
}

// Compares give a bit a lane. AVX-512 has them as one instruction, which the generic form does not reach.
#if defined(__x86_64__) && EXECUTE_BYTES == 64
#define LANES_COMPARE(NAME, OPERATOR, TYPE, INTRINSIC)                             \
    static inline uint64_t NAME(vu a, vu b) { return (uint64_t)(INTRINSIC); }
#else
#define LANES_COMPARE(NAME, OPERATOR, TYPE, INTRINSIC)                             \
    static inline uint64_t NAME(vu a, vu b) { return mask_bits((vu)((TYPE)a OPERATOR(TYPE) b)); }
#endif
LANES_COMPARE(lanes_eq, ==, vu, _mm512_cmpeq_epu32_mask((__m512i)a, (__m512i)b))
LANES_COMPARE(lanes_ne, !=, vu, _mm512_cmpneq_epu32_mask((__m512i)a, (__m512i)b))
LANES_COMPARE(lanes_lt, <, vu, _mm512_cmplt_epu32_mask((__m512i)a, (__m512i)b))
LANES_COMPARE(lanes_ge, >=, vu, _mm512_cmpge_epu32_mask((__m512i)a, (__m512i)b))
LANES_COMPARE(lanes_flt, <, vf, _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ))
LANES_COMPARE(lanes_fge, >=, vf, _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GE_OQ))

static inline vu lanes_min(vu a, vu b)
{
    return pick((vu)(a < b), a, b);
}

static inline vu lanes_max(vu a, vu b)
{
    return pick((vu)(a < b), b, a);
}

// A result that is NaN is the one quiet NaN. Which operand's NaN an addition hands on, and the sign of a new one,
// differ between processors and with the compiler's order of operands.
static inline vf canonical(vf value)
{
    const vu nan = (vu){0} + 0x7fc00000u;
#if defined(__x86_64__) && EXECUTE_BYTES == 64
    return (vf)_mm512_mask_mov_ps((__m512)nan, _mm512_cmp_ps_mask((__m512)value, (__m512)value, _CMP_ORD_Q), (__m512)value);
#else
    return (vf)pick((vu)(value == value), (vu)value, nan);
#endif
}

// What a store in the format keeps of a colour component; the vector twin of format_round_component.
static inline vf round_component(format format, vf value)
{
    if (format == FORMAT_rgba32f)
        return value;
    const vu bits = (vu)value;
    if (format == FORMAT_rgba8) {
        const vf zero = {0}, one = zero + 1.0f;
        vf clamped = (vf)(bits & (vu)(value > zero));
        clamped = (vf)pick((vu)(clamped > one), (vu)one, (vu)clamped);
        return __builtin_convertvector(__builtin_convertvector(clamped * 255.0f + 0.5f, vi), vf) / 255.0f;
    }
    // binary16, toward zero: cut the mantissa; denormal halves are multiples of 2^-24.
    const vu sign = bits & 0x80000000u, magnitude = bits & 0x7fffffffu;
    const vf small = __builtin_convertvector(__builtin_convertvector((vf)pick((vu)(magnitude < 0x38800000u), magnitude, (vu){0}) * 0x1p24f, vi), vf) * 0x1p-24f;
    vu kept = pick((vu)(magnitude < 0x38800000u), (vu)small, magnitude & ~0x1fffu);
    kept = pick((vu)(magnitude >= 0x47800000u), (vu){0} + 0x477fe000u, kept);
    kept = pick((vu)(magnitude == 0x7f800000u), (vu){0} + 0x7f800000u, kept);
    kept = pick((vu)(magnitude > 0x7f800000u), (vu){0} + 0x7fc00000u, kept);
    return (vf)(kept | sign);
}

static inline vf blend_weight(blend_factor factor, const vf s[4], const vf t[4], int channel)
{
    const vf zero = {0};
    switch (factor) {
    case FACTOR_zero: return zero;
    case FACTOR_one: return zero + 1.0f;
    case FACTOR_src_color: return s[channel];
    case FACTOR_one_minus_src_color: return 1.0f - s[channel];
    case FACTOR_dst_color: return t[channel];
    case FACTOR_one_minus_dst_color: return 1.0f - t[channel];
    case FACTOR_src_alpha: return s[3];
    case FACTOR_one_minus_src_alpha: return 1.0f - s[3];
    case FACTOR_dst_alpha: return t[3];
    case FACTOR_one_minus_dst_alpha: return 1.0f - t[3];
    case BLEND_FACTOR_COUNT: break;
    }
    return zero;
}

// The blend of front-to-back compositing, by far the most frequent: what blend_channel computes for
// rgb add dst_alpha one, alpha add zero one_minus_src_alpha, without asking for each factor.
static inline void blend_under(const vf s[4], const vf t[4], vf out[4])
{
    for (int channel = 0; channel < 3; channel++)
        out[channel] = canonical(s[channel] * t[3] + t[channel] * 1.0f);
    out[3] = canonical(s[3] * 0.0f + t[3] * (1.0f - s[3]));
}

// D3D11.3 17.6: a weight of zero still multiplies, so a NaN comes through; min and max drop a NaN.
static inline vf blend_channel(blend_equation equation, blend_factor source, blend_factor destination, const vf s[4],
                               const vf t[4], int channel)
{
    const vf a = s[channel], b = t[channel];
    switch (equation) {
    case EQUATION_add: return canonical(a * blend_weight(source, s, t, channel) + b * blend_weight(destination, s, t, channel));
    case EQUATION_subtract: return canonical(a * blend_weight(source, s, t, channel) - b * blend_weight(destination, s, t, channel));
    case EQUATION_reverse_subtract: return canonical(b * blend_weight(destination, s, t, channel) - a * blend_weight(source, s, t, channel));
    case EQUATION_min: return (vf)pick((vu)(a < b) | (vu)(b != b), (vu)a, (vu)b);
    case EQUATION_max: return (vf)pick((vu)(a > b) | (vu)(b != b), (vu)a, (vu)b);
    case BLEND_EQUATION_COUNT: break;
    }
    return a;
}
