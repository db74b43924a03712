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
#define ALONE static __attribute__((noinline))  // inlined, what restrict says would be forgotten

enum { LEARN_X = 1, LEARN_Y = 2 };

// What a fragment's values are guessed from; the same for depth and the four colours.
typedef struct guide {
    uint32_t from;   // index of an earlier fragment
    int16_t dx, dy;  // pixels from there
    uint8_t learn;
} guide;

// Of each sample: its last fragment, its row's first.
typedef struct rows {
    uint32_t last[TRACE_SAMPLES_MAX], first[TRACE_SAMPLES_MAX];
} rows;

struct columns {
    guide guides[BLOCK_MAX];
    uint32_t depth_floats[BLOCK_MAX];
};

columns *columns_create(void)
{
    return malloc(sizeof(columns));
}

size_t columns_bytes(uint32_t count, int depth_bits)
{
    return (size_t)count * (size_t)(2 + 2 + 1 + 4 + 4 * 4 + depth_bits / 8);
}

static void begin_rows(rows *rows)
{
    for (int s = 0; s < TRACE_SAMPLES_MAX; s++)
        rows->last[s] = rows->first[s] = UINT32_MAX;
}

INLINE guide find_guide(rows *rows, const block *block, uint32_t i)
{
    const int s = block->sample[i] % TRACE_SAMPLES_MAX;
    const uint32_t last = rows->last[s];
    guide guide = {.from = last};
    rows->last[s] = i;
    if (last == UINT32_MAX || block->primitive[last] != block->primitive[i]) {
        guide.from = i > 0 ? i - 1 : 0;
        rows->first[s] = i;
        return guide;
    }
    if (block->y[last] != block->y[i]) {
        guide.from = rows->first[s];
        rows->first[s] = i;
    }
    guide.dx = (int16_t)(block->x[i] - block->x[guide.from]);
    guide.dy = (int16_t)(block->y[i] - block->y[guide.from]);
    guide.learn = guide.dy ? guide.dy == 1 ? LEARN_Y : 0 : guide.dx == 1 ? LEARN_X : 0;
    return guide;
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

// The slopes of a column, in units of its bit pattern a pixel.
typedef struct slopes {
    uint64_t x, y;
} slopes;

INLINE uint64_t guess(const guide *guide, uint64_t base, const slopes *slopes)
{
    return base + (uint64_t)guide->dx * slopes->x + (uint64_t)guide->dy * slopes->y;
}

// By masks: which fragments start rows is as good as random to a branch predictor.
INLINE void learn(const guide *guide, uint64_t difference, slopes *slopes)
{
    uint64_t is_x = 0 - (uint64_t)(guide->learn & LEARN_X), is_y = 0 - (uint64_t)(guide->learn / LEARN_Y);
    uint64_t along_y = difference - (uint64_t)guide->dx * slopes->x;
    slopes->x ^= (slopes->x ^ difference) & is_x;
    slopes->y ^= (slopes->y ^ along_y) & is_y;
}

INLINE uint8_t *encode_values(const guide *guides, const void *values, uint32_t count, int bytes, uint8_t *planes)
{
    slopes slopes = {0, 0};
    for (uint32_t i = 0; i < count; i++) {
        uint64_t value = load(values, i, bytes);
        uint64_t base = i > 0 ? load(values, guides[i].from, bytes) : 0;
        put_planes(planes, count, i, bytes, fold(value - guess(&guides[i], base, &slopes), bytes));
        learn(&guides[i], value - base, &slopes);
    }
    return planes + (size_t)count * (size_t)bytes;
}

// The differences of a column, in the place where its values go. In the column's own width, so that the compiler finds
// vectors.
ALONE const uint8_t *unpack_1(const uint8_t *restrict planes, size_t count, uint8_t *restrict values)
{
    for (size_t i = 0; i < count; i++)
        values[i] = (uint8_t)(planes[i] >> 1 ^ (0 - (planes[i] & 1)));
    return planes + count;
}

ALONE const uint8_t *unpack_2(const uint8_t *restrict planes, size_t count, uint16_t *restrict values)
{
    for (size_t i = 0; i < count; i++) {
        const uint16_t folded = (uint16_t)(planes[i] | planes[count + i] << 8);
        values[i] = (uint16_t)(folded >> 1 ^ (0 - (folded & 1)));
    }
    return planes + 2 * count;
}

ALONE const uint8_t *unpack_4(const uint8_t *restrict planes, size_t count, void *restrict values)
{
    for (size_t i = 0; i < count; i++) {
        uint32_t folded = planes[i] | (uint32_t)planes[count + i] << 8 | (uint32_t)planes[2 * count + i] << 16 |
                          (uint32_t)planes[3 * count + i] << 24;
        folded = (folded >> 1) ^ (0 - (folded & 1));
        memcpy((uint8_t *)values + 4 * i, &folded, 4);
    }
    return planes + 4 * count;
}

ALONE const uint8_t *unpack_8(const uint8_t *restrict planes, uint32_t count, void *restrict values)
{
    for (uint32_t i = 0; i < count; i++)
        store(values, i, 8, unfold(get_planes(planes, count, i, 8)));
    return planes + 8 * (size_t)count;
}

// Differences become values.
INLINE void sum_up(void *values, uint32_t count, int bytes)
{
    uint64_t value = 0;
    for (uint32_t i = 0; i < count; i++)
        store(values, i, bytes, value += load(values, i, bytes));
}

// A column of which the values before some fragment are decoded.
typedef struct value_column {
    void *values;
    slopes slopes;
} value_column;

// Depth and colour are decoded side by side: each value waits for the one before it in its column, so five columns take little
// longer than one. Differences are unpacked before: in one loop, streams that lie powers of two apart would fight for
// the same cache sets.
typedef struct value_columns {
    value_column depth, r, g, b, a;
} value_columns;

INLINE void decode_value(value_column *column, int bytes, const guide *guide, uint32_t i)
{
    const uint64_t base = load(column->values, guide->from, bytes);
    const uint64_t value = guess(guide, base, &column->slopes) + load(column->values, i, bytes);
    store(column->values, i, bytes, value);
    learn(guide, value - base, &column->slopes);
}

// The first fragment from i on that is not the next in its row, which most are.
INLINE uint32_t row_end(const block *block, uint32_t i)
{
    while (i < block->count && block->x[i] == (uint16_t)(block->x[i - 1] + 1) && block->y[i] == block->y[i - 1] &&
           block->primitive[i] == block->primitive[i - 1] && block->sample[i] == block->sample[i - 1])
        i++;
    return i;
}

// The next in its row: all that is guessed is the last step once more, and it is learned.
INLINE void decode_next(value_column *column, int bytes, uint64_t *value, uint32_t i)
{
    column->slopes.x += load(column->values, i, bytes);
    *value += column->slopes.x;
    store(column->values, i, bytes, *value);
}

INLINE void decode_row(value_columns *columns, int depth_bytes, uint32_t first, uint32_t end)
{
    value_columns c = *columns;
    uint64_t depth = load(c.depth.values, first - 1, depth_bytes), r = load(c.r.values, first - 1, 4);
    uint64_t g = load(c.g.values, first - 1, 4), b = load(c.b.values, first - 1, 4), a = load(c.a.values, first - 1, 4);
    for (uint32_t i = first; i < end; i++) {
        decode_next(&c.depth, depth_bytes, &depth, i);
        decode_next(&c.r, 4, &r, i);
        decode_next(&c.g, 4, &g, i);
        decode_next(&c.b, 4, &b, i);
        decode_next(&c.a, 4, &a, i);
    }
    *columns = c;
}

INLINE void decode_values(const block *block, value_columns *columns, int depth_bytes)
{
    rows rows;
    begin_rows(&rows);
    if (block->count)
        find_guide(&rows, block, 0);  // the first one's difference is its value
    for (uint32_t i = 1; i < block->count;) {
        const uint32_t end = row_end(block, i);
        if (end > i) {
            decode_row(columns, depth_bytes, i, end);
            rows.last[block->sample[i] % TRACE_SAMPLES_MAX] = end - 1;
            i = end;
            continue;
        }
        const guide guide = find_guide(&rows, block, i);
        decode_value(&columns->depth, depth_bytes, &guide, i);
        decode_value(&columns->r, 4, &guide, i);
        decode_value(&columns->g, 4, &guide, i);
        decode_value(&columns->b, 4, &guide, i);
        decode_value(&columns->a, 4, &guide, i);
        i++;
    }
}

void columns_encode(columns *columns, const block *block, int depth_bits, uint8_t *planes)
{
    const uint32_t count = block->count;
    rows rows;
    begin_rows(&rows);
    for (uint32_t i = 0; i < count; i++)
        columns->guides[i] = find_guide(&rows, block, i);
    planes = encode_steps(block->x, count, 2, planes);
    planes = encode_steps(block->y, count, 2, planes);
    planes = encode_steps(block->sample, count, 1, planes);
    planes = encode_steps(block->primitive, count, 4, planes);
    if (depth_bits == 64) {
        planes = encode_values(columns->guides, block->depth, count, 8, planes);
    } else {
        for (uint32_t i = 0; i < count; i++) {
            float depth = (float)block->depth[i];
            memcpy(&columns->depth_floats[i], &depth, 4);
        }
        planes = encode_values(columns->guides, columns->depth_floats, count, 4, planes);
    }
    for (int c = 0; c < 4; c++)
        planes = encode_values(columns->guides, block->rgba[c], count, 4, planes);
}

const uint8_t *columns_decode_places(const uint8_t *planes, block *block)
{
    const uint32_t count = block->count;
    planes = unpack_2(planes, count, block->x);
    planes = unpack_2(planes, count, block->y);
    planes = unpack_1(planes, count, block->sample);
    sum_up(block->x, count, 2);
    sum_up(block->y, count, 2);
    sum_up(block->sample, count, 1);
    return planes;
}

void columns_decode(columns *columns, const uint8_t *planes, int depth_bits, block *block)
{
    const uint32_t count = block->count;
    planes = columns_decode_places(planes, block);
    planes = unpack_4(planes, count, block->primitive);
    sum_up(block->primitive, count, 4);
    void *const depth = depth_bits == 64 ? (void *)block->depth : columns->depth_floats;
    planes = depth_bits == 64 ? unpack_8(planes, count, depth) : unpack_4(planes, count, depth);
    for (int c = 0; c < 4; c++)
        planes = unpack_4(planes, count, block->rgba[c]);
    value_columns values = {.depth = {.values = depth}, .r = {.values = block->rgba[0]}, .g = {.values = block->rgba[1]},
                            .b = {.values = block->rgba[2]}, .a = {.values = block->rgba[3]}};
    if (depth_bits == 64) {
        decode_values(block, &values, 8);
        return;
    }
    decode_values(block, &values, 4);
    for (uint32_t i = 0; i < count; i++) {
        float value;
        memcpy(&value, &columns->depth_floats[i], 4);
        block->depth[i] = (double)value;
    }
}
