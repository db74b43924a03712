// Machines: the shipped ones, settings on top, printing and reading back, the hash, every row of params.def.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <stdlib.h>
#include <unistd.h>

static void shipped_machines_have_their_limits(void **state)
{
    (void)state;
    machine g80, programmable, tiny;
    rop_limits limits;
    assert_int_equal(machine_load("g80", NULL, &g80), STATUS_OK);
    assert_int_equal(machine_load("programmable", NULL, &programmable), STATUS_OK);
    assert_int_equal(machine_load("tiny", NULL, &tiny), STATUS_OK);
    machine_limits(&g80, &limits);
    assert_string_equal(limits.machine, "g80");
    assert_true(limits.fixed_function);
    assert_int_equal(limits.depth_format, FORMAT_z24);
    assert_int_equal(limits.color_format, FORMAT_rgba8);
    assert_int_equal(limits.stencil_bits, 8);
    assert_false(limits.clip_interpolated);
    machine_limits(&programmable, &limits);
    assert_false(limits.fixed_function);
    assert_int_equal(limits.depth_format, FORMAT_z32f);
    assert_int_equal(limits.color_format, FORMAT_rgba32f);
    assert_int_equal(limits.opcodes, (UINT32_C(1) << OPCODE_COUNT) - 1);
    assert_int_equal(limits.formats, (UINT32_C(1) << FORMAT_COUNT) - 1);
    machine_limits(&tiny, &limits);
    assert_int_equal(limits.bits_per_sample_max, 1024);
    assert_int_equal(limits.instructions_max, 64);
}

static void unknown_machine_names_the_shipped_ones(void **state)
{
    (void)state;
    messages messages;
    machine machine;
    messages_start(&messages);
    assert_int_equal(machine_load("g8O", &messages.report, &machine), STATUS_REFUSED);
    assert_non_null(strstr(messages.text, "g80, modern, programmable, tiled, tiny"));
    assert_non_null(strstr(messages.text, "did you mean `g80`?"));
    messages_start(&messages);
    assert_int_equal(machine_load("./nowhere.yaml", &messages.report, &machine), STATUS_IO);
    assert_non_null(strstr(messages.text, "./nowhere.yaml"));
}

