// Compressed sizes against streams of exactly that many bits, which a decoder reads back, and against sizes by hand.
//
// The encoder takes only the parameters from the library. The decoder takes nothing but the stream, the format and the
// number of lanes.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../sim/mem/compress.h"

#include <string.h>
#include <time.h>

enum { STREAM_BYTES = TILE_LANES * 16 + 64 };

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static uint32_t random_next(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*seed >> 32);
}

static uint32_t low_bits(int count)
{
    return count == 32 ? ~0u : (1u << count) - 1;
}

// ---- Blocks: codes first, then the plane that holds them -------------------------------------------------

typedef struct block {
    format format;
    int bits, channels, channel_bits;
    uint32_t codes[4][TILE_LANES];
    uint32_t plane[4 * TILE_LANES];
} block;

static block block_of(format format)
{
    block block = {.format = format, .bits = format_table[format].bits, .channels = 1};
    if (format_table[format].class == FORMAT_CLASS_COLOR)
        block.channels = 4;
    block.channel_bits = block.bits / block.channels;
    return block;
}

static uint32_t word_of(format format, uint32_t code)
{
    if (format == FORMAT_rgba8)
        return bits_of((float)code / 255.0f);
    return format == FORMAT_rgba16f ? bits_of(format_half_to_float((uint16_t)code)) : code;
}

static void fill_plane(block *block)
{
    for (int channel = 0; channel < block->channels; channel++) {
        for (int i = 0; i < TILE_LANES; i++) {
            block->codes[channel][i] &= low_bits(block->channel_bits);
            block->plane[channel * TILE_LANES + i] = word_of(block->format, block->codes[channel][i]);
        }
    }
}

// ---- The stream ------------------------------------------------------------------------------------------

typedef struct stream {
    uint8_t bytes[STREAM_BYTES];
    int at;
} stream;

static void put(stream *stream, uint64_t value, int bits)
{
    for (int i = 0; i < bits; i++, stream->at++)
        stream->bytes[stream->at / 8] |= (uint8_t)((value >> i & 1) << stream->at % 8);
}

static uint64_t get(stream *stream, int bits)
{
    uint64_t value = 0;
    for (int i = 0; i < bits; i++, stream->at++)
        value |= (uint64_t)(stream->bytes[stream->at / 8] >> stream->at % 8 & 1) << i;
    return value;
}

// Bits of a field that holds a width from 0 to `bits`.
static int width_field(int bits)
{
    int field = 0;
    while (bits >> field != 0)
        field++;
    return field;
}

static bool is_float(format format)
{
    return format == FORMAT_f32 || format == FORMAT_rgba16f || format == FORMAT_rgba32f;
}

// Sign and magnitude as an integer that orders as the numbers do, -0 below 0; and back. The second is its own inverse.
static uint32_t swap_order(format format, int bits, uint32_t code)
{
    const bool negative = code >> (bits - 1) & 1;
    return is_float(format) && negative ? code ^ low_bits(bits - 1) : code;
}

static uint32_t risen(int64_t step_x, int64_t step_y, int lane)
{
    const int64_t eighths = step_x * (lane % 8) + step_y * (lane / 8) + 4;
    const int64_t wrapped = (int32_t)(uint32_t)eighths;  // the sum is kept in 32 bits
    return (uint32_t)((wrapped - (wrapped % 8 + 8) % 8) / 8);
}

