// One channel of DRAM: requests in order of time go in, the core cycle in which the data are back comes out.
// Open rows, banks that work side by side, one data bus, posted writes. The whole rule is docs/dram.md.
//
// The caller owns the clock: times are core cycles and never go back. What a reader would get wrong: nothing ticks. A
// call works out at once what the request will have cost, so reads are answered in order of arrival and never pass one
// another, and writes are looked at only when the next call comes.
#ifndef ROPSIM_CLOCK_CHANNEL_H
#define ROPSIM_CLOCK_CHANNEL_H

#include "request_log.h"

// In memory clocks unless said. A memory clock is the one that commands are counted in, not a data rate.
typedef struct channel_timing {
    int64_t core_mhz, memory_mhz;  // 1 to CHANNEL_MHZ_MAX
    int64_t bytes_per_clock;       // of the data bus, a memory clock (both edges): 16 for 64-bit DDR
    int64_t burst_bytes;           // every transfer is a whole number of these
    int64_t banks, row_bytes;      // row_bytes: a multiple of burst_bytes
    int64_t t_cl, t_wl;            // column command to first data, of a read, of a write
    int64_t t_rcd;                 // activate to column command
    int64_t t_rp;                  // precharge to activate
    int64_t t_ras, t_rc;           // activate to precharge, activate to activate of one bank
    int64_t t_rrd;                 // activate to activate of two banks
    int64_t t_wr;                  // end of write data to precharge
    int64_t t_wtr;                 // end of write data to the column command of a read
    int64_t latency_cycles;        // core cycles on the way there and back, on top of DRAM timing
    int64_t write_queue;           // posted writes that the channel holds, at least 1
} channel_timing;

enum {
    CHANNEL_MHZ_MAX = 32768,  // 2^48 cycles of either clock are then fewer than 2^63 of the other
    CHANNEL_BANKS_MAX = 4096,
    CHANNEL_WRITES_MAX = 65536,
    CHANNEL_TIME_MAX = 1 << 20,
    CHANNEL_BYTES_MAX = 1 << 20,
};

// What is wrong with a timing, as a sentence that begins with the member's name; NULL: nothing.
const char *channel_timing_fault(const channel_timing *timing);

// All grow from zero, so that end minus start is a region.
typedef struct channel_counts {
    uint64_t reads, writes;                    // requests accepted
    uint64_t bytes_read, bytes_written;        // moved over the data bus: whole bursts
    uint64_t row_hits, row_misses, row_empty;  // transfers that found their row open, another one, none
    uint64_t turnarounds;                      // transfers in the other direction than the one before
    uint64_t busy_clocks;                      // of the data bus, memory clocks
    uint64_t writes_idle, writes_forced;       // writes performed while nothing else was to do; since the queue was full
    uint64_t writes_overlapped, writes_drained;  // since a read wanted them done, in channel_drain
    uint64_t writes_refused;                   // calls of channel_write that returned false
} channel_counts;

typedef struct channel channel;

// NULL: out of memory. `timing` has no fault.
channel *channel_create(const channel_timing *timing);
void channel_destroy(channel *channel);  // NULL is fine

// The core cycle in which all data are back. bytes: at least 1; address + bytes: below 2^63.
uint64_t channel_read(channel *channel, uint64_t time, uint64_t address, uint32_t bytes);
// Posted. true: taken into the queue. false: the queue is full, nothing was taken, and the same write finds room at *when,
// later than `time`, unless another one comes before. `when` is set only then.
bool channel_write(channel *channel, uint64_t time, uint64_t address, uint32_t bytes, uint64_t *when);
// Performs all writes. The core cycle at which the last transfer, read or write, has ended on the data bus; `time` if that
// is later. Takes no turn at the port.
uint64_t channel_drain(channel *channel, uint64_t time);

const channel_counts *channel_get_counts(const channel *channel);  // the channel's own, valid as long as it is

// From now on each accepted request is also added to `log` as one of channel `number`; NULL: no longer. The log is the
// caller's and outlives this.
void channel_log(channel *channel, request_log *log, int number);

#endif
