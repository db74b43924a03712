// A part of a plane goes in; the scheme, its parameters and its size in bits and quarters come out. Compiled once for each vector
// width (COMPRESS_NAME).
//
// All differences are modulo 2^32, and a decoder's modulo 2^bits: a plane may leave the range of codes between lanes,
// a bad plane only makes wide differences, and no input is refused.
#include "compress.h"

#include <assert.h>
#include <string.h>

enum { TAG_BITS = 2, ROW = 8, FRACTION_BITS = 3 };

static int bit_length(uint32_t value)
{
    return value == 0 ? 0 : 32 - __builtin_clz(value);
}

// Takes the offer if it is smaller than what there is.
static void keep_smaller(compress_choice *best, const compress_choice *offer, int raw_bits)
{
    if (offer->size_bits >= best->size_bits || 4 * offer->size_bits > 3 * raw_bits)
        return;
    *best = *offer;
    best->quarters = (4 * offer->size_bits + raw_bits - 1) / raw_bits;
}

// ---- Codes of a channel --------------------------------------------------------------------------------

// A key is a signed integer that orders as the value does: a range around zero is a short range of keys, too. Signed,
// since SSE2 compares nothing else.
static int32_t float_key(uint32_t bits)
{
    return (int32_t)(bits ^ (uint32_t)((int32_t)bits >> 31) >> 1);
}

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

// The half that a binary32 value came from, without a branch. Denormal halves are multiples of 2^-24, the distance of
// neighbours at 0.5; so adding 0.5 leaves their code in the low bits. Masks and not conditions: a compiler may not move
// an addition of floats out of a condition, and the loop would be one of scalars.
static int32_t half_key(uint32_t bits)
{
    const int32_t magnitude = (int32_t)(bits & 0x7fffffffu), bias = 112 << 10;
    const int32_t denormal = (int32_t)bits_of(float_of((uint32_t)magnitude) + 0.5f) - 0x3f000000;
    const int32_t is_denormal = -(magnitude < 0x38800000), is_special = -(magnitude >= 0x47800000);
    const int32_t normal = (magnitude >> 13) - bias - (is_special & bias);  // infinities, NaN: exponents 255 and 31
    const int32_t half = (denormal & is_denormal) | (normal & ~is_denormal);
    return half ^ ((int32_t)bits >> 31);
}

// v * 255 is off its whole number by less than 2^-15. At 2^23 neighbours are 1 apart, so the sum is the rounded number.
static int32_t unorm8_key(uint32_t bits)
{
    return (int32_t)(bits_of(float_of(bits) * 255.0f + 0x1p23f) & 0xffu);
}

// The keys, in `keys` or, where words are such, where they are. One loop a format, so that each is a straight one over vectors.
static const int32_t *channel_keys(format format, const uint32_t *words, int count, int32_t *keys)
{
    switch (format) {
    case FORMAT_rgba8:
        for (int i = 0; i < count; i++)
            keys[i] = unorm8_key(words[i]);
        break;
    case FORMAT_rgba16f:
        for (int i = 0; i < count; i++)
            keys[i] = half_key(words[i]);
        break;
    case FORMAT_rgba32f:
    case FORMAT_f32:
        for (int i = 0; i < count; i++)
            keys[i] = float_key(words[i]);
        break;
    case FORMAT_u32:
        for (int i = 0; i < count; i++)
            keys[i] = (int32_t)(words[i] ^ 0x80000000u);
        break;
    default: return (const int32_t *)words;
    }
    return keys;
}

typedef struct range {
    int32_t low, high;
} range;

static int range_width(range range)
{
    return bit_length((uint32_t)range.high - (uint32_t)range.low);
}

static range keys_range(const int32_t *keys, int count)
{
    int32_t low = INT32_MAX, high = INT32_MIN;
    for (int i = 0; i < count; i++) {
        low = keys[i] < low ? keys[i] : low;
        high = keys[i] > high ? keys[i] : high;
    }
    return (range){low, high};
}

