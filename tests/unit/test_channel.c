// The DRAM channel by hand: single requests whose cycle is worked out beside them, limits between two requests, posted
// writes, and streams that must reach the peak of the data bus.
#include "../../sim/clock/channel.h"

#include <stdarg.h>
#include <setjmp.h>
#include <string.h>
#include <cmocka.h>

// One clock, so that all figures are of one kind; a burst takes 2 of them. Row 0 of banks 0 to 3 lies at 0, 1024, 2048,
// 3072; row 1 of banks 1, 2, 3, 0 from 4096 on.
static const channel_timing plain = {
    .core_mhz = 1,
    .memory_mhz = 1,
    .bytes_per_clock = 16,
    .burst_bytes = 32,
    .banks = 4,
    .row_bytes = 1024,
    .t_cl = 10,
    .t_wl = 7,
    .t_rcd = 12,
    .t_rp = 10,
    .t_ras = 25,
    .t_rc = 35,
    .t_rrd = 8,
    .t_wr = 11,
    .t_wtr = 6,
    .latency_cycles = 100,
    .write_queue = 4,
};
static const channel_timing gddr3 = {
    .core_mhz = 575,
    .memory_mhz = 900,
    .bytes_per_clock = 16,
    .burst_bytes = 32,
    .banks = 8,
    .row_bytes = 2048,
    .t_cl = 10,
    .t_wl = 7,
    .t_rcd = 12,
    .t_rp = 10,
    .t_ras = 25,
    .t_rc = 35,
    .t_rrd = 8,
    .t_wr = 11,
    .t_wtr = 6,
    .latency_cycles = 100,
    .write_queue = 32,
};
enum { BANK_1 = 1024, ROW_1 = 7168 };

static channel *start(const channel_timing *timing)
{
    assert_null(channel_timing_fault(timing));
    channel *c = channel_create(timing);
    assert_non_null(c);
    return c;
}

// A write that must be taken.
static void post(channel *c, uint64_t time, uint64_t address, uint32_t bytes)
{
    uint64_t when;
    assert_true(channel_write(c, time, address, bytes, &when));
}

// ---- Reads ---------------------------------------------------------------------------------------------

static void one_read_of_a_closed_bank(void **state)
{
    (void)state;
    channel *c = start(&plain);
    // Activate 50, column 62, data 72 to 88.
    assert_int_equal(channel_read(c, 50, 0, 256), 50 + 12 + 10 + 16 + 100);
    assert_int_equal(channel_get_counts(c)->row_empty, 1);
    assert_int_equal(channel_get_counts(c)->busy_clocks, 16);
    channel_destroy(c);
}

static void two_clocks_are_rounded_up_each_way(void **state)
{
    (void)state;
    // Core cycle 23 is memory clock 36; data end at 36 + 38 = 74, core cycle 47.3.
    channel *c = start(&gddr3);
    assert_int_equal(channel_read(c, 23, 0, 256), 48 + 100);
    channel_destroy(c);
    // Core cycle 24 is memory clock 37.6; data end at 76, core cycle 48.6.
    c = start(&gddr3);
    assert_int_equal(channel_read(c, 24, 0, 256), 49 + 100);
    channel_destroy(c);
}

static void late_times_do_not_overflow(void **state)
{
    (void)state;
    __extension__ typedef unsigned __int128 wide;
    const int64_t mhz[][2] = {{575, 900}, {CHANNEL_MHZ_MAX, 1}, {1, CHANNEL_MHZ_MAX}, {32767, CHANNEL_MHZ_MAX}};
    for (size_t i = 0; i < sizeof mhz / sizeof *mhz; i++) {
        channel_timing t = gddr3;
        t.core_mhz = mhz[i][0];
        t.memory_mhz = mhz[i][1];
        channel *c = start(&t);
        const uint64_t time = ((uint64_t)1 << 48) - 7;
        const wide arrival = ((wide)time * (wide)t.memory_mhz + (wide)t.core_mhz - 1) / (wide)t.core_mhz;
        const wide end = ((arrival + 38) * (wide)t.core_mhz + (wide)t.memory_mhz - 1) / (wide)t.memory_mhz;
        assert_int_equal(channel_read(c, time, 0, 256), (uint64_t)end + 100);
        channel_destroy(c);
    }
}

static void a_row_hit(void **state)
{
    (void)state;
    channel *c = start(&plain);
    assert_int_equal(channel_read(c, 0, 0, 32), 12 + 10 + 2 + 100);  // column 12, data 22 to 24
    assert_int_equal(channel_read(c, 1, 32, 32), 26 + 100);          // the bus is free at 24
    assert_int_equal(channel_read(c, 50, 992, 32), 50 + 10 + 2 + 100);
    assert_int_equal(channel_get_counts(c)->row_hits, 2);
    channel_destroy(c);
}

