// Visibility ordering against the relation "in front of" itself, on random images with ties, cycles, draws and samples.
#include "order_fixture.h"

enum { FRAGMENTS_MAX = 160, CASES = 250 };

// xorshift64*
static uint32_t below(uint64_t *state, uint32_t bound)
{
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    return (uint32_t)((*state * 0x2545f4914f6cdd1du >> 33) % bound);
}

typedef struct random_scene {
    order_scene scene;
    order_fragment table[FRAGMENTS_MAX];
} random_scene;

// `wild`: any depth anywhere, which makes cycles; else each primitive has one depth, which makes none.
static void fill(random_scene *r, uint64_t *state, bool wild)
{
    static const draw_class classes[4] = {CLASS_TRANSPARENT, CLASS_OPAQUE, CLASS_SORTED, CLASS_TRANSPARENT};
    const uint32_t samples = 1u << below(state, 3), primitives = 1 + below(state, 24), depths = 2 + below(state, 40);
    const uint32_t count = below(state, FRAGMENTS_MAX), draws = 1 + below(state, 4);
    r->scene = (order_scene){.width = 1 + below(state, 5),
                             .height = 1 + below(state, 4),
                             .samples = samples,
                             .draw_count = draws,
                             .fragments = r->table,
                             .count = count};
    memcpy(r->scene.classes, classes, sizeof classes);
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t primitive = below(state, primitives), depth = wild ? below(state, depths) : primitive * 7 % 24;
        r->table[i] = (order_fragment){i * draws / count,
                                       below(state, r->scene.width),
                                       below(state, r->scene.height),
                                       below(state, samples),
                                       depth / 64.0,
                                       primitive};
    }
    // A primitive covers a sample once, but for a few wild ones.
    for (uint32_t i = 0; i < r->scene.count; i++)
        for (uint32_t j = 0; j < i && !(wild && below(state, 64) == 0); j++)
            if (r->table[j].draw == r->table[i].draw && r->table[j].primitive == r->table[i].primitive &&
                r->table[j].x == r->table[i].x && r->table[j].y == r->table[i].y &&
                r->table[j].sample == r->table[i].sample) {
                memmove(&r->table[i], &r->table[i + 1], (r->scene.count - i - 1) * sizeof *r->table);
                r->scene.count--;
                i--;
                break;
            }
}

static void expect_model(const order_result *result, const order_model *model)
{
    assert_int_equal(result->primitive_count, model->count);
    assert_int_equal(result->layer_count, model->layer_count);
    assert_int_equal(result->pairs_wrong, 0);
    for (uint32_t i = 0; i < model->count; i++) {
        const order_primitive *expected = &model->primitives[i];
        const order_primitive *p = find_primitive(result, expected->draw, expected->primitive);
        assert_non_null(p);
        assert_int_equal(p->place, expected->place);
        if (p->place == PLACE_LAYER)
            assert_int_equal(p->layer, expected->layer);
    }
}

static void places_and_layers_are_those_of_the_relation(void **state)
{
    (void)state;
    uint64_t seed = 20260001, places[PLACE_COUNT] = {0}, deepest = 0;
    for (int i = 0; i < CASES; i++) {
        random_scene random;
        order_model model;
        fill(&random, &seed, i % 3 == 0);
        model_order(&random.scene, &model);
        const order_options options = {.threads = 1 + i % 2, .block_pixels = below(&seed, 4)};
        order_result *result = scene_ordered(&random.scene, &options);
        expect_model(result, &model);
        assert_true(result->blocks.bytes_read <= result->whole.bytes_read);
        assert_int_equal(result->item_passes, result->layer_count + (result->place_counts[PLACE_CYCLE] > 0));
        for (int p = 0; p < PLACE_COUNT; p++)
            places[p] += result->place_counts[p];
        deepest = result->layer_count > deepest ? result->layer_count : deepest;
        order_destroy(result);
    }
    // The images were worth looking at.
    assert_true(places[PLACE_LAYER] > 500 && places[PLACE_CYCLE] > 100 && places[PLACE_BEHIND] > 20 && deepest > 8);
}

// What the check counts is what the relation says: the printed rule's mistakes, on images without cycles.
static void the_printed_rules_mistakes_are_counted(void **state)
{
    (void)state;
    uint64_t seed = 7, wrong = 0;
    for (int i = 0; i < CASES; i++) {
        random_scene random;
        order_model model;
        fill(&random, &seed, false);
        model_order(&random.scene, &model);
        order_result *result = scene_ordered(&random.scene, &(order_options){.threads = 1, .printed = true});
        bool contradicts = false;
        for (uint32_t a = 0; a < model.count; a++)
            for (uint32_t b = 0; b < model.count; b++)
                contradicts |=
                    model.front[a][b] &&
                    find_primitive(result, model.primitives[a].draw, model.primitives[a].primitive)->layer >=
                        find_primitive(result, model.primitives[b].draw, model.primitives[b].primitive)->layer;
        assert_int_equal(result->place_counts[PLACE_LAYER], model.count);
        assert_int_equal(contradicts, result->pairs_wrong > 0);
        wrong += contradicts;
        order_destroy(result);
    }
    assert_true(wrong > 0 && wrong < CASES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_and_layers_are_those_of_the_relation),
        cmocka_unit_test(the_printed_rules_mistakes_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