// Returns the range of keys of the last channel, for schemes of one channel.
static range try_bases(format format, int bits, const uint32_t *plane, int count, compress_choice *best)
{
    const int channels = format_table[format].class == FORMAT_CLASS_COLOR ? 4 : 1, channel_bits = bits / channels;
    compress_choice offer = {.scheme = COMPRESS_BASE, .size_bits = TAG_BITS};
    range range = {0, 0};
    for (int channel = 0; channel < channels; channel++) {
        int32_t keys[TILE_LANES];
        range = keys_range(channel_keys(format, plane + channel * TILE_LANES, count, keys), count);
        offer.base[channel] = (uint32_t)range.low ^ (format == FORMAT_u32 ? 0x80000000u : 0);
        offer.width[channel] = range_width(range);
        offer.size_bits += channel_bits + bit_length((uint32_t)channel_bits) + count * offer.width[channel];
    }
    keep_smaller(best, &offer, count * bits);
    return range;
}

// ---- Depth ---------------------------------------------------------------------------------------------

// Depth offset compression: what is in front of an edge is near the least code, what is behind it near the greatest.
static void try_two_bases(int bits, const uint32_t *codes, int count, range range, compress_choice *best)
{
    const uint32_t low = (uint32_t)range.low, high = (uint32_t)range.high;
    uint32_t all = 0;
    for (int i = 0; i < count; i++) {
        const uint32_t above = codes[i] - low, below = high - codes[i];
        all |= above < below ? above : below;
    }
    compress_choice offer = {.scheme = COMPRESS_TWO_BASES, .base = {low, high}, .width = {bit_length(all)}};
    offer.size_bits = TAG_BITS + 2 * bits + bit_length((uint32_t)bits) + count * (1 + offer.width[0]);
    keep_smaller(best, &offer, count * bits);
}

// Eighths of a code a lane, rounded to the nearest. A plane too steep for the stream's field is cut, and predicts
// badly. Divided as doubles, which is faster and the same: a quotient below 2^36 that is no whole number is further from the next
// one than it is rounded.
static int32_t step_between(uint32_t from, uint32_t to, int distance, int bits)
{
    const int64_t twice = (int64_t)(int32_t)(to - from) * (2 << FRACTION_BITS);
    const int64_t step = (int64_t)((double)(twice + (twice < 0 ? -distance : distance)) / (2 * distance));
    const int64_t limit = (int64_t)1 << (bits < 31 ? bits : 31);
    return (int32_t)(step < -limit ? -limit : step >= limit ? limit - 1 : step);
}

// A step from two lanes of `lanes` in one row, or in one column: the first pair at the first distance that has one.
// Neighbours know a plane of whole steps exactly; lanes far apart know a fraction of a step better.
static int32_t find_step(const uint32_t *codes, uint64_t lanes, bool columns, bool near, int bits)
{
    for (int i = 1; i < ROW; i++) {
        const int distance = near ? i : ROW - i, shift = columns ? distance * ROW : distance;
        const uint64_t starts = columns ? ~0ull : 0x0101010101010101ull * (0xffu >> distance);
        const uint64_t pairs = lanes & lanes >> shift & starts;
        if (pairs != 0) {
            const int lane = __builtin_ctzll(pairs);
            return step_between(codes[lane], codes[lane + shift], distance, bits);
        }
    }
    return 0;
}

// How far the plane has risen at each lane, rounded to whole codes.
static void plane_rise(int32_t step_x, int32_t step_y, uint32_t rise[TILE_LANES])
{
    uint32_t columns[ROW];
    for (uint32_t x = 0; x < ROW; x++)
        columns[x] = (uint32_t)step_x * x + (1u << (FRACTION_BITS - 1));
    for (uint32_t y = 0; y < TILE_LANES / ROW; y++) {
        for (uint32_t x = 0; x < ROW; x++)
            rise[y * ROW + x] = (uint32_t)((int32_t)(columns[x] + (uint32_t)step_y * y) >> FRACTION_BITS);
    }
}

typedef struct plane_steps {
    int32_t x, y;
} plane_steps;

static plane_steps find_steps(const uint32_t *codes, uint64_t lanes, bool near, int bits)
{
    return (plane_steps){find_step(codes, lanes, false, near, bits), find_step(codes, lanes, true, near, bits)};
}