static void a_row_conflict(void **state)
{
    (void)state;
    // Activate 0, column 12. Precharge not before 25 (RAS), activate 35, column 47, data 57.
    channel *c = start(&plain);
    channel_read(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 5, ROW_1, 32), 59 + 100);
    // And once all that is long over: precharge 200, activate 210, column 222, data 232.
    assert_int_equal(channel_read(c, 200, 0, 32), 234 + 100);
    assert_int_equal(channel_get_counts(c)->row_misses, 2);
    channel_destroy(c);
    // The first read's last burst is over at the bank at 12 + 64 = 76: activate 86, column 98, data 108.
    c = start(&plain);
    channel_read(c, 0, 0, 1024);
    assert_int_equal(channel_read(c, 5, ROW_1, 32), 110 + 100);
    channel_destroy(c);
}

static void activates_of_one_bank_keep_apart(void **state)
{
    (void)state;
    channel_timing t = plain;
    t.t_rp = 4;  // precharge 25 and activate 29, were it not for RC
    channel *c = start(&t);
    channel_read(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 5, ROW_1, 32), 35 + 12 + 10 + 2 + 100);
    channel_destroy(c);
    t.t_rc = 0;
    c = start(&t);
    channel_read(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 5, ROW_1, 32), 29 + 12 + 10 + 2 + 100);
    channel_destroy(c);
}

static void activates_of_two_banks_keep_apart(void **state)
{
    (void)state;
    channel *c = start(&plain);
    channel_read(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 1, BANK_1, 32), 8 + 12 + 10 + 2 + 100);
    channel_destroy(c);
    channel_timing t = plain;
    t.t_rrd = 0;  // activate 1, column 13, data 23 were the bus free before 24
    c = start(&t);
    channel_read(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 1, BANK_1, 32), 26 + 100);
    channel_destroy(c);
}

static void no_timings_leave_latency_and_transfer(void **state)
{
    (void)state;
    const channel_timing t = {.core_mhz = 1,
                              .memory_mhz = 1,
                              .bytes_per_clock = 16,
                              .burst_bytes = 32,
                              .banks = 1,
                              .row_bytes = 1024,
                              .latency_cycles = 100,
                              .write_queue = 1};
    channel *c = start(&t);
    for (uint64_t time = 7; time < 700; time += 16)
        assert_int_equal(channel_read(c, time, time * 1024, 256), time + 16 + 100);
    // A queue of one place holds nobody up: a write starts in the clock in which it comes.
    for (uint64_t time = 1000; time < 1100; time += 2)
        post(c, time, time * 1024, 32);
    assert_int_equal(channel_drain(c, 1100), 1100);
    channel_destroy(c);
}

static void the_port_takes_one_request_a_core_cycle(void **state)
{
    (void)state;
    const channel_timing t = {.core_mhz = 1,
                              .memory_mhz = 4,
                              .bytes_per_clock = 16,
                              .burst_bytes = 16,
                              .banks = 1,
                              .row_bytes = 1024,
                              .write_queue = 8};
    channel *c = start(&t);
    for (uint64_t i = 0; i < 5; i++)
        assert_int_equal(channel_read(c, 10, 0, 16), 10 + i + 1);  // in memory clock 40 + 4i, for one clock
    post(c, 10, 0, 16);                                            // core cycle 15
    assert_int_equal(channel_read(c, 16, 0, 16), 17);
    channel_destroy(c);
}

static void transfers_are_whole_bursts_of_one_row(void **state)
{
    (void)state;
    channel *c = start(&plain);
    const channel_counts *counts = channel_get_counts(c);
    channel_read(c, 0, 5, 1);
    assert_int_equal(counts->bytes_read, 32);
    channel_read(c, 1, 31, 2);
    assert_int_equal(counts->bytes_read, 32 + 64);
    assert_int_equal(counts->row_hits, 1);
    // Bank 0's last burst and bank 1's first. Bank 1: activate 200, column 212, data 222.
    assert_int_equal(channel_read(c, 200, 1023, 2), 224 + 100);
    assert_int_equal(counts->row_hits, 2);
    assert_int_equal(counts->row_empty, 2);
    // Four whole rows: banks 2, 3, then row 1 of banks 1, 2.
    channel_read(c, 400, 2048, 4096);
    assert_int_equal(counts->row_empty, 4);
    assert_int_equal(counts->row_misses, 2);
    assert_int_equal(counts->reads, 4);
    channel_destroy(c);
}

// ---- Writes --------------------------------------------------------------------------------------------