static void encode(const block *block, int first, int count, const compress_choice *choice, stream *stream)
{
    const int bits = block->channel_bits, field = width_field(bits);
    const uint32_t *codes = block->codes[0] + first, *base = choice->base, all = low_bits(bits);
    const int width = choice->width[0];
    const bool has_fill = choice->scheme == COMPRESS_PLANE_FILL;
    put(stream, choice->scheme, 2);
    switch (choice->scheme) {
    case COMPRESS_BASE:
        for (int channel = 0; channel < block->channels; channel++) {
            put(stream, base[channel] & all, bits);
            put(stream, choice->width[channel], field);
            for (int i = 0; i < count; i++) {
                const uint32_t key = swap_order(block->format, bits, block->codes[channel][first + i]);
                put(stream, (key - base[channel]) & all, choice->width[channel]);
            }
        }
        break;
    case COMPRESS_TWO_BASES:
        put(stream, base[0] & all, bits);
        put(stream, base[1] & all, bits);
        put(stream, width, field);
        for (int i = 0; i < count; i++) {
            const bool below = base[1] - codes[i] <= codes[i] - base[0];
            put(stream, below, 1);
            put(stream, below ? base[1] - codes[i] : codes[i] - base[0], width);
        }
        break;
    case COMPRESS_PLANE:
    case COMPRESS_PLANE_FILL:
        put(stream, base[0] & all, bits);
        put(stream, (uint64_t)(int64_t)choice->step_x, bits + 1);
        put(stream, (uint64_t)(int64_t)choice->step_y, bits + 1);
        if (has_fill)
            put(stream, base[1] & all, bits);
        put(stream, width, field);
        for (int i = 0; i < count; i++) {
            const bool filled = has_fill && codes[i] == base[1];
            if (has_fill)
                put(stream, filled, 1);
            put(stream, filled ? 0 : codes[i] - base[0] - risen(choice->step_x, choice->step_y, i), width);
        }
        break;
    }
}

static int64_t get_signed(stream *stream, int bits)
{
    const int64_t value = (int64_t)get(stream, bits);
    return value >> (bits - 1) & 1 ? value - ((int64_t)1 << bits) : value;
}

static void decode(stream *stream, format format, int channels, int bits, int count, uint32_t codes[4][TILE_LANES])
{
    const int field = width_field(bits);
    const uint32_t all = low_bits(bits);
    const compress_scheme scheme = (compress_scheme)get(stream, 2);
    if (scheme == COMPRESS_BASE) {
        for (int channel = 0; channel < channels; channel++) {
            const uint32_t base = (uint32_t)get(stream, bits);
            const int width = (int)get(stream, field);
            for (int i = 0; i < count; i++)
                codes[channel][i] = swap_order(format, bits, (base + (uint32_t)get(stream, width)) & all);
        }
        return;
    }
    uint32_t base[2] = {(uint32_t)get(stream, bits), 0};
    if (scheme == COMPRESS_TWO_BASES) {
        base[1] = (uint32_t)get(stream, bits);
        const int width = (int)get(stream, field);
        for (int i = 0; i < count; i++) {
            const bool below = get(stream, 1);
            const uint32_t difference = (uint32_t)get(stream, width);
            codes[0][i] = (below ? base[1] - difference : base[0] + difference) & all;
        }
        return;
    }
    const int64_t step_x = get_signed(stream, bits + 1), step_y = get_signed(stream, bits + 1);
    if (scheme == COMPRESS_PLANE_FILL)
        base[1] = (uint32_t)get(stream, bits);
    const int width = (int)get(stream, field);
    for (int i = 0; i < count; i++) {
        const bool filled = scheme == COMPRESS_PLANE_FILL && get(stream, 1);
        const uint32_t difference = (uint32_t)get(stream, width);
        codes[0][i] = (filled ? base[1] : base[0] + difference + risen(step_x, step_y, i)) & all;
    }
}

// Whether the part comes back from a stream of the size claimed, and the quarters follow from the size.
static bool comes_back(const block *block, int first, int count, int seen[4])
{
    const int raw = count * block->bits;
    const compress_choice choice = compress_choose(block->format, block->bits, block->plane, first, count);
    if (compress_quarters(block->format, block->bits, block->plane, first, count) != choice.quarters)
        return false;
    if (choice.quarters == 4)
        return choice.size_bits == raw;
    seen[choice.scheme]++;
    stream stream = {0};
    encode(block, first, count, &choice, &stream);
    if (stream.at != choice.size_bits || choice.quarters < 1 || 4 * stream.at > choice.quarters * raw ||
        4 * stream.at <= (choice.quarters - 1) * raw)
        return false;
    stream.at = 0;
    uint32_t codes[4][TILE_LANES];
    decode(&stream, block->format, block->channels, block->channel_bits, count, codes);
    bool same = stream.at == choice.size_bits;
    for (int channel = 0; channel < block->channels; channel++) {
        for (int i = 0; i < count; i++)
            same &= word_of(block->format, codes[channel][i]) == block->plane[channel * TILE_LANES + first + i];
    }
    return same;
}

