// Lane runs against their definition, and copies of each length, for each way in which samples lie in blocks.
#include "../../sim/replay/lane_runs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

enum { COUNT = 3000, WORDS = 200 };

typedef struct columns {
    uint16_t x[COUNT], y[COUNT];
    uint8_t sample[COUNT];
    uint32_t primitive[COUNT];
} columns;

static uint64_t place_of(const tiling *t, const columns *c, uint32_t i)
{
    return tiling_place(t, c->x[i], c->y[i], c->sample[i]);
}

// Most fragments are the next sample in the block's row, as a rasterizer sends them; others lie anywhere, some far away.
static void scatter(const tiling *t, columns *c)
{
    const uint32_t in_x = t->tile_width - 1, in_y = t->tile_height - 1;
    for (uint32_t i = 0; i < COUNT; i++) {
        const bool next = i && rand() % 8;
        const uint32_t sample = next ? c->sample[i - 1] + 1u : (uint32_t)rand() % t->samples;
        const uint32_t x = next ? c->x[i - 1] + sample / t->samples : (uint32_t)rand() % 65536;
        const bool wraps = next && sample == t->samples && !(x & in_x) && rand() % 4;  // to the block's next row
        c->x[i] = (uint16_t)(wraps ? x - t->tile_width : x);
        c->y[i] = (uint16_t)(next ? (uint32_t)c->y[i - 1] + wraps : rand() % 3 ? (uint32_t)rand() & in_y : (uint32_t)rand() % 65536);
        c->sample[i] = (uint8_t)(sample % t->samples);
        c->primitive[i] = i ? c->primitive[i - 1] + !(rand() % 16) : 0;
    }
}

static bool joins(const tiling *t, const columns *c, bool primitives, uint32_t i)
{
    const uint64_t before = place_of(t, c, i - 1), place = place_of(t, c, i);
    return place == before + 1 && place % TILE_LANES && (!primitives || c->primitive[i] == c->primitive[i - 1]);
}

static void test_lengths(void **state)
{
    (void)state;
    columns c;
    lane_runs found = {0};
    uint32_t longest = 0;
    for (int turn = 0; turn < 200; turn++) {
        const trace_info info = {.width = 65536, .height = 65536, .samples = 1u << turn % 5};
        tiling t;
        tiling_init(&t, &info);
        scatter(&t, &c);
        const fragments run = {.count = (uint32_t)rand() % COUNT, .x = c.x, .y = c.y, .sample = c.sample, .primitive = c.primitive};
        assert_true(lane_runs_find(&found, &t, &run, turn & 1));
        for (uint32_t i = 0; i < run.count; i++) {
            uint32_t length = 1;
            while (i + length < run.count && joins(&t, &c, turn & 1, i + length))
                length++;
            assert_int_equal(lane_runs_length(&found, i), length);
            longest = length > longest ? length : longest;
        }
    }
    assert_true(longest > 16);
    lane_runs_free(&found);
}

static void test_copies(void **state)
{
    (void)state;
    uint32_t from[2][WORDS], to[2][WORDS], expected[2][WORDS];
    for (uint32_t words = 1; words <= TILE_LANES; words++) {
        word_columns columns = {0};
        for (int c = 0; c < 2; c++) {
            for (uint32_t i = 0; i < WORDS; i++) {
                from[c][i] = (uint32_t)rand();
                to[c][i] = expected[c][i] = (uint32_t)rand();
            }
            memcpy(&expected[c][70], &from[c][3 + words], words * sizeof(uint32_t));
            word_columns_add(&columns, from[c], to[c]);
        }
        word_columns_copy(&columns, 3 + words, 70, words);
        assert_memory_equal(to, expected, sizeof to);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_lengths), cmocka_unit_test(test_copies)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