static void a_write_then_a_read(void **state)
{
    (void)state;
    // The idle channel writes at once: activate 0, column 12, data 19 to 21. A read's column command not before 27.
    channel *c = start(&plain);
    post(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 22, 64, 32), 27 + 10 + 2 + 100);
    assert_int_equal(channel_get_counts(c)->writes_idle, 1);
    assert_int_equal(channel_get_counts(c)->turnarounds, 1);
    channel_destroy(c);
    c = start(&plain);
    post(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 28, 64, 32), 28 + 10 + 2 + 100);
    channel_destroy(c);
    // Another row: precharge 21 + 11 = 32, activate 42, column 54, data 64.
    c = start(&plain);
    post(c, 0, 0, 32);
    assert_int_equal(channel_read(c, 22, ROW_1, 32), 66 + 100);
    channel_destroy(c);
}

static void a_read_then_a_write(void **state)
{
    (void)state;
    // The read's data end at 24, the write's start at 25.
    channel *c = start(&plain);
    channel_read(c, 0, 0, 32);
    post(c, 1, 32, 32);
    assert_int_equal(channel_drain(c, 2), 27);
    assert_int_equal(channel_get_counts(c)->writes_drained, 1);
    channel_destroy(c);
    // Left alone, the write's command goes out when the bus is free, at 24; its data start at 31.
    c = start(&plain);
    channel_read(c, 0, 0, 32);
    post(c, 1, 32, 32);
    assert_int_equal(channel_drain(c, 25), 33);
    assert_int_equal(channel_get_counts(c)->writes_idle, 1);
    assert_int_equal(channel_drain(c, 500), 500);
    channel_destroy(c);
}

static void reads_pass_writes_that_they_do_not_overlap(void **state)
{
    (void)state;
    channel *c = start(&plain);
    channel_read(c, 0, 0, 1024);  // data 22 to 86
    post(c, 1, BANK_1, 32);
    post(c, 2, BANK_1 + 64, 32);
    assert_int_equal(channel_read(c, 3, 0, 32), 88 + 100);
    assert_int_equal(channel_get_counts(c)->writes_overlapped, 0);
    // The first write: activate 8, data held back to 89 by the read before. Column command 91 + 6 = 97, data 107.
    assert_int_equal(channel_read(c, 4, BANK_1 + 31, 1), 109 + 100);
    assert_int_equal(channel_get_counts(c)->writes_overlapped, 1);
    assert_int_equal(channel_get_counts(c)->turnarounds, 2);
    // The second: data 110 to 112, the next read's column command 118.
    assert_int_equal(channel_read(c, 5, BANK_1 + 64, 32), 130 + 100);
    channel_destroy(c);
}

static void a_full_queue_refuses_until_its_oldest_leaves(void **state)
{
    (void)state;
    channel *c = start(&plain);
    const channel_counts *counts = channel_get_counts(c);
    uint64_t when = 0;
    channel_read(c, 0, 0, 1024);  // data 22 to 86
    for (uint64_t i = 0; i < 4; i++)
        post(c, 1 + i, 32 * i, 32);
    // Two of four are put to work, data 87 to 89 and 89 to 91.
    assert_false(channel_write(c, 5, 128, 32, &when));
    assert_int_equal(when, 87);
    assert_int_equal(counts->writes_forced, 2);
    assert_false(channel_write(c, 86, 128, 32, &when));
    assert_int_equal(when, 87);
    assert_int_equal(counts->writes_forced, 2);
    post(c, 87, 128, 32);
    // The second is still there, so one more goes: column 88, data 95 to 97.
    assert_false(channel_write(c, 88, 160, 32, &when));
    assert_int_equal(when, 89);
    assert_int_equal(counts->writes_forced, 3);
    post(c, 89, 160, 32);
    assert_int_equal(counts->writes_refused, 3);
    // Three are left: 97, 99, 101 to 103.
    assert_int_equal(channel_drain(c, 89), 103);
    assert_int_equal(counts->writes_drained, 3);
    assert_int_equal(counts->bytes_written, 6 * 32);
    channel_destroy(c);
}

// ---- Streams -------------------------------------------------------------------------------------------

// Per mille of the bus that `bytes` took until core cycle `end`.
static uint64_t per_mille(const channel_timing *t, uint64_t bytes, uint64_t end)
{
    return bytes * 1000 * (uint64_t)t->core_mhz / (uint64_t)(t->bytes_per_clock * t->memory_mhz) / end;
}

