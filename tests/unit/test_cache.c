// The tags of a cache against lists of lines in order of their use, over random shapes and sequences.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "../../sim/mem/cache.h"

#include <stdlib.h>
#include <string.h>

enum { SETS_MAX = 7, WAYS_MAX = 9, LINES_MAX = 200 };

static uint64_t random_bits(void)
{
    static uint64_t state = 1;
    state ^= state << 13;
    state ^= state >> 7;
    return state ^= state << 17;
}

static uint32_t up_to(uint32_t most)
{
    return (uint32_t)(random_bits() >> 16) % (most + 1);
}

// A set as lines from the least to the most recently used one.
typedef struct model_line {
    uint64_t id, valid, dirty;
} model_line;
typedef struct model_set {
    model_line lines[WAYS_MAX];
    uint32_t count;
} model_set;

static model_line *model_find(model_set *set, uint64_t id)
{
    for (uint32_t i = 0; i < set->count; i++)
        if (set->lines[i].id == id)
            return &set->lines[i];
    return NULL;
}

static model_line model_remove(model_set *set, model_line *line)
{
    const model_line removed = *line;
    memmove(line, line + 1, (size_t)(set->lines + set->count - line - 1) * sizeof *line);
    set->count--;
    return removed;
}

static void compare_lines(const cache_line *line, const model_line *expected)
{
    assert_int_equal(line->id, expected->id);
    assert_int_equal(line->valid, expected->valid);
    assert_int_equal(line->dirty, expected->dirty);
}

// One lookup as the memory model does it; the line becomes the last of its set's list.
static void look_up(cache *c, model_set *sets, uint32_t *slots, uint64_t id)
{
    const uint32_t set = (uint32_t)(id % c->sets);
    model_set *model = &sets[set];
    model_line *known = model_find(model, id);
    cache_line *line = cache_find(c, slots[id], id);
    assert_int_equal(line != NULL, known != NULL);
    model_line entry = {.id = id};
    if (known) {
        compare_lines(line, known);
        entry = model_remove(model, known);
    } else {
        line = cache_victim(c, set);
        assert_in_range(line - c->lines, (size_t)set * c->ways, (size_t)(set + 1) * c->ways - 1);
        if (model->count == c->ways) {
            const model_line oldest = model_remove(model, &model->lines[0]);
            compare_lines(line, &oldest);
        } else {
            assert_true(line->id == CACHE_NONE);
        }
        slots[id] = cache_put(c, line, id);
        assert_ptr_equal(c->lines + slots[id], line);
        compare_lines(line, &entry);
    }
    cache_use(c, line);
    entry.valid = line->valid |= random_bits();
    entry.dirty = line->dirty = random_bits();
    model->lines[model->count++] = entry;
}

static void forget(cache *c, model_set *sets, const uint32_t *slots, uint64_t id)
{
    model_set *model = &sets[id % c->sets];
    cache_line *line = cache_find(c, slots[id], id);
    model_line *known = model_find(model, id);
    assert_int_equal(line != NULL, known != NULL);
    if (!line)
        return;
    *line = (cache_line){.id = CACHE_NONE};
    model_remove(model, known);
}

static void test_random(void **state)
{
    (void)state;
    enum { SHAPES = 60, STEPS = 4000, LINE_BYTES = 64 };
    for (int shape = 0; shape < SHAPES; shape++) {
        const uint32_t sets = 1 + up_to(SETS_MAX - 1), ways = 1 + up_to(WAYS_MAX - 1), lines = 1 + up_to(LINES_MAX - 1);
        model_set models[SETS_MAX] = {0};
        uint32_t slots[LINES_MAX];
        cache c;
        assert_true(cache_make(&c, (uint64_t)sets * ways * LINE_BYTES, LINE_BYTES, ways));
        assert_int_equal(c.sets, sets);
        for (uint32_t i = 0; i < lines; i++)
            slots[i] = up_to(sets * ways - 1);  // of lines that were never put in: any
        for (int step = 0; step < STEPS; step++) {
            const uint64_t id = up_to(lines - 1);
            if (!up_to(999)) {
                cache_forget(&c);
                memset(models, 0, sizeof models);
            } else if (!up_to(19)) {
                forget(&c, models, slots, id);
            } else {
                look_up(&c, models, slots, id);
            }
        }
        cache_free(&c);
    }
}

// Empty lines are taken in their order, so that a run's slots do not depend on anything but its lookups.
static void test_order(void **state)
{
    (void)state;
    cache c;
    assert_true(cache_make(&c, 4 * 64, 64, 4));
    for (uint32_t i = 0; i < 4; i++) {
        cache_line *line = cache_victim(&c, 0);
        assert_int_equal(cache_put(&c, line, i), i);
        cache_use(&c, line);
    }
    c.lines[2] = (cache_line){.id = CACHE_NONE};
    c.lines[1] = (cache_line){.id = CACHE_NONE};
    assert_ptr_equal(cache_victim(&c, 0), &c.lines[1]);
    cache_free(&c);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_random), cmocka_unit_test(test_order)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