// ---- Random blocks ---------------------------------------------------------------------------------------

typedef enum kind { CONSTANT, PLANAR, NOISY_PLANE, CURVED, EDGE, CLEARED, ODD_LANE, NOISY, RANDOM, SPECIAL, KINDS } kind;

// A plane with slopes in sixteenths of a code, up to 2^(bits - 4) codes a lane.
typedef struct slope { uint32_t start; int64_t x, y; } slope;

static slope random_slope(uint64_t *seed, int bits)
{
    const int size = (int)(random_next(seed) % (uint32_t)bits);
    const int64_t x = random_next(seed) & low_bits(size), y = random_next(seed) & low_bits(size);
    return (slope){random_next(seed), random_next(seed) & 1 ? x : -x, random_next(seed) & 1 ? y : -y};
}

static uint32_t slope_at(slope slope, int lane)
{
    return slope.start + (uint32_t)((slope.x * (lane % 8) + slope.y * (lane / 8)) / 16);
}

static uint32_t special_code(uint64_t *seed, int bits, uint32_t code)
{
    const int mantissa = bits == 16 ? 10 : 23;
    const uint32_t infinity = low_bits(bits - 1) & ~low_bits(mantissa), sign = 1u << (bits - 1);
    const uint32_t of[] = {0, sign, 1, sign | 1, infinity, sign | infinity, infinity | 1u << (mantissa - 1), infinity | 1,
                           sign | low_bits(bits - 1), code, code, code};
    return of[random_next(seed) % (sizeof of / sizeof *of)];
}

static void random_channel(uint64_t *seed, kind kind, int bits, uint32_t *codes)
{
    const slope near = random_slope(seed, bits), far = random_slope(seed, bits), edge = random_slope(seed, 8);
    const uint32_t noise = low_bits((int)(random_next(seed) % (uint32_t)bits)), curve = random_next(seed) % 64;
    const uint32_t clear = random_next(seed) & 1 ? low_bits(bits) : 0, odd = random_next(seed) % TILE_LANES;
    for (int i = 0; i < TILE_LANES; i++) {
        const uint32_t flat = slope_at(near, i), some = random_next(seed);
        const bool behind = slope_at(edge, i) - edge.start < 1u << 31;
        const uint32_t square = curve * (uint32_t)((i % 8) * (i % 8) + (i / 8) * (i / 8)) / 8;
        switch (kind) {
        case CONSTANT: codes[i] = near.start; break;
        case PLANAR: codes[i] = flat; break;
        case NOISY_PLANE: codes[i] = flat + (some & noise); break;
        case CURVED: codes[i] = flat + square; break;
        case EDGE: codes[i] = behind ? slope_at(far, i) : flat; break;
        case CLEARED: codes[i] = behind ? clear : flat; break;
        case ODD_LANE: codes[i] = near.start + ((uint32_t)i == odd ? (some & noise) : 0); break;
        case NOISY: codes[i] = near.start + (some & noise); break;
        case SPECIAL: codes[i] = special_code(seed, bits == 16 ? 16 : 32, flat); break;
        default: codes[i] = some; break;
        }
    }
}

