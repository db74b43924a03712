// Requests in order of time to one DRAM channel -> when each is done. docs/dram.md is the rule that this follows.
//
// Nothing ticks: a transfer is worked out in one go, in the order in which transfers take the data bus. That is exact
// as no later transfer can delay an earlier one. Names ending in `_ready` are the first memory clock in which something
// may happen; all start at 0.
#include "channel.h"
#include "divisor.h"

#include <assert.h>
#include <stdlib.h>

enum { NO_ROW = -1, BLOCK_BYTES = 256, BLOCK_BUCKETS = 512 };

typedef struct bank {
    int64_t row;  // open, or NO_ROW
    uint64_t column_ready, precharge_ready, activate_ready;
} bank;

// A write from when it is accepted until its data are on their way. Those of `begun` have their transfer settled.
typedef struct posted_write {
    uint64_t start, end;  // bytes
    uint64_t arrival;     // memory clock
    uint64_t leaves;      // the memory clock in which its last transfer starts; set when it is performed
} posted_write;

struct channel {
    channel_timing timing;
    divisor core_mhz, memory_mhz, burst_bytes, row_bytes, banks;
    uint64_t burst_clocks;
    uint64_t last_time;   // of a call, to hold the caller to the order
    uint64_t port_ready;  // core cycle
    uint64_t activate_ready, command_ready, data_ready;
    uint64_t read_command_ready, write_data_ready;  // what the other direction's last transfer leaves open
    bool writing, used;                             // direction of the last transfer; whether there was one
    bank *open;
    posted_write *queue;           // a ring of timing.write_queue
    uint32_t oldest, held, begun;  // begun: the oldest of those held, performed and not yet left
    // How many waiting writes touch a block of memory, blocks hashed to buckets: most reads overlap none, and the queue
    // need not be searched to know it.
    uint32_t waiting[BLOCK_BUCKETS];
    channel_counts counts;
    request_log *log;
    int number;
};

