// The DRAM channel against a machine that ticks (channel_ticks.h), over random timings and streams; and what holds for
// every stream: nothing beats the data bus, a wider bus is never slower for reads. Prints its speed.
#include "channel_ticks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <time.h>
#include <cmocka.h>

enum { STREAMS = 3000, CALLS = 60 };

static uint64_t seed;

// SplitMix64.
static uint64_t random_bits(void)
{
    uint64_t z = seed += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static int64_t up_to(int64_t most)
{
    return (int64_t)(random_bits() % (uint64_t)(most + 1));
}

// One in three times is zero; now and then the write latency exceeds all of a read.
static int64_t random_time(int64_t most)
{
    return up_to(2) == 0 ? 0 : up_to(most);
}

static channel_timing random_timing(void)
{
    const int64_t bursts[] = {1, 8, 12, 32, 64}, burst = bursts[up_to(4)];
    const int64_t per_clock[] = {1, 4, 16, 24, 64};
    channel_timing t = {
        .core_mhz = 1 + up_to(up_to(1) ? 3 : 999),
        .memory_mhz = 1 + up_to(up_to(1) ? 3 : 999),
        .bytes_per_clock = per_clock[up_to(4)],
        .burst_bytes = burst,
        .banks = 1 + up_to(7),
        .row_bytes = burst * (1 + up_to(15)),
        .t_cl = random_time(12),
        .t_wl = random_time(up_to(5) ? 8 : 40),
        .t_rcd = random_time(14),
        .t_rp = random_time(12),
        .t_ras = random_time(30),
        .t_rc = random_time(40),
        .t_rrd = random_time(10),
        .t_wr = random_time(12),
        .t_wtr = random_time(8),
        .latency_cycles = random_time(100),
        .write_queue = 1 + up_to(up_to(1) ? 3 : 15),
    };
    // Clocks a thousand apart make the ticking machine tick for ever.
    if (t.memory_mhz > 8 * t.core_mhz)
        t.memory_mhz = 8 * t.core_mhz;
    if (t.core_mhz > 8 * t.memory_mhz)
        t.core_mhz = 8 * t.memory_mhz;
    return t;
}

typedef struct call {
    uint64_t gap, address;
    uint32_t bytes;
    bool write;
} call;

static void random_calls(const channel_timing *t, call *calls, int count)
{
    const int64_t rows = 1 + up_to(3 * t->banks), writes = up_to(4), gap = up_to(3);
    const int64_t sizes = 1 + up_to(up_to(3) ? 2 * t->burst_bytes : 3 * t->row_bytes), stride = up_to(2);
    uint64_t next = 0;
    for (int i = 0; i < count; i++) {
        calls[i].bytes = (uint32_t)(1 + up_to(sizes - 1));
        calls[i].write = up_to(4) < writes;
        calls[i].gap = (uint64_t)(gap == 0   ? 0
                                  : gap == 1 ? up_to(2)
                                  : gap == 2 ? up_to(30)
                                  : up_to(3) ? 0
                                             : up_to(200));
        calls[i].address = stride ? next : (uint64_t)up_to(rows * t->row_bytes);
        next = (next + calls[i].bytes) % (uint64_t)(rows * t->row_bytes);
    }
}

static void agrees_with_the_ticking_machine(void **state)
{
    (void)state;
    static ticks ticking;
    channel_counts sum = {0};
    for (int stream = 0; stream < STREAMS; stream++) {
        seed = (uint64_t)stream;
        const channel_timing t = random_timing();
        call calls[CALLS];
        random_calls(&t, calls, CALLS);
        channel *c = channel_create(&t);
        assert_non_null(c);
        ticks_start(&ticking, &t);
        uint64_t now = 0;
        for (int i = 0; i < CALLS; i++) {
            now += calls[i].gap;
            bool failed = false;
            if (!calls[i].write) {
                uint64_t done = channel_read(c, now, calls[i].address, calls[i].bytes);
                uint64_t wanted = ticks_read(&ticking, now, calls[i].address, calls[i].bytes);
                failed = done != wanted;
            } else {
                uint64_t when = 0, wanted = 0;
                bool taken = channel_write(c, now, calls[i].address, calls[i].bytes, &when);
                failed =
                    taken != ticks_write(&ticking, now, calls[i].address, calls[i].bytes, &wanted) || when != wanted;
                if (!taken) {
                    failed |= when <= now;
                    if (stream % 2 == 0 && i > 0 && !calls[i - 1].write) {
                        // Reads may come between; they do not take the place away.
                        uint64_t done = channel_read(c, now, calls[i - 1].address, 1);
                        failed |= done != ticks_read(&ticking, now, calls[i - 1].address, 1);
                    }
                    now = when;
                    failed |= !channel_write(c, now, calls[i].address, calls[i].bytes, &when);
                    failed |= !ticks_write(&ticking, now, calls[i].address, calls[i].bytes, &wanted);
                }
            }
            if (!failed && up_to(60) == 0)
                failed = channel_drain(c, now) != ticks_drain(&ticking, now);
            if (failed)
                fail_msg("stream %d, call %d: not as the ticking machine", stream, i);
        }
        assert_int_equal(channel_drain(c, now), ticks_drain(&ticking, now));
        const channel_counts *counts = channel_get_counts(c);
        assert_int_equal(counts->writes, counts->writes_idle + counts->writes_forced + counts->writes_overlapped +
                                             counts->writes_drained);
        assert_int_equal(counts->busy_clocks,
                         (counts->bytes_read + counts->bytes_written) / (uint64_t)t.burst_bytes *
                             (uint64_t)((t.burst_bytes + t.bytes_per_clock - 1) / t.bytes_per_clock));
        sum.reads += counts->reads;
        sum.writes += counts->writes;
        sum.writes_idle += counts->writes_idle;
        sum.writes_forced += counts->writes_forced;
        sum.writes_overlapped += counts->writes_overlapped;
        sum.writes_refused += counts->writes_refused;
        sum.turnarounds += counts->turnarounds;
        sum.row_hits += counts->row_hits;
        sum.row_misses += counts->row_misses;
        channel_destroy(c);
    }
    print_message(
        "%d streams: %lu reads, %lu writes (%lu idle, %lu forced, %lu overlapped), %lu refused, %lu turnarounds, "
        "%lu hits, %lu misses\n",
        STREAMS, sum.reads, sum.writes, sum.writes_idle, sum.writes_forced, sum.writes_overlapped, sum.writes_refused,
        sum.turnarounds, sum.row_hits, sum.row_misses);
    assert_true(sum.writes_idle > 1000 && sum.writes_forced > 1000 && sum.writes_overlapped > 1000 &&
                sum.writes_refused > 1000 && sum.row_hits > 1000 && sum.row_misses > 1000);
}

// From the first request on, the data bus moves at most bytes_per_clock.
static void nothing_beats_the_bus(void **state)
{
    (void)state;
    for (int stream = 0; stream < STREAMS; stream++) {
        seed = (uint64_t)stream + 1000000;
        const channel_timing t = random_timing();
        call calls[CALLS];
        random_calls(&t, calls, CALLS);
        channel *c = channel_create(&t);
        assert_non_null(c);
        uint64_t now = 0, asked = 0;
        for (int i = 0; i < CALLS; i++) {
            now += calls[i].gap;
            asked += calls[i].bytes;
            uint64_t when;
            if (!calls[i].write) {
                uint64_t done = channel_read(c, now, calls[i].address, calls[i].bytes);
                assert_true(done * (uint64_t)t.memory_mhz * (uint64_t)t.bytes_per_clock >=
                            calls[i].bytes * (uint64_t)t.core_mhz);
            } else if (!channel_write(c, now, calls[i].address, calls[i].bytes, &when)) {
                now = when;
                assert_true(channel_write(c, now, calls[i].address, calls[i].bytes, &when));
            }
        }
        const uint64_t end = channel_drain(c, now);
        const channel_counts *counts = channel_get_counts(c);
        assert_true(counts->bytes_read + counts->bytes_written >= asked);
        assert_true(end * (uint64_t)t.memory_mhz * (uint64_t)t.bytes_per_clock >=
                    (counts->bytes_read + counts->bytes_written) * (uint64_t)t.core_mhz);
        channel_destroy(c);
    }
}

// A theorem for reads alone: which rows are hit follows from their order, and every time is a maximum of sums that grow
// with the length of a transfer. It is none for writes: with another bus other writes slip in between the reads.
static void a_wider_bus_never_slows_reads(void **state)
{
    (void)state;
    for (int stream = 0; stream < STREAMS; stream++) {
        seed = (uint64_t)stream + 2000000;
        const channel_timing narrow = random_timing();
        channel_timing wide = narrow;
        wide.bytes_per_clock *= 2;
        call calls[CALLS];
        random_calls(&narrow, calls, CALLS);
        channel *a = channel_create(&narrow), *b = channel_create(&wide);
        assert_true(a && b);
        uint64_t now = 0;
        for (int i = 0; i < CALLS; i++) {
            now += calls[i].gap;
            assert_true(channel_read(b, now, calls[i].address, calls[i].bytes) <=
                        channel_read(a, now, calls[i].address, calls[i].bytes));
        }
        channel_destroy(a);
        channel_destroy(b);
    }
}

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

// Said, not judged: machines differ.
static void speed(void **state)
{
    (void)state;
    enum { REQUESTS = 2000000 };
    const channel_timing gddr3 = {575, 900, 16, 32, 8, 2048, 10, 7, 12, 10, 25, 35, 8, 11, 6, 100, 32};
    seed = 1;
    uint64_t *addresses = malloc(REQUESTS * sizeof *addresses);
    assert_non_null(addresses);
    for (int i = 0; i < REQUESTS; i++)
        addresses[i] = (uint64_t)up_to(1 << 26);
    for (int writes = 0; writes < 2; writes++) {
        channel *c = channel_create(&gddr3);
        assert_non_null(c);
        uint64_t now = 0, when;
        const double start = seconds_now();
        for (int i = 0; i < REQUESTS; i++) {
            now += 11;
            if (!writes || i % 2)
                now = channel_read(c, now, addresses[i], 256) > now + 2000 ? now + 100 : now;
            else if (!channel_write(c, now, addresses[i], 256, &when))
                channel_write(c, now = when, addresses[i], 256, &when);
        }
        print_message("%s: %.1f ns a request\n", writes ? "reads and writes" : "reads",
                      (seconds_now() - start) * 1e9 / REQUESTS);
        channel_destroy(c);
    }
    free(addresses);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(agrees_with_the_ticking_machine),
        cmocka_unit_test(nothing_beats_the_bus),
        cmocka_unit_test(a_wider_bus_never_slows_reads),
        cmocka_unit_test(speed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
