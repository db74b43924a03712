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

static inline vu choose(vu mask, vu yes, vu no)
{
    return (mask & yes) | (~mask & no);
}

// One bit a lane from masks of all ones or zero.
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

// 64 lane masks from 64 bits.
static inline void expand_bits(uint32_t *masks, uint64_t bits)
{
    vu select_bit;
    for (int lane = 0; lane < LANES; lane++)
        select_bit[lane] = 1u << lane;
    for (int v = 0; v < TILE_LANES / LANES; v++) {
        const uint32_t group = (uint32_t)(bits >> (v * LANES) & ((1ull << LANES) - 1));
        const vu spread = (vu){0} + group;
        store(masks, v, (vu)((spread & select_bit) != 0));
    }
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
        clamped = (vf)choose((vu)(clamped > one), (vu)one, (vu)clamped);
        return __builtin_convertvector(__builtin_convertvector(clamped * 255.0f + 0.5f, vi), vf) / 255.0f;
    }
    // binary16, toward zero: cut the mantissa; denormal halves are multiples of 2^-24.
    const vu sign = bits & 0x80000000u, magnitude = bits & 0x7fffffffu;
    const vf small = __builtin_convertvector(__builtin_convertvector((vf)choose((vu)(magnitude < 0x38800000u), magnitude, (vu){0}) * 0x1p24f, vi), vf) * 0x1p-24f;
    vu kept = choose((vu)(magnitude < 0x38800000u), (vu)small, magnitude & ~0x1fffu);
    kept = choose((vu)(magnitude >= 0x47800000u), (vu){0} + 0x477fe000u, kept);
    kept = choose((vu)(magnitude == 0x7f800000u), (vu){0} + 0x7f800000u, kept);
    kept = choose((vu)(magnitude > 0x7f800000u), (vu){0} + 0x7fc00000u, kept);
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

// D3D11.3 17.6: a weight of zero still multiplies, so a NaN comes through; min and max drop a NaN.
static inline vf blend_channel(blend_equation equation, blend_factor source, blend_factor destination, const vf s[4],
                               const vf t[4], int channel)
{
    const vf a = s[channel], b = t[channel];
    switch (equation) {
    case EQUATION_add: return a * blend_weight(source, s, t, channel) + b * blend_weight(destination, s, t, channel);
    case EQUATION_subtract: return a * blend_weight(source, s, t, channel) - b * blend_weight(destination, s, t, channel);
    case EQUATION_reverse_subtract: return b * blend_weight(destination, s, t, channel) - a * blend_weight(source, s, t, channel);
    case EQUATION_min: return (vf)choose((vu)(a < b) | (vu)(b != b), (vu)a, (vu)b);
    case EQUATION_max: return (vf)choose((vu)(a > b) | (vu)(b != b), (vu)a, (vu)b);
    case BLEND_EQUATION_COUNT: break;
    }
    return a;
}
