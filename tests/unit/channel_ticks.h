// The DRAM channel once more, as a machine that ticks: in every memory clock it looks which commands may be issued. It
// shares no code with sim/clock/channel.c, is as slow as it looks, and must give the same cycles.
//
// The answer to a call lies in the future: a copy of the machine runs ahead to find it.
#ifndef ROPSIM_TEST_CHANNEL_TICKS_H
#define ROPSIM_TEST_CHANNEL_TICKS_H

#include "../../sim/clock/channel.h"

#include <assert.h>
#include <string.h>

enum { TICK_BANKS = 16, TICK_WORK = 256, TICK_WRITES = 64, TICK_NUMBERS = 128, LONG_AGO = -(1 << 28) };

// A transfer within one row. Times are -1 until it happens.
typedef struct tick_transfer {
    bool write, needs_precharge, needs_activate;
    int bank, write_number;  // write_number: of the posted write, -1 for a read
    int64_t length, not_before, precharged, activated, data_start;
    uint64_t *end;  // where the clock in which its data have ended will stand; NULL: nowhere
} tick_transfer;

typedef struct tick_bank {
    int64_t future_row;  // once all work there is done; -1: none
    int64_t activated, last_read_over, last_write_end;
} tick_bank;

typedef struct tick_write {
    uint64_t address, bytes;
    int64_t arrival;
    bool moved;  // to the work
} tick_write;

typedef struct ticks {
    const channel_timing *t;
    int64_t clock;       // the one that is under way
    uint64_t next_port;  // core cycle
    tick_bank banks[TICK_BANKS];
    int64_t last_activate, last_column, bus_free, read_end, write_end;
    tick_write writes[TICK_WRITES];  // those that hold a place, oldest first
    int write_count, first_number;   // first_number: of writes[0]
    int work_count;
    tick_transfer work[TICK_WORK];     // those that have not started their data, in order
    int64_t last_start[TICK_NUMBERS];  // of the last transfer of each posted write, by its number modulo this
    int unstarted[TICK_NUMBERS];       // how many transfers of each have still to start
} ticks;

static inline void ticks_start(ticks *m, const channel_timing *timing)
{
    memset(m, 0, sizeof *m);
    m->t = timing;
    m->last_activate = m->last_column = m->read_end = m->write_end = LONG_AGO;
    for (int i = 0; i < TICK_BANKS; i++)
        m->banks[i] = (tick_bank){-1, LONG_AGO, LONG_AGO, LONG_AGO};
}

static inline uint64_t ticks_scaled(uint64_t time, int64_t from, int64_t to)
{
    __extension__ typedef unsigned __int128 wide;
    return (uint64_t)(((wide)time * (wide)to + (wide)from - 1) / (wide)from);
}

// Issues one command of transfer i if it may be issued in this clock.
static inline bool ticks_issue_one(ticks *m, int i)
{
    const channel_timing *t = m->t;
    tick_transfer *x = &m->work[i];
    tick_bank *bank = &m->banks[x->bank];
    const int64_t now = m->clock;
    if (now < x->not_before)
        return false;
    bool activates_before = false;
    for (int k = 0; k < i; k++) {
        if (m->work[k].bank == x->bank)
            return false;  // the bank is not this transfer's turn
        activates_before |= m->work[k].needs_activate && m->work[k].activated < 0;
    }
    if (x->needs_precharge && x->precharged < 0) {
        if (now < bank->activated + t->t_ras || now < bank->last_read_over || now < bank->last_write_end + t->t_wr)
            return false;
        x->precharged = now;
        return true;
    }
    if (x->needs_activate && x->activated < 0) {
        if (activates_before || now < m->last_activate + t->t_rrd || now < bank->activated + t->t_rc ||
            (x->needs_precharge && now < x->precharged + t->t_rp))
            return false;
        x->activated = bank->activated = m->last_activate = now;
        return true;
    }
    const int64_t data = now + (x->write ? t->t_wl : t->t_cl);
    if (i > 0 || now < bank->activated + t->t_rcd || now <= m->last_column || data < m->bus_free ||
        (x->write ? data < m->read_end + 1 : now < m->write_end + t->t_wtr))
        return false;
    m->last_column = now;
    m->bus_free = data + x->length;
    if (x->write) {
        m->write_end = bank->last_write_end = m->bus_free;
        int number = x->write_number;
        m->last_start[number] = data;
        m->unstarted[number]--;
    } else {
        m->read_end = m->bus_free;
        bank->last_read_over = now + x->length;
    }
    if (x->end)
        *x->end = (uint64_t)m->bus_free;
    m->work_count--;
    memmove(m->work, m->work + 1, (size_t)m->work_count * sizeof *m->work);
    return true;
}

static inline void ticks_issue(ticks *m)
{
    for (int i = 0; i < m->work_count; i++)
        if (ticks_issue_one(m, i))
            i = -1;  // from the front again: more may go in this clock
}

