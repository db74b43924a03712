// Dice in, a machine with every key of time and traffic thrown out, so that its keys do not contradict each other.
//
// Small numbers are frequent: queues of one, caches of one line a set, latencies of 0, clocks that do not divide each other.
#include "tick_compare.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>
#include <cmocka.h>

static int64_t among(dice *dice, const int64_t *values, uint32_t count)
{
    return values[dice_below(dice, count)];
}
#define AMONG(...)                                                                                                     \
    among(dice, (const int64_t[]){__VA_ARGS__}, (uint32_t)(sizeof((const int64_t[]){__VA_ARGS__}) / sizeof(int64_t)))

static int64_t between(dice *dice, int64_t least, int64_t most)
{
    return least + dice_below(dice, (uint32_t)(most - least + 1));
}

static void throw_rates(dice *dice, machine *m)
{
    m->triangles_per_kiloclock = AMONG(70, 333, 1000, 11000);
    m->vertices_per_kiloclock = AMONG(90, 500, 1000, 11000);
    m->triangle_bytes = AMONG(0, 12, 50);
    m->vertex_bytes = AMONG(0, 24, 100);
    m->triangles_ahead = AMONG(1, 2, 5, 32);
    m->raster_blocks_per_clock = AMONG(1, 2, 3, 7, 11);
    m->hierarchical_depth = dice_chance(dice, 50);
    m->early_depth = dice_chance(dice, 50);
    m->shader_operations_per_clock = AMONG(3, 64, 100, 1000, 16384);
    m->shader_operations_per_fragment = AMONG(0, 1, 7, 12);
    m->shader_latency_cycles = AMONG(0, 0, 1, 30, 100);
    m->texture_samples_per_clock = AMONG(2, 7, 64, 512);
    m->depth_samples_per_clock = AMONG(3, 16, 96, 704);
    m->color_pixels_per_clock = AMONG(3, 16, 24, 176);
    m->color_samples_per_clock = AMONG(3, 24, 96, 704);
    m->blend_samples_per_clock = AMONG(3, 12, 44, 1000);
    m->blend_wide_samples_per_clock = AMONG(2, 6, 44, 1000);
    m->kernel_slots_per_clock = AMONG(1, 6, 7, 44);
    m->rop_latency_cycles = AMONG(0, 0, 1, 4, 8, 20);
    m->interlock = (int)dice_below(dice, 3);
    m->interlock_buckets = AMONG(1, 2, 7, 64);
}

static void throw_queues(dice *dice, machine *m)
{
    m->raster_queue = AMONG(1, 1, 2, 4, 16);
    m->shader_queue = AMONG(1, 1, 3, 8, 96);
    m->depth_queue = AMONG(1, 1, 3, 8, 64);
    m->color_queue = AMONG(1, 1, 3, 8, 64);
    m->cache_misses_max = AMONG(1, 1, 2, 5, 64);
}

static int64_t cache_bytes(dice *dice, const machine *m, int64_t ways)
{
    return m->line_bytes * ways * AMONG(1, 1, 2, 3, 16);
}

static void throw_caches(dice *dice, machine *m)
{
    m->line_bytes = AMONG(64, 128, 256, 256, 1024);
    m->depth_cache_ways = AMONG(1, 1, 2, 4);
    m->color_cache_ways = AMONG(1, 1, 2, 4);
    m->texture_cache_ways = AMONG(1, 1, 2, 4);
    m->depth_cache_bytes = cache_bytes(dice, m, m->depth_cache_ways);
    m->color_cache_bytes = cache_bytes(dice, m, m->color_cache_ways);
    m->texture_cache_bytes = cache_bytes(dice, m, m->texture_cache_ways);
    m->l2_ways = AMONG(1, 2, 4);
    m->l2_bytes = dice_chance(dice, 40) ? m->partitions * m->l2_ways * m->line_bytes * AMONG(1, 4, 32) : 0;
    m->l2_bytes_per_clock = AMONG(5, 64, 384, 5120);
    m->l2_latency_cycles = AMONG(0, 1, 50, 200);
    m->fast_clear = dice_chance(dice, 60);
    m->clear_blocks_per_clock = AMONG(1, 3, 64);
    m->depth_compression = dice_chance(dice, 50);
    m->color_compression = dice_chance(dice, 50);
    m->compression_cycles = AMONG(0, 1, 8, 40);
    m->tile_based = dice_chance(dice, 25);
    m->region_pixels = AMONG(8, 16, 32);
    m->on_chip_bits = AMONG(32, 128, 512);
    m->on_chip_overflow = 1;
    m->binned_bytes = AMONG(0, 16, 32, 100);
}

static void throw_memory(dice *dice, machine *m)
{
    m->memory_mhz = AMONG(1, 100, 575, 900, 1600, 2625);
    m->memory_bytes_per_clock = AMONG(4, 8, 16, 32);
    m->memory_burst_bytes = AMONG(8, 16, 32, 64);
    m->memory_banks = AMONG(1, 2, 8, 16);
    m->memory_row_bytes = AMONG(1024, 2048);
    m->memory_write_queue = AMONG(1, 2, 5, 16, 64);
    m->memory_latency_cycles = AMONG(0, 1, 20, 150);
    int64_t *times[] = {&m->memory_t_cl,  &m->memory_t_wl, &m->memory_t_rcd, &m->memory_t_rp, &m->memory_t_ras,
                        &m->memory_t_rc, &m->memory_t_rrd, &m->memory_t_wr, &m->memory_t_wtr};
    const int64_t most = AMONG(0, 3, 12, 40);
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        *times[i] = between(dice, 0, most);
}

void tick_random_machine(dice *dice, const char *name, machine *m)
{
    random_machine(dice, name, m);
    m->core_mhz = AMONG(1, 333, 575, 650, 2520);
    m->partitions = between(dice, 1, 7);
    m->partition_row_step = between(dice, 0, 6);
    throw_rates(dice, m);
    throw_queues(dice, m);
    throw_caches(dice, m);
    throw_memory(dice, m);
    // A memory of a kilobyte a second would only take long.
    if (m->memory_mhz * 20 < m->core_mhz)
        m->memory_mhz = m->core_mhz / 3 + 1;
    assert_int_equal(machine_check(m, &printing), STATUS_OK);
}
