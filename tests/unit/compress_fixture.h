// Blocks of codes and the planes that hold them, for the tests of compression.
//
// Codes come first: a plane of colours holds what they stand for, so tests know the codes without converting back.
#ifndef ROPSIM_TEST_COMPRESS_FIXTURE_H
#define ROPSIM_TEST_COMPRESS_FIXTURE_H

#include "../../isa/isa.h"

#include <string.h>

static inline uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static inline uint32_t random_next(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*seed >> 32);
}

static inline uint32_t low_bits(int count)
{
    return count == 32 ? ~0u : (1u << count) - 1;
}

typedef struct block {
    format format;
    int bits, channels, channel_bits;
    uint32_t codes[4][TILE_LANES];
    uint32_t plane[4 * TILE_LANES];
} block;

static inline block block_of(format format)
{
    block block = {.format = format, .bits = format_table[format].bits, .channels = 1};
    if (format_table[format].class == FORMAT_CLASS_COLOR)
        block.channels = 4;
    block.channel_bits = block.bits / block.channels;
    return block;
}

static inline uint32_t word_of(format format, uint32_t code)
{
    if (format == FORMAT_rgba8)
        return bits_of((float)code / 255.0f);
    return format == FORMAT_rgba16f ? bits_of(format_half_to_float((uint16_t)code)) : code;
}

static inline void fill_plane(block *block)
{
    for (int channel = 0; channel < block->channels; channel++) {
        for (int i = 0; i < TILE_LANES; i++) {
            block->codes[channel][i] &= low_bits(block->channel_bits);
            block->plane[channel * TILE_LANES + i] = word_of(block->format, block->codes[channel][i]);
        }
    }
}

// ---- Random blocks ---------------------------------------------------------------------------------------

typedef enum kind {
    CONSTANT,
    PLANAR,
    NOISY_PLANE,
    CURVED,
    EDGE,
    CLEARED,
    ODD_LANE,
    NOISY,
    RANDOM,
    SPECIAL,
    KINDS
} kind;

// A plane with slopes in sixteenths of a code, up to half of all codes a lane: some are steeper than a stream can say.
typedef struct slope {
    uint32_t start;
    int64_t x, y;
} slope;

static inline slope random_slope(uint64_t *seed, int bits)
{
    const int any = (int)(random_next(seed) % (uint32_t)(bits + 4)), size = any < 32 ? any : 32;
    const int64_t x = random_next(seed) & low_bits(size), y = random_next(seed) & low_bits(size);
    return (slope){random_next(seed), random_next(seed) & 1 ? x : -x, random_next(seed) & 1 ? y : -y};
}

static inline uint32_t slope_at(slope slope, int lane)
{
    return slope.start + (uint32_t)((slope.x * (lane % 8) + slope.y * (lane / 8)) / 16);
}

static inline uint32_t special_code(uint64_t *seed, int bits, uint32_t code)
{
    const int mantissa = bits == 16 ? 10 : 23;
    const uint32_t infinity = low_bits(bits - 1) & ~low_bits(mantissa), sign = 1u << (bits - 1);
    const uint32_t of[] = {0,
                           sign,
                           1,
                           sign | 1,
                           infinity,
                           sign | infinity,
                           infinity | 1u << (mantissa - 1),
                           infinity | 1,
                           sign | low_bits(bits - 1),
                           code,
                           code,
                           code};
    return of[random_next(seed) % (sizeof of / sizeof *of)];
}

static inline void random_channel(uint64_t *seed, kind kind, int bits, uint32_t *codes)
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

#endif
