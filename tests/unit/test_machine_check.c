// Contradictions between a machine's keys: each is refused by name, with what would be accepted; shipped machines have
// none.
#include "messages.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>

static void shipped_machines_have_none(void **state)
{
    (void)state;
    char names[64][NAME_SIZE];
    const int count = data_names("machines", ".yaml", names, 64);
    assert_true(count > 0);
    for (int i = 0; i < count; i++) {
        machine machine;
        messages messages;
        messages_start(&messages);
        assert_int_equal(machine_load(names[i], &messages.report, &machine), STATUS_OK);
        if (machine_check(&machine, &messages.report) != STATUS_OK)
            fail_msg("%s: %s", names[i], messages.text);
    }
}

static void contradictions_are_refused(void **state)
{
    (void)state;
    // g80: lines of 256 bytes, caches of 4 ways, bursts of 32 bytes, rows of 2048, 6 partitions, 16 ways of the second
    // level.
    static const struct {
        const char *set, *said;
    } cases[] = {
        {"depth_cache_bytes=16000",
         "depth_cache_bytes is 16000, but must be a multiple of depth_cache_ways * line_bytes, which is 1024"},
        {"depth_cache_bytes=512",
         "depth_cache_bytes is 512, but must be a multiple of depth_cache_ways * line_bytes, which is 1024"},
        {"color_cache_ways=3",
         "color_cache_bytes is 16384, but must be a multiple of color_cache_ways * line_bytes, which is 768"},
        {"texture_cache_ways=128",
         "texture_cache_bytes is 16384, but must be a multiple of texture_cache_ways * line_bytes, which is 32768"},
        {"l2_bytes=65536",
         "l2_bytes is 65536, but must be a multiple of partitions * l2_ways * line_bytes, which is 24576"},
        {"region_pixels=12", "region_pixels is 12, but must be a multiple of a block's side in pixels, which is 8"},
        {"memory_burst_bytes=48", "line_bytes is 256, but must be a multiple of memory_burst_bytes, which is 48"},
        {"memory_row_bytes=2000", "memory_row_bytes is 2000, but must be a multiple of line_bytes, which is 256"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        machine machine;
        messages messages;
        messages_start(&messages);
        assert_int_equal(machine_load("g80", &messages.report, &machine), STATUS_OK);
        assert_int_equal(machine_set(&machine, cases[i].set, &messages.report), STATUS_OK);
        assert_int_equal(machine_check(&machine, &messages.report), STATUS_REFUSED);
        assert_int_equal(messages.count, 1);
        if (!strstr(messages.text, cases[i].said))
            fail_msg("%s: `%s` is not in: %s", cases[i].set, cases[i].said, messages.text);
    }
}

static void every_reason_is_said(void **state)
{
    (void)state;
    machine machine;
    messages messages;
    messages_start(&messages);
    assert_int_equal(machine_load("g80", NULL, &machine), STATUS_OK);
    machine.line_bytes = 192;
    machine.region_pixels = 9;
    assert_int_equal(machine_check(&machine, &messages.report), STATUS_REFUSED);
    // The line itself, the row, three caches (16384 is no multiple of 768), the region.
    assert_int_equal(messages.count, 6);
    assert_non_null(strstr(messages.text, "line_bytes is 192, but must be a power of two: 16, 32, 64 and so on"));
    assert_non_null(strstr(messages.text, "region_pixels is 9"));
}

static void what_is_allowed(void **state)
{
    (void)state;
    static const char *const sets[] = {"l2_bytes=0",    "l2_bytes=24576",  "depth_cache_ways=64",
                                       "line_bytes=32", "line_bytes=2048", "partition_row_step=63",
                                       "memory_t_rc=1", "partitions=5"};
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        machine machine;
        messages messages;
        messages_start(&messages);
        assert_int_equal(machine_load("g80", NULL, &machine), STATUS_OK);
        assert_int_equal(machine_set(&machine, sets[i], NULL), STATUS_OK);
        if (machine_check(&machine, &messages.report) != STATUS_OK)
            fail_msg("%s: %s", sets[i], messages.text);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shipped_machines_have_none),
        cmocka_unit_test(contradictions_are_refused),
        cmocka_unit_test(every_reason_is_said),
        cmocka_unit_test(what_is_allowed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