static uint64_t later(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

// ---- Create --------------------------------------------------------------------------------------------

const char *channel_timing_fault(const channel_timing *t)
{
    const int64_t times[] = {t->t_cl, t->t_wl, t->t_rcd, t->t_rp, t->t_ras, t->t_rc, t->t_rrd, t->t_wr, t->t_wtr};
    if (t->core_mhz < 1 || t->core_mhz > CHANNEL_MHZ_MAX)
        return "core_mhz must be from 1 to 32768";
    if (t->memory_mhz < 1 || t->memory_mhz > CHANNEL_MHZ_MAX)
        return "memory_mhz must be from 1 to 32768";
    if (t->bytes_per_clock < 1 || t->bytes_per_clock > CHANNEL_BYTES_MAX)
        return "bytes_per_clock must be from 1 to 1048576";
    if (t->burst_bytes < 1 || t->burst_bytes > CHANNEL_BYTES_MAX)
        return "burst_bytes must be from 1 to 1048576";
    if (t->banks < 1 || t->banks > CHANNEL_BANKS_MAX)
        return "banks must be from 1 to 4096";
    if (t->row_bytes < 1 || t->row_bytes > CHANNEL_BYTES_MAX || t->row_bytes % t->burst_bytes != 0)
        return "row_bytes must be a multiple of burst_bytes, at most 1048576";
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        if (times[i] < 0 || times[i] > CHANNEL_TIME_MAX)
            return "t_cl and the other times must be from 0 to 1048576 memory clocks";
    if (t->latency_cycles < 0 || t->latency_cycles > CHANNEL_TIME_MAX)
        return "latency_cycles must be from 0 to 1048576";
    if (t->write_queue < 1 || t->write_queue > CHANNEL_WRITES_MAX)
        return "write_queue must be from 1 to 65536";
    return NULL;
}

channel *channel_create(const channel_timing *timing)
{
    assert(!channel_timing_fault(timing));
    channel *c = malloc(sizeof *c);
    bank *banks = malloc((size_t)timing->banks * sizeof *banks);
    posted_write *queue = malloc((size_t)timing->write_queue * sizeof *queue);
    if (!c || !banks || !queue) {
        free(c);
        free(banks);
        free(queue);
        return NULL;
    }
    for (int64_t i = 0; i < timing->banks; i++)
        banks[i] = (bank){.row = NO_ROW};
    *c = (channel){
        .timing = *timing,
        .core_mhz = divisor_of((uint64_t)timing->core_mhz),
        .memory_mhz = divisor_of((uint64_t)timing->memory_mhz),
        .burst_bytes = divisor_of((uint64_t)timing->burst_bytes),
        .row_bytes = divisor_of((uint64_t)timing->row_bytes),
        .banks = divisor_of((uint64_t)timing->banks),
        .burst_clocks = (uint64_t)((timing->burst_bytes + timing->bytes_per_clock - 1) / timing->bytes_per_clock),
        .open = banks,
        .queue = queue,
    };
    return c;
}

void channel_destroy(channel *c)
{
    if (!c)
        return;
    free(c->open);
    free(c->queue);
    free(c);
}

const channel_counts *channel_get_counts(const channel *c)
{
    return &c->counts;
}

void channel_log(channel *c, request_log *log, int number)
{
    c->log = log;
    c->number = number;
}

// ---- Clocks --------------------------------------------------------------------------------------------

// The first cycle of one clock that does not begin before cycle `time` of the other. Whole seconds' worth apart where a
// product might exceed 64 bits.
static inline uint64_t convert(uint64_t time, const divisor *from, const divisor *to)
{
    uint64_t rest = time, whole = 0, unused;
    if (time >= UINT64_MAX / (2 * CHANNEL_MHZ_MAX))
        whole = divide(time, from, &rest);
    return whole * to->value + divide(rest * to->value + from->value - 1, from, &unused);
}

static uint64_t to_memory(const channel *c, uint64_t core_cycle)
{
    return convert(core_cycle, &c->core_mhz, &c->memory_mhz);
}

static uint64_t to_core(const channel *c, uint64_t memory_clock)
{
    return convert(memory_clock, &c->memory_mhz, &c->core_mhz);
}

// ---- DRAM ----------------------------------------------------------------------------------------------

// What reads and writes differ in is known where one is asked for.
#define INLINED static inline __attribute__((always_inline))

// Opens `row` with commands not before clock `earliest`.
static void open_row(channel *c, bank *bank, int64_t row, uint64_t earliest)
{
    const channel_timing *t = &c->timing;
    uint64_t activate = earliest;
    if (bank->row != NO_ROW) {
        c->counts.row_misses++;
        activate = later(earliest, bank->precharge_ready) + t->t_rp;
    } else {
        c->counts.row_empty++;
    }
    activate = later(activate, later(bank->activate_ready, c->activate_ready));
    c->activate_ready = activate + t->t_rrd;
    *bank = (struct bank){
        .row = row,
        .column_ready = activate + t->t_rcd,
        .precharge_ready = activate + t->t_ras,
        .activate_ready = activate + t->t_rc,
    };
}

// Moves `bytes`, whole bursts of one row. Returns the clock in which the data start; they end at c->data_ready.
INLINED uint64_t transfer(channel *c, bool write, int64_t row, bank *bank, uint64_t bytes, uint64_t earliest)
{
    const channel_timing *t = &c->timing;
    if (bank->row == row)
        c->counts.row_hits++;
    else
        open_row(c, bank, row, earliest);
    uint64_t unused;
    uint64_t clocks = divide(bytes, &c->burst_bytes, &unused) * c->burst_clocks;
    uint64_t lag = write ? t->t_wl : t->t_cl;
    uint64_t column = later(later(earliest, bank->column_ready), c->command_ready);
    if (!write)
        column = later(column, c->read_command_ready);
    uint64_t start = later(column + lag, write ? c->write_data_ready : c->data_ready);
    column = start - lag;  // a command whose data would find the bus taken is held back
    uint64_t end = start + clocks;

    c->command_ready = column + 1;
    c->data_ready = end;
    if (write) {
        c->read_command_ready = end + t->t_wtr;
        c->write_data_ready = end;
        bank->precharge_ready = later(bank->precharge_ready, end + t->t_wr);
        c->counts.bytes_written += bytes;
    } else {
        c->write_data_ready = end + 1;
        bank->precharge_ready = later(bank->precharge_ready, column + clocks);
        c->counts.bytes_read += bytes;
    }
    c->counts.turnarounds += c->used && c->writing != write;
    c->counts.busy_clocks += clocks;
    c->writing = write;
    c->used = true;
    return start;
}

// Bytes of row `number` of all banks' rows.
INLINED uint64_t perform_in_row(channel *c, bool write, uint64_t number, uint64_t bytes, uint64_t earliest)
{
    uint64_t place, bank_index;
    const uint64_t row = divide(number, &c->banks, &place);
    divide(place + row + divide(row, &c->banks, &bank_index), &c->banks, &bank_index);
    return transfer(c, write, (int64_t)row, &c->open[bank_index], bytes, earliest);
}

// Bytes of several rows, from a column of row `number` on.
static uint64_t perform_rows(channel *c, bool write, uint64_t number, uint64_t column, uint64_t bytes, uint64_t earliest)
{
    for (uint64_t part = c->row_bytes.value - column; part < bytes; part = c->row_bytes.value) {
        perform_in_row(c, write, number++, part, earliest);
        bytes -= part;
    }
    return perform_in_row(c, write, number, bytes, earliest);
}

// Bytes start to end, row by row; one as a rule. Returns the clock in which the last row's data start.
INLINED uint64_t perform(channel *c, bool write, uint64_t start, uint64_t end, uint64_t earliest)
{
    uint64_t column;
    const uint64_t number = divide(start, &c->row_bytes, &column), bytes = end - start;
    if (column + bytes > c->row_bytes.value)
        return perform_rows(c, write, number, column, bytes, earliest);
    return perform_in_row(c, write, number, bytes, earliest);
}

// ---- Posted writes -------------------------------------------------------------------------------------

static posted_write *queue_at(const channel *c, uint32_t place)
{
    uint32_t index = c->oldest + place, size = (uint32_t)c->timing.write_queue;
    return &c->queue[index < size ? index : index - size];
}

static void count_waiting(channel *c, const posted_write *write, uint32_t change)
{
    for (uint64_t block = write->start / BLOCK_BYTES; block <= (write->end - 1) / BLOCK_BYTES; block++)
        c->waiting[block % BLOCK_BUCKETS] += change;
}

static bool may_overlap(const channel *c, uint64_t start, uint64_t end)
{
    for (uint64_t block = start / BLOCK_BYTES; block <= (end - 1) / BLOCK_BYTES; block++)
        if (c->waiting[block % BLOCK_BUCKETS] > 0)
            return true;
    return false;
}

// Performs the oldest write that is not begun.
static void begin_write(channel *c, uint64_t earliest)
{
    posted_write *write = queue_at(c, c->begun++);
    count_waiting(c, write, -1u);
    write->leaves = perform(c, true, write->start, write->end, earliest);
}

// What the channel did of its own accord before clock `before`.
static void write_while_idle(channel *c, uint64_t before)
{
    while (c->begun < c->held) {
        uint64_t earliest = later(queue_at(c, c->begun)->arrival, c->data_ready);
        if (earliest >= before)
            return;
        begin_write(c, earliest);
        c->counts.writes_idle++;
    }
}

static void let_writes_leave(channel *c, uint64_t clock)
{
    while (c->begun > 0 && queue_at(c, 0)->leaves <= clock) {
        c->oldest = c->oldest + 1 < c->timing.write_queue ? c->oldest + 1 : 0;
        c->begun--;
        c->held--;
    }
}

// Performs the waiting writes up to and with the last that shares a byte with start to end.
static void write_overlapped(channel *c, uint64_t start, uint64_t end, uint64_t clock)
{
    if (!may_overlap(c, start, end))
        return;
    uint32_t last = c->held;
    while (last > c->begun) {
        const posted_write *write = queue_at(c, last - 1);
        if (write->start < end && start < write->end)
            break;
        last--;
    }
    while (c->begun < last) {
        begin_write(c, clock);
        c->counts.writes_overlapped++;
    }
}

// ---- Requests ------------------------------------------------------------------------------------------

// A request on its way in: when the port takes it, and its bytes as whole bursts.
typedef struct request {
    uint64_t cycle, clock, start, end;
} request;

static request request_at(channel *c, uint64_t time, uint64_t address, uint32_t bytes)
{
    assert(time >= c->last_time && bytes > 0 && address < (uint64_t)INT64_MAX - bytes);
    c->last_time = time;
    uint64_t cycle = later(time, c->port_ready), before, over, burst = c->burst_bytes.value;
    divide(address, &c->burst_bytes, &before);
    divide(address + bytes + burst - 1, &c->burst_bytes, &over);
    return (request){
        .cycle = cycle,
        .clock = to_memory(c, cycle),
        .start = address - before,
        .end = address + bytes + burst - 1 - over,
    };
}

static inline void accept(channel *c, const request *request, bool write)
{
    c->port_ready = request->cycle + 1;
    if (c->log)
        request_log_add(c->log, &(logged_request){.core_cycle = request->cycle,
                                                  .memory_clock = request->clock,
                                                  .address = request->start,
                                                  .bytes = request->end - request->start,
                                                  .channel = c->number,
                                                  .write = write});
}

uint64_t channel_read(channel *c, uint64_t time, uint64_t address, uint32_t bytes)
{
    const request request = request_at(c, time, address, bytes);
    accept(c, &request, false);
    write_while_idle(c, request.clock);
    write_overlapped(c, request.start, request.end, request.clock);
    perform(c, false, request.start, request.end, request.clock);
    c->counts.reads++;
    return to_core(c, c->data_ready) + (uint64_t)c->timing.latency_cycles;
}

bool channel_write(channel *c, uint64_t time, uint64_t address, uint32_t bytes, uint64_t *when)
{
    const request request = request_at(c, time, address, bytes);
    const uint32_t size = (uint32_t)c->timing.write_queue;
    write_while_idle(c, request.clock);
    let_writes_leave(c, request.clock);
    if (c->held == size && c->begun <= size / 4) {
        // The oldest half is put to work at once, since each turn of the bus costs; a quarter that is still on its way is
        // the lead that the commands of the next get.
        while (c->begun < (size + 1) / 2) {
            begin_write(c, request.clock);
            c->counts.writes_forced++;
        }
        let_writes_leave(c, request.clock);  // without any delays the first may start at once
    }
    if (c->held == size) {
        *when = to_core(c, queue_at(c, 0)->leaves);
        c->counts.writes_refused++;
        return false;
    }
    accept(c, &request, true);
    posted_write *write = queue_at(c, c->held++);
    *write = (posted_write){.start = request.start, .end = request.end, .arrival = request.clock};
    count_waiting(c, write, 1);
    c->counts.writes++;
    return true;
}

uint64_t channel_drain(channel *c, uint64_t time)
{
    assert(time >= c->last_time);
    c->last_time = time;
    // The port may have taken requests for cycles that are still to come; nothing begins before them.
    uint64_t clock = to_memory(c, c->port_ready > 0 ? later(time, c->port_ready - 1) : time);
    write_while_idle(c, clock);
    while (c->begun < c->held) {
        begin_write(c, clock);
        c->counts.writes_drained++;
    }
    return later(time, to_core(c, c->data_ready));
}