static void test_streams(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int format = 0; format < FORMAT_COUNT; format++) {
        int seen[4] = {0}, failed = 0;
        for (int round = 0; round < 600; round++) {
            block block = block_of((enum format)format);
            for (int channel = 0; channel < block.channels; channel++)
                random_channel(&seed, (kind)(round % KINDS), block.channel_bits, block.codes[channel]);
            fill_plane(&block);
            for (int count = TILE_LANES; count > 0; count /= 2) {
                for (int first = 0; first < TILE_LANES; first += count)
                    failed += !comes_back(&block, first, count, seen);
            }
        }
        assert_int_equal(failed, 0);
        for (int scheme = 0; scheme < 4; scheme++)
            assert_true((seen[scheme] > 50) ==
                        (scheme == COMPRESS_BASE || format_table[format].class == FORMAT_CLASS_DEPTH));
    }
}

// Each code of each channel format comes back alone and beside its neighbour: 8 bits and 16 bits in full.
static void test_every_code(void **state)
{
    (void)state;
    static const format formats[] = {FORMAT_rgba8, FORMAT_rgba16f};
    for (int f = 0; f < 2; f++) {
        int seen[4] = {0}, failed = 0;
        block block = block_of(formats[f]);
        for (uint32_t code = 0; code <= low_bits(block.channel_bits); code++) {
            for (uint32_t i = 0; i < 4 * TILE_LANES; i++)
                block.codes[i / TILE_LANES][i % TILE_LANES] = code + (i % 5 == 0);
            fill_plane(&block);
            failed += !comes_back(&block, 0, TILE_LANES, seen);
        }
        assert_int_equal(failed, 0);
        assert_true(seen[COMPRESS_BASE] >= (int)low_bits(block.channel_bits) - 1);
    }
}

// ---- Sizes by hand ---------------------------------------------------------------------------------------

// Quarters and bits of a part, as written beside each case. 2 bits say the scheme.
static void expect(block *block, int first, int count, int quarters, int size_bits)
{
    fill_plane(block);
    const compress_choice choice = compress_choose(block->format, block->bits, block->plane, first, count);
    assert_int_equal(choice.size_bits, size_bits);
    assert_int_equal(choice.quarters, quarters);
    assert_int_equal(compress_quarters(block->format, block->bits, block->plane, first, count), quarters);
}

static block constant_block(format format, uint32_t code)
{
    block block = block_of(format);
    for (int i = 0; i < 4 * TILE_LANES; i++)
        block.codes[i / TILE_LANES][i % TILE_LANES] = code;
    return block;
}

static void test_constant(void **state)
{
    (void)state;
    static const struct { format format; int size_bits; } cases[] = {
        {FORMAT_z16, 2 + 16 + 5},       {FORMAT_z24, 2 + 24 + 5},           {FORMAT_z32f, 2 + 32 + 6},
        {FORMAT_u8, 2 + 8 + 4},         {FORMAT_u32, 2 + 32 + 6},           {FORMAT_f32, 2 + 32 + 6},
        {FORMAT_rgba8, 2 + 4 * (8 + 4)}, {FORMAT_rgba16f, 2 + 4 * (16 + 5)}, {FORMAT_rgba32f, 2 + 4 * (32 + 6)},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        block block = constant_block(cases[i].format, 77);
        expect(&block, 0, 64, 1, cases[i].size_bits);
        expect(&block, 32, 32, 1, cases[i].size_bits);
        expect(&block, 48, 16, 1, cases[i].size_bits);
        // One lane of one channel off by one code: a bit a lane, in that channel.
        block.codes[block.channels - 1][1]++;
        expect(&block, 0, 64, 1, cases[i].size_bits + 64);
        expect(&block, 32, 32, 1, cases[i].size_bits);
    }
    assert_int_equal(sizeof cases / sizeof *cases, FORMAT_COUNT);
    // 8 lanes: a quarter of u8 is 16 bits, of z16 32, of z24 48, of rgba8 64; the header fits.
    block block = constant_block(FORMAT_u8, 3);
    expect(&block, 8, 8, 1, 14);
    block = constant_block(FORMAT_z24, 0xffffff);
    expect(&block, 56, 8, 1, 31);
    // 4 lanes of rgba8: 50 bits of 128 are 2 quarters. One lane: 50 of 32 bits are too many, so it is stored as it is.
    block = constant_block(FORMAT_rgba8, 255);
    expect(&block, 4, 4, 2, 50);
    expect(&block, 4, 1, 4, 32);
}

