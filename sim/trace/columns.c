// Each column becomes differences from a guess, each difference is folded so that small ones have zero high bytes, and
// the bytes are stored plane by plane: first the low byte of every fragment, then the next.
//
// x, y, sample and primitive are guessed to be the previous fragment's. Depth and colour are mostly affine on a
// triangle, so their bit patterns, taken as integers, are extrapolated: from the fragment before in the row, or the
// row's first when a row starts, along the last differences seen in x and in y. Integers wrap, so a bad guess costs
// bytes, never bits.
#include "columns.h"

#include <stdlib.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

enum { LEARN_X = 1, LEARN_Y = 2 };

// One fragment's four colours as the integers that their bits are.
typedef uint32_t color_bits __attribute__((vector_size(16)));

// What a fragment's values are guessed from; the same for depth and the four colours.
struct columns {
    uint32_t from[BLOCK_MAX];              // index of an earlier fragment
    int16_t dx[BLOCK_MAX], dy[BLOCK_MAX];  // pixels from there
    uint8_t learn[BLOCK_MAX];
    uint32_t depth_floats[BLOCK_MAX];
    color_bits colors[BLOCK_MAX];
};

columns *columns_create(void)
{
    return malloc(sizeof(columns));
}

size_t columns_bytes(uint32_t count, int depth_bits)
{
    return (size_t)count * (size_t)(2 + 2 + 1 + 4 + 4 * 4 + depth_bits / 8);
}

static void find_guides(columns *guide, const block *block)
{
    uint32_t last[TRACE_SAMPLES_MAX], row[TRACE_SAMPLES_MAX];  // of each sample: its last fragment, its row's first
    for (int s = 0; s < TRACE_SAMPLES_MAX; s++)
        last[s] = row[s] = UINT32_MAX;
    for (uint32_t i = 0; i < block->count; i++) {
        int s = block->sample[i] % TRACE_SAMPLES_MAX;
        uint32_t from = last[s];
        uint8_t learn = 0;
        if (from == UINT32_MAX || block->primitive[from] != block->primitive[i]) {
            from = i > 0 ? i - 1 : 0;
            guide->dx[i] = guide->dy[i] = 0;
            row[s] = i;
        } else {
            if (block->y[from] != block->y[i]) {
                from = row[s];
                row[s] = i;
            }
            guide->dx[i] = (int16_t)(block->x[i] - block->x[from]);
            guide->dy[i] = (int16_t)(block->y[i] - block->y[from]);
            if (guide->dy[i] == 0)
                learn = guide->dx[i] == 1 ? LEARN_X : 0;
            else
                learn = guide->dy[i] == 1 ? LEARN_Y : 0;
        }
        guide->from[i] = from;
        guide->learn[i] = learn;
        last[s] = i;
    }
}

INLINE uint64_t load(const void *values, uint32_t i, int bytes)
{
    uint64_t value = 0;
    memcpy(&value, (const uint8_t *)values + (size_t)i * (size_t)bytes, (size_t)bytes);
    return value;
}

INLINE void store(void *values, uint32_t i, int bytes, uint64_t value)
{
    memcpy((uint8_t *)values + (size_t)i * (size_t)bytes, &value, (size_t)bytes);
}

// 0, -1, 1, -2, ... become 0, 1, 2, 3, ...
INLINE uint64_t fold(uint64_t difference, int bytes)
{
    int unused = 64 - 8 * bytes;
    int64_t wide = (int64_t)(difference << unused) >> unused;
    return ((uint64_t)wide << 1) ^ (uint64_t)(wide >> 63);
}

INLINE uint64_t unfold(uint64_t folded)
{
    return (folded >> 1) ^ (0 - (folded & 1));
}

INLINE void put_planes(uint8_t *planes, uint32_t count, uint32_t i, int bytes, uint64_t folded)
{
    for (int b = 0; b < bytes; b++)
        planes[(size_t)b * count + i] = (uint8_t)(folded >> (8 * b));
}

