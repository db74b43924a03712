// The two-ended program against what docs/two_ended.md proves of it: exact, at most ceil(N / 2) + 1 passes, never more
// than from the back alone, which takes the fewest spans in order that there are, so never more than the fused program,
// which never takes more than the ideal one. The lean form takes the same passes.
#include "beyond_fixture.h"

enum { TWO_ENDED, LEAN, BACK, FUSED, IDEAL, PROGRAMS };
static const char *const names[PROGRAMS] = {"two_ended_coherent_layer_peel", "two_ended_lean_peel",
                                            "coherent_back_peel,spans=1", "fused_coherent_layer_peel",
                                            "ideal_coherent_layer_peel"};
static small_image image;  // 18 MB

// Returns the passes of the two-ended program.
static uint64_t hold(const contest *c, const char *what, uint64_t number)
{
    uint64_t passes[PROGRAMS];
    const uint64_t layers = image_layers(&image), bound = (layers + 1) / 2 + 1;
    contest_run(c, &image, what, number, passes);
    if (passes[LEAN] != passes[TWO_ENDED] || passes[TWO_ENDED] > passes[BACK] || passes[BACK] > passes[FUSED] ||
        passes[FUSED] > passes[IDEAL] || passes[TWO_ENDED] > bound || bound > layers / 2 + 2 ||
        passes[FUSED] > layers + 1 || passes[BACK] != image_spans(&image) + 1)
        fail_msg("%s %llu: %d passes, lean %d, back %d, fused %d, ideal %d, %d layers in %d spans", what,
                 (unsigned long long)number, (int)passes[TWO_ENDED], (int)passes[LEAN], (int)passes[BACK],
                 (int)passes[FUSED], (int)passes[IDEAL], (int)layers, (int)image_spans(&image));
    return passes[TWO_ENDED];
}

// Every order of arrival of up to 5 fragments, ties included, one image each.
static void test_every_order(void **state)
{
    contest *c = *state;
    uint64_t images = 0, met = 0;
    for (uint32_t length = 1; length <= 5; length++) {
        uint8_t ranks[8] = {0};
        do {
            image_of_ranks(&image, ranks, length);
            const uint64_t layers = image_layers(&image);
            met += hold(c, "order", images++) == (layers + 1) / 2 + 1;
        } while (ranks_next(ranks, length));
    }
    assert_int_equal(images, 1 + 3 + 13 + 75 + 541);
    assert_true(met > 0 && met < images);
}

// Every order of 6 and of 7, each at a sample of one image: what each sample takes.
static void test_every_order_at_once(void **state)
{
    static uint8_t layers[ORDERS_MAX], passes[FUSED + 1][ORDERS_MAX];
    for (uint32_t length = 6; length <= ORDERS_LENGTH_MAX; length++) {
        uint64_t fewer = 0;
        const uint32_t count = image_of_orders(&image, length, layers);
        assert_int_equal(count, length == 6 ? 4683 : ORDERS_MAX);
        for (int program = TWO_ENDED; program <= FUSED; program++)
            image_sample_passes(*state, program, &image, count, passes[program]);
        for (uint32_t i = 0; i < count; i++) {
            const int two_ended = passes[TWO_ENDED][i], back = passes[BACK][i], fused = passes[FUSED][i];
            if (passes[LEAN][i] != two_ended || two_ended > back || back > fused || fused > layers[i] + 1 ||
                two_ended > (layers[i] + 1) / 2 + 1)
                fail_msg("order %u of %u: %d passes, lean %d, back %d, fused %d, %d layers", i, length, two_ended,
                         passes[LEAN][i], back, fused, layers[i]);
            fewer += two_ended < fused;
        }
        assert_true(fewer > count / 2);
    }
}

static void test_one_sample(void **state)
{
    for (uint64_t seed = 0; seed < 2000; seed++) {
        image_at_random(&image, seed, 1, 1, 40);
        hold(*state, "one-sample image", seed);
    }
}

static void test_many_samples(void **state)
{
    for (uint64_t seed = 0; seed < 250; seed++) {
        image_at_random(&image, seed, 1 + (uint32_t)seed % 5, 1 + (uint32_t)seed % 3, 20);
        hold(*state, "image", seed);
    }
}

// The bound is met: in reverse order each pass takes two layers.
static void test_reverse_order(void **state)
{
    for (uint32_t layers = 0; layers <= 30; layers++) {
        uint8_t ranks[32];
        for (uint32_t i = 0; i < layers; i++)
            ranks[i] = (uint8_t)(layers - 1 - i);
        image_of_ranks(&image, ranks, layers);
        assert_int_equal(hold(*state, "reverse order", layers), (layers + 1) / 2 + 1);
    }
}

static int start(void **state)
{
    static contest c;
    contest_start(&c, names, PROGRAMS);
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
        cmocka_unit_test(test_every_order),   cmocka_unit_test(test_every_order_at_once),
        cmocka_unit_test(test_one_sample),    cmocka_unit_test(test_many_samples),
        cmocka_unit_test(test_reverse_order),
    };
    return cmocka_run_group_tests(tests, start, end);
}