static void streams_of_reads_reach_the_peak(void **state)
{
    (void)state;
    enum { READS = 20000 };
    const struct {
        uint32_t bytes;
        uint64_t step, wrap;
        const char *what;
    } streams[] = {
        {32, 32, 2048, "row hits of 32 bytes"},
        {32, 32, UINT64_MAX, "consecutive 32 bytes"},
        {256, 2048, UINT64_MAX, "256 bytes of a new row each"},
    };
    for (size_t s = 0; s < sizeof streams / sizeof *streams; s++) {
        channel *c = start(&gddr3);
        uint64_t end = 0;
        for (uint64_t i = 0; i < READS; i++)
            end = channel_read(c, i, i * streams[s].step % streams[s].wrap, streams[s].bytes);
        const uint64_t reached = per_mille(&gddr3, (uint64_t)READS * streams[s].bytes, end - 100);
        print_message("%s: %lu per mille of the bus\n", streams[s].what, reached);
        assert_in_range(reached, 990, 1000);
        channel_destroy(c);
    }
}

static void streams_of_writes_reach_the_peak(void **state)
{
    (void)state;
    enum { WRITES = 20000 };
    const struct {
        uint32_t bytes;
        uint64_t step;
        const char *what;
    } streams[] = {
        {32, 32, "consecutive 32 bytes"},
        {256, 2048, "256 bytes of a new row each"},
    };
    // A quarter of the queue is the lead that a new row's commands get: 16 writes of 2 clocks, for 10 + 12 + 7 clocks of
    // precharge, activate and write latency.
    channel_timing t = gddr3;
    t.write_queue = 64;
    for (size_t s = 0; s < sizeof streams / sizeof *streams; s++) {
        channel *c = start(&t);
        uint64_t now = 0;
        for (uint64_t i = 0; i < WRITES; i++) {
            uint64_t when = 0;
            if (!channel_write(c, now, i * streams[s].step, streams[s].bytes, &when)) {
                assert_true(when > now);
                post(c, now = when, i * streams[s].step, streams[s].bytes);
            }
        }
        const uint64_t reached = per_mille(&t, (uint64_t)WRITES * streams[s].bytes, channel_drain(c, now));
        print_message("writes, %s: %lu per mille of the bus\n", streams[s].what, reached);
        assert_in_range(reached, 990, 1000);
        channel_destroy(c);
    }
}

// ---- Timings -------------------------------------------------------------------------------------------

static void faults_are_named(void **state)
{
    (void)state;
    const struct {
        size_t member;
        int64_t value;
        const char *word;
    } cases[] = {
        {offsetof(channel_timing, core_mhz), 0, "core_mhz"},
        {offsetof(channel_timing, core_mhz), CHANNEL_MHZ_MAX + 1, "core_mhz"},
        {offsetof(channel_timing, memory_mhz), -1, "memory_mhz"},
        {offsetof(channel_timing, bytes_per_clock), 0, "bytes_per_clock"},
        {offsetof(channel_timing, burst_bytes), 0, "burst_bytes"},
        {offsetof(channel_timing, burst_bytes), 48, "row_bytes"},
        {offsetof(channel_timing, banks), 0, "banks"},
        {offsetof(channel_timing, banks), CHANNEL_BANKS_MAX + 1, "banks"},
        {offsetof(channel_timing, row_bytes), 0, "row_bytes"},
        {offsetof(channel_timing, t_cl), -1, "t_cl"},
        {offsetof(channel_timing, t_wtr), CHANNEL_TIME_MAX + 1, "t_cl"},
        {offsetof(channel_timing, latency_cycles), -1, "latency_cycles"},
        {offsetof(channel_timing, write_queue), 0, "write_queue"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        channel_timing t = plain;
        memcpy((char *)&t + cases[i].member, &cases[i].value, sizeof(int64_t));
        const char *fault = channel_timing_fault(&t);
        assert_non_null(fault);
        assert_int_equal(strncmp(fault, cases[i].word, strlen(cases[i].word)), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_read_of_a_closed_bank),
        cmocka_unit_test(two_clocks_are_rounded_up_each_way),
        cmocka_unit_test(late_times_do_not_overflow),
        cmocka_unit_test(a_row_hit),
        cmocka_unit_test(a_row_conflict),
        cmocka_unit_test(activates_of_one_bank_keep_apart),
        cmocka_unit_test(activates_of_two_banks_keep_apart),
        cmocka_unit_test(no_timings_leave_latency_and_transfer),
        cmocka_unit_test(the_port_takes_one_request_a_core_cycle),
        cmocka_unit_test(transfers_are_whole_bursts_of_one_row),
        cmocka_unit_test(a_write_then_a_read),
        cmocka_unit_test(a_read_then_a_write),
        cmocka_unit_test(reads_pass_writes_that_they_do_not_overlap),
        cmocka_unit_test(a_full_queue_refuses_until_its_oldest_leaves),
        cmocka_unit_test(streams_of_reads_reach_the_peak),
        cmocka_unit_test(streams_of_writes_reach_the_peak),
        cmocka_unit_test(faults_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