// Offers the plane of these steps through `lanes`; the others have the code `fill`, if there are others.
static void try_plane(int bits, const uint32_t *codes, int count, uint64_t lanes, const uint32_t *fill, plane_steps steps,
                      compress_choice *best)
{
    compress_choice offer = {.scheme = fill == NULL ? COMPRESS_PLANE : COMPRESS_PLANE_FILL, .step_x = steps.x, .step_y = steps.y};
    uint32_t rise[TILE_LANES];
    plane_rise(offer.step_x, offer.step_y, rise);

    // Differences from the plane through the first of the lanes; the plane is then lowered until none is negative.
    const int first = __builtin_ctzll(lanes);
    const uint32_t anchor = codes[first] - rise[first];
    int32_t differences[TILE_LANES];
    for (int i = 0; i < count; i++)
        differences[i] = (int32_t)(codes[i] - anchor - rise[i]);
    if (fill != NULL) {
        for (int i = 0; i < count; i++)
            differences[i] = codes[i] == *fill ? 0 : differences[i];
    }
    const range range = keys_range(differences, count);
    offer.base[0] = anchor + (uint32_t)range.low;
    offer.base[1] = fill == NULL ? 0 : *fill;
    offer.width[0] = range_width(range);
    offer.size_bits = TAG_BITS + bits + 2 * (bits + 1) + bit_length((uint32_t)bits) + count * offer.width[0];
    offer.size_bits += fill == NULL ? 0 : bits + count;
    keep_smaller(best, &offer, count * bits);
}

// Those of other codes than `fill`. Bytes first: eight of 0 or 1 become bits in one multiplication, which none of the sums that
// it adds up carries into.
static uint64_t lanes_other_than(const uint32_t *codes, int count, uint32_t fill)
{
    uint8_t other[TILE_LANES] = {0};
    uint64_t lanes = 0, bytes;
    for (int i = 0; i < count; i++)
        other[i] = codes[i] != fill;
    for (int i = 0; i < TILE_LANES; i += 8) {
        memcpy(&bytes, other + i, sizeof bytes);
        lanes |= (bytes * UINT64_C(0x0102040810204080) >> 56) << i;
    }
    return lanes;
}

// What a clear left is the greatest code or, in planes that look for the farthest, the least: the one of more lanes.
static void try_plane_fill(int bits, const uint32_t *codes, int count, range range, compress_choice *best)
{
    int32_t lows = 0, highs = 0;
    for (int i = 0; i < count; i++) {
        lows += codes[i] == (uint32_t)range.low;
        highs += codes[i] == (uint32_t)range.high;
    }
    const uint32_t fill = (uint32_t)(highs >= lows ? range.high : range.low);
    const uint64_t lanes = lanes_other_than(codes, count, fill);
    if (lanes != 0)
        try_plane(bits, codes, count, lanes, &fill, find_steps(codes, lanes, false, bits), best);
}

static void choose_depth(format format, int bits, const uint32_t *codes, int count, compress_choice *best)
{
    const range range = try_bases(format, bits, codes, count, best);
    const uint64_t lanes = ~0ull >> (TILE_LANES - count);
    if (best->quarters > 1) {
        const plane_steps far = find_steps(codes, lanes, false, bits), near = find_steps(codes, lanes, true, bits);
        try_plane(bits, codes, count, lanes, NULL, far, best);
        if (best->quarters > 1 && (near.x != far.x || near.y != far.y))
            try_plane(bits, codes, count, lanes, NULL, near, best);
    }
    if (best->quarters > 1)
        try_two_bases(bits, codes, count, range, best);
    if (best->quarters > 1)
        try_plane_fill(bits, codes, count, range, best);
}

compress_choice COMPRESS_NAME(format format, int bits, const uint32_t *plane, int first_lane, int lane_count)
{
    assert(lane_count > 0 && lane_count <= TILE_LANES && (lane_count & (lane_count - 1)) == 0);
    assert(first_lane >= 0 && first_lane < TILE_LANES && first_lane % lane_count == 0);
    assert(bits > 0 && (format_table[format].class == FORMAT_CLASS_COLOR ? bits % 4 == 0 : bits <= 32));
    compress_choice best = {.quarters = 4, .size_bits = lane_count * bits};
    if (format_table[format].class == FORMAT_CLASS_DEPTH)
        choose_depth(format, bits, plane + first_lane, lane_count, &best);
    else
        try_bases(format, bits, plane + first_lane, lane_count, &best);
    return best;
}