// A plane too steep for one base, with noise of `noise` bits at lanes that do not say where the plane lies.
static block noisy_plane(format format, uint32_t start, uint32_t x, uint32_t y, int noise)
{
    block block = block_of(format);
    uint64_t seed = 5;
    for (uint32_t i = 0; i < TILE_LANES; i++) {
        const bool exact = i == 0 || i == 1 || i == 7 || i == 8 || i == 56;
        const uint32_t above = i == 63 ? low_bits(noise) : random_next(&seed) & low_bits(noise);
        block.codes[0][i] = start + x * (i % 8) + y * (i / 8) + (exact ? 0 : above);
    }
    return block;
}

static void test_planes(void **state)
{
    (void)state;
    // Scheme, anchor, two steps, width: 2 + b + 2 (b + 1) + w bits, and the noise a lane. Quarters of 64 lanes: 256 bits of
    // z16, 384 of z24, 512 of z32f.
    static const struct { format format; uint32_t start, x, y; int noise, quarters, size_bits; } cases[] = {
        {FORMAT_z16, 1000, 1000, 4000, 0, 1, 57},
        {FORMAT_z16, 1000, 1000, 4000, 3, 1, 57 + 64 * 3},     // 249
        {FORMAT_z16, 1000, 1000, 4000, 4, 2, 57 + 64 * 4},     // 313
        {FORMAT_z16, 1000, 1000, 4000, 7, 2, 57 + 64 * 7},     // 505
        {FORMAT_z16, 1000, 1000, 4000, 8, 3, 57 + 64 * 8},     // 569
        {FORMAT_z16, 1000, 1000, 4000, 11, 3, 57 + 64 * 11},   // 761
        {FORMAT_z16, 1000, 1000, 4000, 12, 4, 64 * 16},        // 825 are no less than a block
        {FORMAT_z24, 1 << 22, 100000, 200000, 0, 1, 81},
        {FORMAT_z24, 1 << 22, 100000, 200000, 4, 1, 81 + 64 * 4},     // 337
        {FORMAT_z24, 1 << 22, 100000, 200000, 5, 2, 81 + 64 * 5},     // 401
        {FORMAT_z24, 1 << 22, 100000, 200000, 10, 2, 81 + 64 * 10},   // 721
        {FORMAT_z24, 1 << 22, 100000, 200000, 11, 3, 81 + 64 * 11},   // 785
        {FORMAT_z24, 1 << 22, 100000, 200000, 16, 3, 81 + 64 * 16},   // 1105
        {FORMAT_z24, 1 << 22, 100000, 200000, 17, 4, 64 * 24},        // 1169
        {FORMAT_z24, 1 << 22, -100000, -200000, 4, 1, 81 + 64 * 4},
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 0, 1, 106},
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 6, 1, 106 + 64 * 6},     // 490
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 7, 2, 106 + 64 * 7},     // 554
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 14, 2, 106 + 64 * 14},   // 1002
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 15, 3, 106 + 64 * 15},   // 1066
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 22, 3, 106 + 64 * 22},   // 1514
        {FORMAT_z32f, 0x30000000, 5000000, 9000000, 23, 4, 64 * 32},         // 1578
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        block block = noisy_plane(cases[i].format, cases[i].start, cases[i].x, cases[i].y, cases[i].noise);
        expect(&block, 0, 64, cases[i].quarters, cases[i].size_bits);
    }
    // Two rows of an exact plane, 384 bits of z24: the plane's 81 bits fit a quarter. One row, 192: they take two.
    block block = noisy_plane(FORMAT_z24, 1 << 22, 100000, 200000, 0);
    expect(&block, 16, 16, 1, 81);
    expect(&block, 24, 8, 2, 81);
    // A third of a code a lane: a base alone would need 3 bits a lane. Eighths of a code follow it to one code: 1 bit.
    // Across 20000 codes a row, where no base reaches, as well.
    for (uint32_t i = 0; i < TILE_LANES; i++)
        block.codes[0][i] = 5000 + i % 8 / 3 + i / 8 * 20000;
    expect(&block, 0, 64, 1, 81 + 64);
}