// What --set takes and refuses; a refusal leaves the machine as it was.
static void settings_are_checked(void **state)
{
    (void)state;
    static const struct {
        const char *assignment;
        status expected;
        const char *says;
    } cases[] = {
        {"depth_format=z16", STATUS_OK, ""},
        {"stencil_bits=1", STATUS_OK, ""},
        {"formats=z16,rgba8", STATUS_OK, ""},
        {"formats=[z16, rgba8]", STATUS_OK, ""},
        {"opcodes=all", STATUS_OK, ""},
        {"depth_format=z8", STATUS_REFUSED, "must be z16, z24 or z32f"},
        {"depth_format=rgba8", STATUS_REFUSED, "must be z16, z24 or z32f"},
        {"stencil_bits=0", STATUS_REFUSED, "an integer from 1 to 8 (bits)"},
        {"stencil_bits=9", STATUS_REFUSED, "an integer from 1 to 8 (bits)"},
        {"stencil_bits=08", STATUS_REFUSED, "an integer from 1 to 8"},
        {"stencil_bits=0x8", STATUS_REFUSED, "an integer from 1 to 8"},
        {"stencil_bits=4k", STATUS_REFUSED, "an integer from 1 to 8"},
        {"stencil_bits= 4", STATUS_REFUSED, "an integer from 1 to 8"},
        {"stencil_bits=", STATUS_REFUSED, "an integer from 1 to 8"},
        {"stencil_bits=-1", STATUS_REFUSED, "an integer from 1 to 8"},
        {"planes_max=99999999999999999999", STATUS_REFUSED, "an integer from 1 to 32"},
        {"fixed_function=yes", STATUS_REFUSED, "must be false or true"},
        {"range_clip=sorted", STATUS_REFUSED, "did you mean `stored`?"},
        {"formats=z16,z16", STATUS_REFUSED, "lists `z16` twice"},
        {"formats=z16,z25", STATUS_REFUSED, "did you mean `z24`?"},
        {"opcodes=lod", STATUS_REFUSED, "did you mean `ld`?"},
        {"stencil_bit=4", STATUS_REFUSED, "did you mean `stencil_bits`?"},
        {"elephants=4", STATUS_REFUSED, "ropsim machine --keys"},
        {"=4", STATUS_USAGE, "KEY=VALUE"},
        {"stencil_bits", STATUS_USAGE, "KEY=VALUE"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        messages messages;
        machine machine;
        char before[33], after[33];
        messages_start(&messages);
        assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
        machine_hash(&machine, before);
        assert_int_equal(machine_set(&machine, cases[i].assignment, &messages.report), cases[i].expected);
        machine_hash(&machine, after);
        if (!strstr(messages.text, cases[i].says))
            fail_msg("%s said: %s", cases[i].assignment, messages.text);
        if (cases[i].expected != STATUS_OK)
            assert_string_equal(before, after);
    }
}

// One value that each key accepts and that no shipped machine has; a new row of params.def asks for one here.
static const char *const other_values[] = {
    "fixed_function=true",     "depth_format=z16",    "color_format=rgba16f", "stencil_bits=3",
    "range_clip=interpolated", "formats=z24",         "opcodes=ld,st",        "planes_max=7",
    "list_entries_max=5", "bits_per_sample_max=77",  "color_targets_max=3", "instructions_max=33",
    "core_mhz=2",
    "partitions=2",
    "partition_row_step=1",
    "triangles_per_kiloclock=1001",
    "vertices_per_kiloclock=1001",
    "triangle_bytes=13",
    "vertex_bytes=25",
    "triangles_ahead=33",
    "raster_blocks_per_clock=2",
    "hierarchical_depth=true",
    "early_depth=true",
    "shader_operations_per_clock=5",
    "shader_operations_per_fragment=2",
    "shader_latency_cycles=1",
    "texture_samples_per_clock=5",
    "depth_samples_per_clock=5",
    "color_pixels_per_clock=5",
    "color_samples_per_clock=5",
    "blend_samples_per_clock=5",
    "blend_wide_samples_per_clock=5",
    "kernel_slots_per_clock=2",
    "kernel_guarded_slots=0",
    "rop_latency_cycles=5",
    "interlock=buckets",
    "interlock_buckets=65",
    "raster_queue=5",
    "shader_queue=17",
    "depth_queue=5",
    "color_queue=5",
    "line_bytes=257",
    "depth_cache_bytes=1025",
    "depth_cache_ways=5",
    "color_cache_bytes=1025",
    "color_cache_ways=5",
    "texture_cache_bytes=1025",
    "texture_cache_ways=5",
    "cache_misses_max=5",
    "l2_bytes=1",
    "l2_ways=17",
    "l2_bytes_per_clock=385",
    "l2_latency_cycles=1",
    "fast_clear=false",
    "clear_blocks_per_clock=2",
    "depth_compression=true",
    "color_compression=true",
    "compression_cycles=1",
    "tile_based=true",
    "region_pixels=64",
    "on_chip_bits=257",
    "on_chip_overflow=refuse",
    "binned_bytes=1",
    "memory_mhz=2",
    "memory_bytes_per_clock=9",
    "memory_burst_bytes=9",
    "memory_banks=2",
    "memory_row_bytes=2049",
    "memory_write_queue=5",
    "memory_latency_cycles=21",
    "memory_t_cl=1",
    "memory_t_wl=1",
    "memory_t_rcd=1",
    "memory_t_rp=1",
    "memory_t_ras=1",
    "memory_t_rc=1",
    "memory_t_rrd=1",
    "memory_t_wr=1",
    "memory_t_wtr=1",
};

// Each key changes the hash, is printed, and is read back from what was printed.
static void every_key_prints_and_reads_back(void **state)
{
    (void)state;
    int keys = 0;
#define PARAM_INT(key, min, max, unit, meaning) keys++;
#define PARAM_BOOL(key, meaning) keys++;
#define PARAM_FORMAT(key, class, meaning) keys++;
#define PARAM_CHOICE(key, words, meaning) keys++;
#define PARAM_SET(key, table, meaning) keys++;
#include "../../sim/params.def"
    assert_int_equal(keys, sizeof other_values / sizeof *other_values);
    char path[] = "/tmp/ropsim_machine_XXXXXX.yaml";
    int descriptor = mkstemps(path, 5);
    assert_true(descriptor >= 0);
    close(descriptor);
    for (size_t i = 0; i < sizeof other_values / sizeof *other_values; i++) {
        machine machine, again;
        char original[33], changed[33], reread[33];
        assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
        machine_hash(&machine, original);
        assert_int_equal(machine_set(&machine, other_values[i], NULL), STATUS_OK);
        machine_hash(&machine, changed);
        assert_string_not_equal(original, changed);
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        assert_int_equal(machine_print(&machine, file), STATUS_OK);
        fclose(file);
        assert_int_equal(machine_load(path, NULL, &again), STATUS_OK);
        machine_hash(&again, reread);
        assert_string_equal(changed, reread);
    }
    unlink(path);
}

// A machine always has its own default formats, whatever its list says.
static void own_formats_are_always_there(void **state)
{
    (void)state;
    machine machine;
    rop_limits limits;
    assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
    assert_int_equal(machine_set(&machine, "formats=u8", NULL), STATUS_OK);
    machine_limits(&machine, &limits);
    assert_int_equal(limits.formats, 1u << FORMAT_u8 | 1u << FORMAT_z32f | 1u << FORMAT_rgba32f);
}

static void nearest_word_guesses_only_what_is_close(void **state)
{
    (void)state;
    static const char *const words[] = {"record", "replay", "report"};
    assert_string_equal(nearest_word("recrod", words, 3), "record");
    assert_string_equal(nearest_word("replaay", words, 3), "replay");
    assert_null(nearest_word("zebra", words, 3));
    assert_null(nearest_word("", words, 3));
    assert_null(nearest_word("record", words, 0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shipped_machines_have_their_limits),
        cmocka_unit_test(unknown_machine_names_the_shipped_ones),
        cmocka_unit_test(settings_are_checked),
        cmocka_unit_test(every_key_prints_and_reads_back),
        cmocka_unit_test(own_formats_are_always_there),
        cmocka_unit_test(nearest_word_guesses_only_what_is_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
