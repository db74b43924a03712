// What is written comes back bit by bit from both forms, with one hash, whatever the samples, flags and appends.
#include "trace_random.h"

// Copies a trace through the public interface, as `ropsim convert` does.
static void convert(const char *from, const char *to, char hash[33])
{
    trace *trace;
    assert_int_equal(trace_open(from, NULL, &trace), STATUS_OK);
    const trace_info *info = trace_get_info(trace);
    trace_writer *writer;
    assert_int_equal(trace_create(to, info, NULL, &writer), STATUS_OK);
    fragments run;
    assert_int_equal(trace_next(trace, &run), STATUS_OK);
    for (uint32_t d = 0; d < info->draw_count; d++) {
        assert_int_equal(trace_begin_draw(writer, info->draws[d].name, info->draws[d].class), STATUS_OK);
        for (; run.count > 0 && run.draw == d; assert_int_equal(trace_next(trace, &run), STATUS_OK))
            assert_int_equal(trace_append(writer, &run), STATUS_OK);
        assert_int_equal(trace_end_draw(writer, info->draws[d].triangles, info->draws[d].vertices), STATUS_OK);
    }
    assert_int_equal(trace_finish(writer, hash), STATUS_OK);
    trace_close(trace);
}

static void assert_same_bytes(const char *a, const char *b)
{
    size_t a_size, b_size;
    uint8_t *a_bytes = file_bytes(a, &a_size), *b_bytes = file_bytes(b, &b_size);
    assert_int_equal(a_size, b_size);
    assert_memory_equal(a_bytes, b_bytes, a_size);
    free(a_bytes);
    free(b_bytes);
}

static void check_round_trip(uint64_t seed, uint32_t samples, int depth_bits, bool nonfinite, uint32_t count)
{
    memory_trace *expected = random_trace(seed, samples, depth_bits, nonfinite, count);
    char hash[33], other[33];
    assert_int_equal(write_trace(expected, test_path("a.ropt"), NULL, hash), STATUS_OK);
    assert_int_equal(write_trace(expected, test_path("a.rtxt"), NULL, other), STATUS_OK);
    assert_string_equal(hash, other);
    for (int form = 0; form < 2; form++) {
        const char *path = test_path(form ? "a.rtxt" : "a.ropt");
        trace *trace;
        assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
        assert_same_info(trace_get_info(trace), expected);
        assert_string_equal(trace_get_info(trace)->hash, hash);
        assert_same_fragments(trace, expected);
        assert_int_equal(trace_rewind(trace), STATUS_OK);
        assert_same_fragments(trace, expected);
        trace_close(trace);
        assert_int_equal(trace_check(path, NULL), STATUS_OK);
    }
    convert(test_path("a.ropt"), test_path("b.rtxt"), other);
    convert(test_path("b.rtxt"), test_path("b.ropt"), other);
    assert_string_equal(hash, other);
    assert_same_bytes(test_path("a.rtxt"), test_path("b.rtxt"));
    assert_same_bytes(test_path("a.ropt"), test_path("b.ropt"));
    free(expected);
}

static void test_samples_and_depths(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (uint32_t samples = 1; samples <= 16; samples *= 2)
        for (int depth_bits = 32; depth_bits <= 64; depth_bits += 32)
            for (int nonfinite = 0; nonfinite < 2; nonfinite++)
                for (uint32_t count = 1; count < 4000; count = 4 * count + 3)
                    check_round_trip(seed++, samples, depth_bits, nonfinite, count);
}

static void test_no_fragments(void **state)
{
    (void)state;
    check_round_trip(7, 1, 64, false, 0);
}

static void test_several_blocks(void **state)
{
    (void)state;
    check_round_trip(2, 1, 64, false, 65536);
    check_round_trip(3, 4, 64, true, RANDOM_MAX);
}

// A hash that changes with the library, the compiler or the machine would break every stored result.
static void test_hash_is_stable(void **state)
{
    (void)state;
    trace *trace;
    assert_int_equal(trace_open(ROPSIM_SOURCE "/traces/figure2.rtxt", NULL, &trace), STATUS_OK);
    assert_string_equal(trace_get_info(trace)->hash, "d669b3058ed4b67efb4206cdf658017d");
    trace_close(trace);
    assert_int_equal(trace_open(ROPSIM_SOURCE "/traces/edge_samples.rtxt", NULL, &trace), STATUS_OK);
    assert_string_equal(trace_get_info(trace)->hash, "fc959443677f6bdd2f2e94d82a7e08cc");
    trace_close(trace);
}

static void test_draws_without_fragments(void **state)
{
    (void)state;
    memory_trace *trace = random_trace(9, 1, 64, false, 0);
    char hash[33], other[33];
    trace->info.draw_count = 3;
    for (int d = 0; d < 3; d++)
        snprintf(trace->draws[d].name, NAME_SIZE, "empty%d", d);
    assert_int_equal(write_trace(trace, test_path("e.ropt"), NULL, hash), STATUS_OK);
    convert(test_path("e.ropt"), test_path("e.rtxt"), other);
    assert_string_equal(hash, other);
    assert_int_equal(trace_check(test_path("e.rtxt"), NULL), STATUS_OK);
    free(trace);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_samples_and_depths),      cmocka_unit_test(test_no_fragments),
        cmocka_unit_test(test_several_blocks),          cmocka_unit_test(test_hash_is_stable),
        cmocka_unit_test(test_draws_without_fragments),
    };
    return cmocka_run_group_tests(tests, NULL, remove_test_folder);
}
