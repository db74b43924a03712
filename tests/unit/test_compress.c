// Compressed sizes against streams of exactly that many bits, which a decoder reads back.
//
// The encoder takes only the parameters from the library. The decoder takes nothing but the stream, the format and the
// number of lanes.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../sim/mem/compress.h"
#include "compress_fixture.h"

enum { STREAM_BYTES = TILE_LANES * 16 + 64 };

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
    const compress_choice narrow = compress_16(block->format, block->bits, block->plane, first, count);
    if (compress_quarters(block->format, block->bits, block->plane, first, count) != choice.quarters || narrow.scheme != choice.scheme ||
        narrow.size_bits != choice.size_bits || narrow.step_x != choice.step_x || narrow.step_y != choice.step_y)
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

// ---- Tests -----------------------------------------------------------------------------------------------

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

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_streams),
        cmocka_unit_test(test_every_code),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