static void test_edges(void **state)
{
    (void)state;
    // Columns 0 to 3 near, the others far: two bases and a bit a lane, 2 + 2 * 24 + 5 + 64.
    block block = block_of(FORMAT_z24);
    for (uint32_t i = 0; i < TILE_LANES; i++)
        block.codes[0][i] = i % 8 < 4 ? 1000 : 9000000;
    expect(&block, 0, 64, 1, 119);
    // Each side with 10 bits of its own: 119 + 640 of 768 bits; with 11 bits: 823.
    block.codes[0][9] += 1023;
    expect(&block, 0, 64, 2, 119 + 64 * 10);
    block.codes[0][9]++;
    block.codes[0][10]++;
    expect(&block, 0, 64, 3, 119 + 64 * 11);
    // A steep plane in front of what a clear left, far or near: scheme, anchor, steps, fill, width, and a bit a lane.
    for (uint32_t clear = 0; clear < 2; clear++) {
        for (uint32_t i = 0; i < TILE_LANES; i++)
            block.codes[0][i] = i % 8 < 4 ? 4000000 + 100000 * (i % 8) + 200000 * (i / 8) : clear * 0xffffff;
        expect(&block, 0, 64, 1, 2 + 24 + 50 + 24 + 5 + 64);
    }
    // The same behind two different surfaces: nothing fits.
    for (uint32_t i = 0; i < TILE_LANES; i++)
        block.codes[0][i] = i % 8 < 4 ? 4000000 + 100000 * (i % 8) + 200000 * (i / 8) : 16000000 - 700000 * (i / 8);
    expect(&block, 0, 64, 4, 64 * 24);
}

// Channels with differences of these bits each.
static block wide_block(format format, const int widths[4])
{
    block block = constant_block(format, 0);
    for (int channel = 0; channel < block.channels; channel++)
        block.codes[channel][33] = low_bits(widths[channel]);
    return block;
}

static void test_bases(void **state)
{
    (void)state;
    // Headers of 50, 86, 154 bits for colours, 14 for u8, 40 for u32; quarters of 512, 1024, 2048, 128 and 512 bits.
    static const struct { format format; int widths[4], quarters, size_bits; } cases[] = {
        {FORMAT_rgba8, {3, 2, 2, 0}, 1, 50 + 64 * 7},   // 498
        {FORMAT_rgba8, {3, 3, 2, 0}, 2, 50 + 64 * 8},   // 562
        {FORMAT_rgba8, {8, 7, 0, 0}, 2, 50 + 64 * 15},  // 1010
        {FORMAT_rgba8, {8, 8, 0, 0}, 3, 50 + 64 * 16},  // 1074
        {FORMAT_rgba8, {8, 8, 7, 0}, 3, 50 + 64 * 23},  // 1522
        {FORMAT_rgba8, {8, 8, 8, 0}, 4, 64 * 32},       // 1586
        {FORMAT_rgba16f, {14, 0, 0, 0}, 1, 86 + 64 * 14},     // 982
        {FORMAT_rgba16f, {8, 7, 0, 0}, 2, 86 + 64 * 15},      // 1046
        {FORMAT_rgba16f, {15, 15, 15, 1}, 3, 86 + 64 * 46},   // 3030
        {FORMAT_rgba16f, {15, 15, 15, 2}, 4, 64 * 64},        // 3094
        {FORMAT_rgba32f, {29, 0, 0, 0}, 1, 154 + 64 * 29},    // 2010
        {FORMAT_rgba32f, {10, 10, 10, 0}, 2, 154 + 64 * 30},  // 2074
        {FORMAT_u8, {1}, 1, 14 + 64},       // 78
        {FORMAT_u8, {2}, 2, 14 + 64 * 2},   // 142
        {FORMAT_u8, {4}, 3, 14 + 64 * 4},   // 270
        {FORMAT_u8, {6}, 4, 64 * 8},        // 398
        {FORMAT_u32, {7}, 1, 40 + 64 * 7},    // 488
        {FORMAT_u32, {8}, 2, 40 + 64 * 8},    // 552
        {FORMAT_u32, {23}, 3, 40 + 64 * 23},  // 1512
        {FORMAT_u32, {32}, 4, 64 * 32},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        block block = wide_block(cases[i].format, cases[i].widths);
        expect(&block, 0, 64, cases[i].quarters, cases[i].size_bits);
    }
    // 0 and -0, in a float format neighbours.
    block block = constant_block(FORMAT_f32, 0);
    block.codes[0][5] = 0x80000000u;
    expect(&block, 0, 64, 1, 40 + 64);
    // Codes on both sides of 2^31 in an unsigned one.
    block = constant_block(FORMAT_u32, 0x7fffffff);
    block.codes[0][5] = 0x80000000u;
    expect(&block, 0, 64, 1, 40 + 64);
    // A stencil of 4 bits, were it stored in 4: 2 + 4 + 3 bits, and as many as its differences.
    block = constant_block(FORMAT_u8, 9);
    block.bits = block.channel_bits = 4;
    expect(&block, 0, 64, 1, 9);
    block.codes[0][5] = 8;
    expect(&block, 0, 64, 2, 9 + 64);
}

