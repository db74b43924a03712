// The log of requests to DRAM: the lines of each format by hand, the order of lines, and that a file is whole or not
// there.
#include "../../sim/clock/channel.h"
#include "messages.h"

#include <stdarg.h>
#include <setjmp.h>
#include <cmocka.h>
#include <inttypes.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/ropsim_request_log_XXXXXX";
static char path[64];

static int make_folder(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/log", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

static request_space space_of(int channels)
{
    return (request_space){.burst_bytes = 32, .channels = channels, .only = -1, .banks = 8, .row_bytes = 2048};
}

static request_log *open_log(const char *format, int channels)
{
    const request_space space = space_of(channels);
    request_log *log = NULL;
    assert_int_equal(request_log_open(path, format, &space, NULL, &log), STATUS_OK);
    return log;
}

static void expect_text(const char *wanted)
{
    char text[1024];
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    assert_string_equal(text, wanted);
}

// A write at core cycle 5 and a read at 2, of two channels of six, told in this order. The places of eight channels
// alternate burst by burst: burst 3 of channel 5 lies at (3 * 8 + 5) * 32 = 0x3a0. Address 0xabc0 is in row number 21 of the banks' rows, row 2
// of bank (21 + 2 + 0) mod 8 = 7: at (2 * 8 + 7) * 2048 + 0x3c0 = 0xbbc0 in the channel, so at 0x5de00 of eight.
static void two_requests(const char *format)
{
    const channel_timing t = {.core_mhz = 2,
                              .memory_mhz = 3,
                              .bytes_per_clock = 16,
                              .burst_bytes = 32,
                              .banks = 8,
                              .row_bytes = 2048,
                              .t_cl = 10,
                              .write_queue = 4};
    channel *a = channel_create(&t), *b = channel_create(&t);
    assert_true(a && b);
    request_log *log = open_log(format, 6);
    channel_log(a, log, 5);
    channel_log(b, log, 0);
    uint64_t when;
    assert_true(channel_write(a, 5, 100, 29, &when));  // bytes 96 to 160, memory clock 7.5
    channel_read(b, 2, 0xabc0, 32);
    channel_log(b, NULL, 0);
    channel_read(b, 9, 0, 32);
    channel_drain(a, 100);
    assert_int_equal(request_log_late(log), 0);
    assert_int_equal(request_log_finish(log), STATUS_OK);
    channel_destroy(a);
    channel_destroy(b);
}

static void each_format_has_its_lines(void **state)
{
    (void)state;
    two_requests("dramsim3");
    expect_text("0x5DE00 READ 3\n0x3A0 WRITE 8\n0x4A0 WRITE 8\n");
    two_requests("ramulator");
    expect_text("0x5de00 R\n0x3a0 W\n0x4a0 W\n");
    two_requests("ramulator2");
    expect_text("LD 0x5de00\nST 0x3a0\nST 0x4a0\n");
    two_requests("csv");
    expect_text("core_cycle,memory_clock,channel,address,bytes,operation,flat_address\n"
                "2,3,0,0xabc0,32,read,0x5de00\n5,8,5,0x60,32,write,0x3a0\n5,8,5,0x80,32,write,0x4a0\n");
}

static void a_refused_write_is_logged_once(void **state)
{
    (void)state;
    const channel_timing t = {.core_mhz = 1,
                              .memory_mhz = 1,
                              .bytes_per_clock = 1,
                              .burst_bytes = 32,
                              .banks = 8,
                              .row_bytes = 2048,
                              .write_queue = 1};
    channel *c = channel_create(&t);
    assert_non_null(c);
    request_log *log = open_log("csv", 1);
    channel_log(c, log, 0);
    uint64_t when;
    channel_read(c, 0, 0, 32);
    assert_true(channel_write(c, 1, 0, 32, &when));
    assert_false(channel_write(c, 2, 32, 32, &when));
    assert_int_equal(when, 33);
    assert_true(channel_write(c, when, 32, 32, &when));
    assert_int_equal(request_log_finish(log), STATUS_OK);
    expect_text("core_cycle,memory_clock,channel,address,bytes,operation,flat_address\n"
                "0,0,0,0x0,32,read,0x0\n1,1,0,0x0,32,write,0x0\n33,33,0,0x20,32,write,0x20\n");
    channel_destroy(c);
}

static void add(request_log *log, uint64_t cycle, int channel)
{
    request_log_add(log,
                    &(logged_request){.core_cycle = cycle, .memory_clock = cycle, .bytes = 32, .channel = channel});
}

// ---- Banks and rows ------------------------------------------------------------------------------------

// Requests at random places of a channel with few banks; what it finds open is what one would find by the addresses' bits alone.
static void rows_and_banks_stand_in_the_bits(void **state)
{
    (void)state;
    enum { BANKS = 4, ROW = 256, REQUESTS = 5000 };
    const channel_timing t = {.core_mhz = 1, .memory_mhz = 1, .bytes_per_clock = 32, .burst_bytes = 32, .banks = BANKS, .row_bytes = ROW, .write_queue = 1};
    for (int only = -1; only <= 2; only += 3) {
        const int number = 2;
        const request_space space = {.burst_bytes = 32, .channels = 3, .only = only, .banks = BANKS, .row_bytes = ROW};
        const uint64_t channels = only < 0 ? 4 : 1;
        channel *c = channel_create(&t), *other = channel_create(&t);
        request_log *log = NULL;
        assert_true(c && other);
        assert_int_equal(request_log_open(path, "dramsim3", &space, NULL, &log), STATUS_OK);
        channel_log(c, log, number);
        channel_log(other, log, 1);
        uint64_t random = 12345, open[BANKS] = {0}, hits = 0, address, lines = 0;
        for (uint64_t i = 0; i < REQUESTS; i++) {
            random = random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
            channel_read(c, 100 * i, (random >> 33) % (6 * BANKS * ROW / 32) * 32, 32);
        }
        if (only >= 0)
            channel_read(other, 0, 0, 32);  // is left out
        assert_int_equal(request_log_finish(log), STATUS_OK);
        FILE *file = fopen(path, "r");
        assert_non_null(file);
        while (fscanf(file, "%" SCNx64 " READ %*u\n", &address) == 1) {
            assert_int_equal(address / 32 % channels, only < 0 ? 2 : 0);
            const uint64_t place = address / 32 / channels * 32, bank = place / ROW % BANKS, row = place / ROW / BANKS + 1;
            hits += open[bank] == row;
            open[bank] = row;
            lines++;
        }
        fclose(file);
        assert_int_equal(lines, REQUESTS);
        assert_int_equal(hits, channel_get_counts(c)->row_hits);
        assert_true(hits > REQUESTS / 20);
        channel_destroy(c);
        channel_destroy(other);
    }
}

// ---- Order ---------------------------------------------------------------------------------------------

// Lines of the file, which must not go back.
static uint64_t ordered_lines(void)
{
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    uint64_t last = 0, cycle, lines = 0;
    while (fscanf(file, "0x%*x READ %" SCNu64 "\n", &cycle) == 1) {
        assert_true(cycle >= last);
        last = cycle;
        lines++;
    }
    assert_true(feof(file));
    fclose(file);
    return lines;
}

// Channel 1 is told of a stretch after channel 0 has been, as many requests as the log holds.
static void lines_are_in_order_of_time(void **state)
{
    (void)state;
    request_log *log = open_log("dramsim3", 2);
    for (int block = 0; block < 3; block++)
        for (int channel = 0; channel < 2; channel++)
            for (uint64_t i = 0; i < REQUEST_LOG_HELD; i++)
                add(log, (uint64_t)block * REQUEST_LOG_HELD + i, channel);
    assert_int_equal(request_log_late(log), 0);
    assert_int_equal(request_log_finish(log), STATUS_OK);
    assert_int_equal(ordered_lines(), 6 * REQUEST_LOG_HELD);
}

static void a_request_too_late_is_counted_and_stays_in_order(void **state)
{
    (void)state;
    request_log *log = open_log("dramsim3", 2);
    for (uint64_t i = 0; i < REQUEST_LOG_HELD + 10; i++)
        add(log, 100 + i, 0);
    add(log, 109, 1);  // the file has reached this
    add(log, 5, 1);
    assert_int_equal(request_log_late(log), 1);
    assert_int_equal(request_log_finish(log), STATUS_OK);
    assert_int_equal(ordered_lines(), REQUEST_LOG_HELD + 12);
}

static void what_cannot_be_opened_is_said(void **state)
{
    (void)state;
    static messages said;
    request_log *log;
    request_space space = space_of(1);
    messages_start(&said);
    unlink(path);
    assert_int_equal(request_log_open(path, "dramsim", &space, &said.report, &log), STATUS_USAGE);
    assert_null(log);
    assert_non_null(strstr(said.text, "did you mean dramsim3?"));
    messages_start(&said);
    assert_int_equal(request_log_open("/nowhere/log", "csv", &space, &said.report, &log), STATUS_IO);
    assert_null(log);
    assert_int_equal(said.count, 1);
    messages_start(&said);
    space.only = 1;
    assert_int_equal(request_log_open(path, "csv", &space, &said.report, &log), STATUS_USAGE);
    assert_non_null(strstr(said.text, "there is no channel 1: the machine has 1, numbered from 0"));
    log = open_log("csv", 1);
    add(log, 1, 0);
    request_log_abandon(log);
    request_log_abandon(NULL);
    assert_int_not_equal(access(path, F_OK), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_format_has_its_lines),
        cmocka_unit_test(a_refused_write_is_logged_once),
        cmocka_unit_test(rows_and_banks_stand_in_the_bits),
        cmocka_unit_test(lines_are_in_order_of_time),
        cmocka_unit_test(a_request_too_late_is_counted_and_stays_in_order),
        cmocka_unit_test(what_cannot_be_opened_is_said),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
