// The programs that trade planes for passes: exact on every order of arrival with ties and on random images, and never
// more passes than their headers say.
#include "beyond_fixture.h"

// Each pass of a program takes at least `layers` of what is left at a sample, `untied` if no two fragments tie there.
static const struct {
    const char *name;
    uint32_t layers, untied;
} rows[] = {
    {"back_layer_peel", 1, 1},
    {"coherent_back_peel,spans=1", 1, 1},
    {"coherent_back_peel,spans=3", 3, 3},
    {"two_ended_lean_peel", 2, 2},
    {"two_ended_lean_peel,closed=1", 2, 3},
    {"two_ended_lean_peel,spans=2,closed=1", 3, 4},
    {"two_ended_opposed_peel", 2, 3},
    {"two_ended_opposed_peel,spans=2", 3, 4},
};
enum { ROWS = sizeof rows / sizeof *rows };
static small_image image;

static uint64_t most_passes(uint64_t layers, uint64_t each)
{
    return (layers + each - 1) / each + 1;
}

static void test_every_order(void **state)
{
    static uint8_t layers[ORDERS_MAX], passes[ROWS][ORDERS_MAX];
    const contest *c = *state;
    for (uint32_t length = 1; length <= ORDERS_LENGTH_MAX; length++) {
        const uint32_t count = image_of_orders(&image, length, layers);
        for (int row = 0; row < ROWS; row++) {
            bool met = false;
            // back_layer_peel looks for its first layer in a pass of its own, before the loop
            const uint32_t before = row == 0;
            image_sample_passes(c, row, &image, count, passes[row]);
            for (uint32_t i = 0; i < count; i++) {
                const uint64_t most = most_passes(layers[i], layers[i] == length ? rows[row].untied : rows[row].layers);
                if (passes[row][i] + before > most)
                    fail_msg("%s, order %u of %u: %d passes, %d layers", rows[row].name, i, length, passes[row][i],
                             layers[i]);
                met |= passes[row][i] + before == most;
            }
            assert_true(met);
        }
        // One more span from the back never costs a pass.
        for (uint32_t i = 0; i < count; i++)
            assert_true(passes[2][i] <= passes[1][i] && passes[5][i] <= passes[4][i] && passes[7][i] <= passes[6][i]);
    }
}

static void hold(const contest *c, const char *what, uint64_t number)
{
    uint64_t passes[ROWS];
    const uint64_t layers = image_layers(&image);
    contest_run(c, &image, what, number, passes);
    for (int row = 0; row < ROWS; row++)
        if (passes[row] > most_passes(layers, rows[row].layers))
            fail_msg("%s, %s %llu: %llu passes, %llu layers", rows[row].name, what, (unsigned long long)number,
                     (unsigned long long)passes[row], (unsigned long long)layers);
}

static void test_one_sample(void **state)
{
    for (uint64_t seed = 0; seed < 700; seed++) {
        image_at_random(&image, seed, 1, 1, 40);
        hold(*state, "one-sample image", seed);
    }
}

static void test_many_samples(void **state)
{
    for (uint64_t seed = 0; seed < 200; seed++) {
        image_at_random(&image, seed, 1 + (uint32_t)seed % 5, 1 + (uint32_t)seed % 3, 20);
        hold(*state, "image", seed);
    }
}

// Layers in order take two passes; in reverse order only the opposed program does.
static void test_orders(void **state)
{
    const contest *c = *state;
    enum { LAYERS = 40 };
    for (int reversed = 0; reversed < 2; reversed++) {
        uint8_t ranks[LAYERS];
        uint64_t passes[ROWS];
        for (uint32_t i = 0; i < LAYERS; i++)
            ranks[i] = (uint8_t)(reversed ? LAYERS - 1 - i : i);
        image_of_ranks(&image, ranks, LAYERS);
        contest_run(c, &image, "40 layers", (uint64_t)reversed, passes);
        for (int row = 0; row < ROWS; row++) {
            const bool coherent = row > 0 && (!reversed || row >= 6);
            assert_int_equal(passes[row], coherent ? 2 : most_passes(LAYERS, rows[row].untied));
        }
    }
}

static int start(void **state)
{
    static contest c;
    static const char *names[ROWS];
    for (int i = 0; i < ROWS; i++)
        names[i] = rows[i].name;
    contest_start(&c, names, ROWS);
    *state = &c;
    return 0;
}

static int end(void **state)
{
    contest_end(*state);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_order),
        cmocka_unit_test(test_one_sample),
        cmocka_unit_test(test_many_samples),
        cmocka_unit_test(test_orders),
    };
    return cmocka_run_group_tests(tests, start, end);
}