INLINE uint64_t get_planes(const uint8_t *planes, uint32_t count, uint32_t i, int bytes)
{
    uint64_t folded = 0;
    for (int b = 0; b < bytes; b++)
        folded |= (uint64_t)planes[(size_t)b * count + i] << (8 * b);
    return folded;
}

INLINE uint8_t *encode_steps(const void *values, uint32_t count, int bytes, uint8_t *planes)
{
    uint64_t previous = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint64_t value = load(values, i, bytes);
        put_planes(planes, count, i, bytes, fold(value - previous, bytes));
        previous = value;
    }
    return planes + (size_t)count * (size_t)bytes;
}

INLINE const uint8_t *decode_steps(const uint8_t *planes, uint32_t count, int bytes, void *values)
{
    uint64_t value = 0;
    for (uint32_t i = 0; i < count; i++) {
        value += unfold(get_planes(planes, count, i, bytes));
        store(values, i, bytes, value);
    }
    return planes + (size_t)count * (size_t)bytes;
}

// The slopes of a column, in units of its bit pattern a pixel.
typedef struct slopes {
    uint64_t x, y;
} slopes;

INLINE uint64_t guess(const columns *guide, uint32_t i, uint64_t base, const slopes *slopes)
{
    return base + (uint64_t)guide->dx[i] * slopes->x + (uint64_t)guide->dy[i] * slopes->y;
}

// By masks: which fragments start rows is as good as random to a branch predictor.
INLINE void learn(const columns *guide, uint32_t i, uint64_t difference, slopes *slopes)
{
    uint64_t is_x = 0 - (uint64_t)(guide->learn[i] & LEARN_X), is_y = 0 - (uint64_t)(guide->learn[i] / LEARN_Y);
    uint64_t along_y = difference - (uint64_t)guide->dx[i] * slopes->x;
    slopes->x ^= (slopes->x ^ difference) & is_x;
    slopes->y ^= (slopes->y ^ along_y) & is_y;
}

INLINE uint8_t *encode_values(const columns *guide, const void *values, uint32_t count, int bytes, uint8_t *planes)
{
    slopes slopes = {0, 0};
    for (uint32_t i = 0; i < count; i++) {
        uint64_t value = load(values, i, bytes);
        uint64_t base = i > 0 ? load(values, guide->from[i], bytes) : 0;
        put_planes(planes, count, i, bytes, fold(value - guess(guide, i, base, &slopes), bytes));
        learn(guide, i, value - base, &slopes);
    }
    return planes + (size_t)count * (size_t)bytes;
}

// The differences of a column, in the place where its values go. In the column's own width, so that the compiler finds
// vectors.
static const uint8_t *unpack_differences_4(const uint8_t *restrict planes, uint32_t count, void *restrict values)
{
    const uint8_t *restrict high = planes + 2 * (size_t)count;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t folded =
            planes[i] | (uint32_t)planes[count + i] << 8 | (uint32_t)high[i] << 16 | (uint32_t)high[count + i] << 24;
        folded = (folded >> 1) ^ (0 - (folded & 1));
        memcpy((uint8_t *)values + 4 * (size_t)i, &folded, 4);
    }
    return planes + 4 * (size_t)count;
}

static const uint8_t *unpack_differences_8(const uint8_t *restrict planes, uint32_t count, void *restrict values)
{
    for (uint32_t i = 0; i < count; i++)
        store(values, i, 8, unfold(get_planes(planes, count, i, 8)));
    return planes + 8 * (size_t)count;
}

INLINE void decode_value(const columns *guide, uint32_t i, int bytes, void *values, slopes *slopes)
{
    uint64_t base = load(values, guide->from[i], bytes);
    uint64_t value = guess(guide, i, base, slopes) + load(values, i, bytes);
    store(values, i, bytes, value);
    learn(guide, i, value - base, slopes);
}