static void test_random(void **state)
{
    (void)state;
    uint64_t seed = 9;
    for (int format = 0; format < FORMAT_COUNT; format++) {
        block block = block_of((enum format)format);
        for (int channel = 0; channel < block.channels; channel++)
            random_channel(&seed, RANDOM, block.channel_bits, block.codes[channel]);
        expect(&block, 0, 64, 4, 64 * block.bits);
    }
}

// ---- Time ------------------------------------------------------------------------------------------------

// Printed, not judged: the aim is less than 300 ns a block.
static void test_time(void **state)
{
    (void)state;
    enum { BLOCKS = 64, ROUNDS = 200 };
    static const struct { const char *name; kind kind; } kinds[] = {
        {"constant", CONSTANT}, {"planar", PLANAR}, {"cleared", CLEARED}, {"random", RANDOM}};
    static block blocks[BLOCKS];
    uint64_t seed = 3;
    for (int format = 0; format < FORMAT_COUNT; format++) {
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
            for (int i = 0; i < BLOCKS; i++) {
                blocks[i] = block_of((enum format)format);
                for (int channel = 0; channel < blocks[i].channels; channel++)
                    random_channel(&seed, kinds[k].kind, blocks[i].channel_bits, blocks[i].codes[channel]);
                fill_plane(&blocks[i]);
            }
            struct timespec start, end;
            int quarters = 0;
            clock_gettime(CLOCK_MONOTONIC, &start);
            for (int i = 0; i < BLOCKS * ROUNDS; i++) {
                const block *block = &blocks[i % BLOCKS];
                quarters += compress_quarters(block->format, block->bits, block->plane, 0, TILE_LANES);
            }
            clock_gettime(CLOCK_MONOTONIC, &end);
            const double ns = (double)(end.tv_sec - start.tv_sec) * 1e9 + (double)(end.tv_nsec - start.tv_nsec);
            print_message("%-8s %-8s %5.0f ns a block, %.2f quarters\n", format_table[format].name, kinds[k].name,
                          ns / (BLOCKS * ROUNDS), (double)quarters / (BLOCKS * ROUNDS));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_streams), cmocka_unit_test(test_every_code), cmocka_unit_test(test_constant),
        cmocka_unit_test(test_planes),  cmocka_unit_test(test_edges),      cmocka_unit_test(test_bases),
        cmocka_unit_test(test_random),  cmocka_unit_test(test_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