static inline void ticks_add_work(ticks *m, bool write, int number, uint64_t address, uint64_t bytes)
{
    const uint64_t burst = (uint64_t)m->t->burst_bytes, row_bytes = (uint64_t)m->t->row_bytes;
    const uint64_t first = address / burst, last = (address + bytes - 1) / burst;
    for (uint64_t b = first; b <= last; b++) {
        const uint64_t row_number = b * burst / row_bytes;
        const uint64_t banks = (uint64_t)m->t->banks;
        const int bank = (int)((row_number % banks + row_number / banks + row_number / banks / banks) % banks);
        const int64_t row = (int64_t)(row_number / banks);
        const int64_t clocks = (m->t->burst_bytes + m->t->bytes_per_clock - 1) / m->t->bytes_per_clock;
        if (b > first && b * burst % row_bytes != 0) {
            m->work[m->work_count - 1].length += clocks;
            continue;
        }
        assert(m->work_count < TICK_WORK);
        const int64_t was = m->banks[bank].future_row;
        m->work[m->work_count++] = (tick_transfer){.write = write,
                                                   .needs_precharge = was != -1 && was != row,
                                                   .needs_activate = was != row,
                                                   .bank = bank,
                                                   .write_number = number,
                                                   .length = clocks,
                                                   .not_before = m->clock,
                                                   .precharged = -1,
                                                   .activated = -1};
        m->banks[bank].future_row = row;
        if (write)
            m->unstarted[number]++;
    }
}

static inline bool ticks_move_write(ticks *m)
{
    for (int i = 0; i < m->write_count; i++)
        if (!m->writes[i].moved) {
            m->writes[i].moved = true;
            ticks_add_work(m, true, (m->first_number + i) % TICK_NUMBERS, m->writes[i].address, m->writes[i].bytes);
            return true;
        }
    return false;
}

// The end of a clock: nothing is to be done or under way, so the oldest write may begin.
static inline void ticks_next(ticks *m)
{
    ticks_issue(m);
    if (m->work_count == 0 && m->bus_free <= m->clock && ticks_move_write(m))
        ticks_issue(m);
    m->clock++;
}

// Ticks until the port takes a call made at `time`, which leaves the machine at that memory clock.
static inline uint64_t ticks_until_call(ticks *m, uint64_t time)
{
    const uint64_t cycle = time > m->next_port ? time : m->next_port;
    const int64_t clock = (int64_t)ticks_scaled(cycle, m->t->core_mhz, m->t->memory_mhz);
    while (m->clock < clock)
        ticks_next(m);
    ticks_issue(m);
    return cycle;
}

// The clock in which the work there is now has ended.
static inline int64_t ticks_end(const ticks *m)
{
    ticks ahead = *m;
    for (;; ahead.clock++) {
        ticks_issue(&ahead);
        if (ahead.work_count == 0)
            return ahead.bus_free;
    }
}

// Asks for a read. *end: the clock in which the last of its data have ended, as soon as that is known.
static inline void ticks_ask(ticks *m, uint64_t time, uint64_t address, uint32_t bytes, uint64_t *end)
{
    m->next_port = ticks_until_call(m, time) + 1;
    const uint64_t burst = (uint64_t)m->t->burst_bytes;
    int wanted = -1;
    for (int i = 0; i < m->write_count; i++) {
        const tick_write *w = &m->writes[i];
        if (!w->moved && w->address / burst <= (address + bytes - 1) / burst &&
            address / burst <= (w->address + w->bytes - 1) / burst)
            wanted = i;
    }
    while (wanted >= 0 && !m->writes[wanted].moved)
        ticks_move_write(m);
    ticks_add_work(m, false, -1, address, bytes);
    m->work[m->work_count - 1].end = end;
    ticks_issue(m);
}

static inline uint64_t ticks_read(ticks *m, uint64_t time, uint64_t address, uint32_t bytes)
{
    ticks_ask(m, time, address, bytes, NULL);
    return ticks_scaled((uint64_t)ticks_end(m), m->t->memory_mhz, m->t->core_mhz) + (uint64_t)m->t->latency_cycles;
}

static inline void ticks_leave(ticks *m)
{
    while (m->write_count > 0 && m->writes[0].moved && m->unstarted[m->first_number] == 0 &&
           m->last_start[m->first_number] <= m->clock) {
        m->first_number = (m->first_number + 1) % TICK_NUMBERS;
        m->write_count--;
        memmove(m->writes, m->writes + 1, (size_t)m->write_count * sizeof *m->writes);
    }
}

// `when` NULL: it is not asked for.
static inline bool ticks_write(ticks *m, uint64_t time, uint64_t address, uint32_t bytes, uint64_t *when)
{
    const uint64_t cycle = ticks_until_call(m, time);
    const int size = (int)m->t->write_queue;
    assert(size <= TICK_WRITES);
    ticks_leave(m);
    if (m->write_count == size) {
        int moved = 0;
        for (int i = 0; i < size; i++)
            moved += m->writes[i].moved;
        const bool quarter = moved <= size / 4;
        for (; quarter && moved < (size + 1) / 2; moved++)
            ticks_move_write(m);
        ticks_issue(m);
        ticks_leave(m);
    }
    if (m->write_count == size && when) {
        ticks ahead = *m;
        const int first = ahead.first_number;
        while (ahead.first_number == first) {
            ahead.clock++;
            ticks_issue(&ahead);
            ticks_leave(&ahead);
        }
        *when = ticks_scaled((uint64_t)ahead.clock, m->t->memory_mhz, m->t->core_mhz);
    }
    if (m->write_count == size)
        return false;
    m->next_port = cycle + 1;
    m->writes[m->write_count++] = (tick_write){address, bytes, m->clock, false};
    return true;
}

static inline uint64_t ticks_drain(ticks *m, uint64_t time)
{
    const uint64_t last = m->next_port > 0 ? m->next_port - 1 : 0;
    const uint64_t cycle = time > last ? time : last;
    const int64_t clock = (int64_t)ticks_scaled(cycle, m->t->core_mhz, m->t->memory_mhz);
    while (m->clock < clock)
        ticks_next(m);
    while (ticks_move_write(m))
        ;
    const uint64_t end = ticks_scaled((uint64_t)ticks_end(m), m->t->memory_mhz, m->t->core_mhz);
    return time > end ? time : end;
}

#endif