INLINE color_bits load_color(const block *block, uint32_t i)
{
    uint32_t bits[4];
    for (int c = 0; c < 4; c++)
        memcpy(&bits[c], &block->rgba[c][i], sizeof bits[c]);
    return (color_bits){bits[0], bits[1], bits[2], bits[3]};
}

// Depth and colour side by side: each value waits for the one before it in its column, so five columns take little
// longer than one. The planes were merged before: in one loop, streams that lie powers of two apart would fight for
// the same cache sets. `colors` keeps what is decoded, fragment by fragment, for the guesses.
INLINE void decode_values(const columns *guide, int depth_bytes, void *depth, block *block, color_bits *colors)
{
    slopes slopes = {0, 0};  // the first fragment is guessed to be 0: its difference is its value
    color_bits slope_x = {0}, slope_y = {0};
    colors[0] = load_color(block, 0);
    for (uint32_t i = 1; i < block->count; i++) {
        decode_value(guide, i, depth_bytes, depth, &slopes);
        color_bits base = colors[guide->from[i]], along_x = (uint32_t)guide->dx[i] * slope_x;
        color_bits value = base + along_x + (uint32_t)guide->dy[i] * slope_y + load_color(block, i);
        color_bits is_x = (color_bits){0} - (uint32_t)(guide->learn[i] & LEARN_X);
        color_bits is_y = (color_bits){0} - (uint32_t)(guide->learn[i] / LEARN_Y);
        colors[i] = value;
        slope_x ^= (slope_x ^ (value - base)) & is_x;
        slope_y ^= (slope_y ^ (value - base - along_x)) & is_y;
        for (int c = 0; c < 4; c++) {
            uint32_t bits = value[c];
            memcpy(&block->rgba[c][i], &bits, sizeof bits);
        }
    }
}

void columns_encode(columns *columns, const block *block, int depth_bits, uint8_t *planes)
{
    uint32_t count = block->count;
    find_guides(columns, block);
    planes = encode_steps(block->x, count, 2, planes);
    planes = encode_steps(block->y, count, 2, planes);
    planes = encode_steps(block->sample, count, 1, planes);
    planes = encode_steps(block->primitive, count, 4, planes);
    if (depth_bits == 64) {
        planes = encode_values(columns, block->depth, count, 8, planes);
    } else {
        for (uint32_t i = 0; i < count; i++) {
            float depth = (float)block->depth[i];
            memcpy(&columns->depth_floats[i], &depth, 4);
        }
        planes = encode_values(columns, columns->depth_floats, count, 4, planes);
    }
    for (int c = 0; c < 4; c++)
        planes = encode_values(columns, block->rgba[c], count, 4, planes);
}

void columns_decode_places(const uint8_t *planes, block *block)
{
    planes = decode_steps(planes, block->count, 2, block->x);
    planes = decode_steps(planes, block->count, 2, block->y);
    decode_steps(planes, block->count, 1, block->sample);
}

void columns_decode(columns *columns, const uint8_t *planes, int depth_bits, block *block)
{
    uint32_t count = block->count;
    planes = decode_steps(planes, count, 2, block->x);
    planes = decode_steps(planes, count, 2, block->y);
    planes = decode_steps(planes, count, 1, block->sample);
    planes = decode_steps(planes, count, 4, block->primitive);
    find_guides(columns, block);
    void *depth = depth_bits == 64 ? (void *)block->depth : columns->depth_floats;
    planes = depth_bits == 64 ? unpack_differences_8(planes, count, depth) : unpack_differences_4(planes, count, depth);
    for (int c = 0; c < 4; c++)
        planes = unpack_differences_4(planes, count, block->rgba[c]);
    if (depth_bits == 64) {
        decode_values(columns, 8, depth, block, columns->colors);
        return;
    }
    decode_values(columns, 4, depth, block, columns->colors);
    for (uint32_t i = 0; i < count; i++) {
        float value;
        memcpy(&value, &columns->depth_floats[i], 4);
        block->depth[i] = (double)value;
    }
}
