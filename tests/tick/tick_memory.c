// Requests in, in order of cycles; the cycles in which data are there out. One ticking channel and one slice of the second
// level a partition (docs/dram.md; docs/machine.md, "Memory").
#include "tick_parts.h"

#include "../unit/channel_ticks.h"

#include <stdlib.h>

typedef struct answer {
    uint64_t clock;       // in which its last data have ended; TICK_NEVER: not known yet
    uint64_t cycle;       // the answer; TICK_NEVER: not known yet
    uint64_t not_before, added;  // what the second level adds
    struct answer *next;
} answer;

// A write that was refused comes again in the core cycle in which a place is seen to be free. That is up to a cycle later
// than the first whose memory clock would find it free.
typedef struct refused {
    uint64_t address, cycle;
} refused;

enum { REFUSED_MAX = 8 };

typedef struct slice {
    ticks channel;
    refused refused[REFUSED_MAX];
    int refused_count;
    uint64_t moved_until;  // the second level's port, in 2^-20 cycles
} slice;

struct tick_memory {
    const machine *machine;
    channel_timing timing;
    slice *slices;
    answer *waiting, *known;
    uint64_t bytes_read, bytes_written;
};

tick_memory *tick_memory_create(const machine *m)
{
    tick_memory *memory = calloc(1, sizeof *memory);
    memory->machine = m;
    memory->timing = (channel_timing){
        .core_mhz = m->core_mhz,
        .memory_mhz = m->memory_mhz,
        .bytes_per_clock = m->memory_bytes_per_clock,
        .burst_bytes = m->memory_burst_bytes,
        .banks = m->memory_banks,
        .row_bytes = m->memory_row_bytes,
        .t_cl = m->memory_t_cl,
        .t_wl = m->memory_t_wl,
        .t_rcd = m->memory_t_rcd,
        .t_rp = m->memory_t_rp,
        .t_ras = m->memory_t_ras,
        .t_rc = m->memory_t_rc,
        .t_rrd = m->memory_t_rrd,
        .t_wr = m->memory_t_wr,
        .t_wtr = m->memory_t_wtr,
        .latency_cycles = m->memory_latency_cycles,
        .write_queue = m->memory_write_queue,
    };
    assert(m->memory_banks <= TICK_BANKS && m->memory_write_queue <= TICK_WRITES);
    memory->slices = calloc((size_t)m->partitions, sizeof *memory->slices);
    for (int64_t p = 0; p < m->partitions; p++)
        ticks_start(&memory->slices[p].channel, &memory->timing);
    return memory;
}

static void free_answers(answer **list)
{
    while (*list) {
        answer *first = *list;
        *list = first->next;
        free(first);
    }
}

void tick_memory_forget(tick_memory *memory)
{
    assert(!memory->waiting);
    free_answers(&memory->known);
}

void tick_memory_destroy(tick_memory *memory)
{
    free_answers(&memory->waiting);
    free_answers(&memory->known);
    free(memory->slices);
    free(memory);
}

void tick_memory_advance(tick_memory *memory, uint64_t cycle)
{
    const channel_timing *t = &memory->timing;
    const int64_t clock = (int64_t)ticks_scaled(cycle, t->core_mhz, t->memory_mhz);
    for (int64_t p = 0; p < memory->machine->partitions; p++) {
        ticks *m = &memory->slices[p].channel;
        while (m->clock < clock)
            ticks_next(m);
        ticks_issue(m);
    }
    for (answer **a = &memory->waiting; *a;) {
        answer *one = *a;
        if (one->clock == TICK_NEVER) {
            a = &one->next;
            continue;
        }
        one->cycle = ticks_scaled(one->clock, t->memory_mhz, t->core_mhz) + (uint64_t)t->latency_cycles + one->added;
        one->cycle = one->cycle > one->not_before ? one->cycle : one->not_before;
        *a = one->next;
        one->next = memory->known;
        memory->known = one;
    }
}

static answer *ask(void)
{
    answer *answer = calloc(1, sizeof *answer);
    answer->clock = answer->cycle = TICK_NEVER;
    return answer;
}

const uint64_t *tick_memory_read(tick_memory *memory, uint32_t partition, uint64_t cycle, uint64_t address,
                                 uint32_t bytes)
{
    answer *answer = ask();
    answer->next = memory->waiting;
    memory->waiting = answer;
    ticks_ask(&memory->slices[partition].channel, cycle, address, bytes, &answer->clock);
    memory->bytes_read += bytes;
    return &answer->cycle;
}

// The second level moves bytes from `cycle` on; the cycle in which the last of them have passed.
static uint64_t move(tick_memory *memory, uint32_t partition, uint64_t cycle, uint32_t bytes)
{
    slice *slice = &memory->slices[partition];
    const machine *m = memory->machine;
    const uint64_t rate = (uint64_t)m->l2_bytes_per_clock;
    const uint64_t start = cycle * TICK_ONE > slice->moved_until ? cycle * TICK_ONE : slice->moved_until;
    slice->moved_until = start + ((uint64_t)bytes * (uint64_t)m->partitions * TICK_ONE + rate - 1) / rate;
    return (slice->moved_until + TICK_ONE - 1) / TICK_ONE;
}

const uint64_t *tick_memory_fetch(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer)
{
    if (!memory->machine->l2_bytes)
        return tick_memory_read(memory, partition, cycle, transfer->address, transfer->bytes);
    const uint64_t latency = (uint64_t)memory->machine->l2_latency_cycles;
    answer *answer = ask();
    answer->not_before = move(memory, partition, cycle, transfer->bytes) + latency;
    answer->added = latency;
    if (transfer->on_chip) {
        answer->cycle = answer->not_before;
        answer->next = memory->known;
        memory->known = answer;
        return &answer->cycle;
    }
    answer->next = memory->waiting;
    memory->waiting = answer;
    ticks_ask(&memory->slices[partition].channel, cycle, transfer->address, transfer->bytes, &answer->clock);
    memory->bytes_read += transfer->bytes;
    return &answer->cycle;
}

bool tick_memory_write(tick_memory *memory, uint32_t partition, uint64_t cycle, uint64_t address, uint32_t bytes)
{
    slice *slice = &memory->slices[partition];
    int i = 0;
    while (i < slice->refused_count && slice->refused[i].address != address)
        i++;
    if (i < slice->refused_count && slice->refused[i].cycle > cycle)
        return false;
    uint64_t when;
    const bool taken = ticks_write(&slice->channel, cycle, address, bytes, &when);
    if (!taken) {
        assert(i < REFUSED_MAX);
        slice->refused_count += i == slice->refused_count;
        slice->refused[i] = (refused){address, when};
    } else if (i < slice->refused_count) {
        slice->refused[i] = slice->refused[--slice->refused_count];
    }
    memory->bytes_written += taken ? bytes : 0;
    return taken;
}

bool tick_memory_spill(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer)
{
    if (transfer->bytes && transfer->on_chip)
        move(memory, partition, cycle, transfer->bytes);
    else if (transfer->bytes)
        return tick_memory_write(memory, partition, cycle, transfer->address, transfer->bytes);
    return true;
}

bool tick_memory_make_room(tick_memory *memory, uint32_t partition, uint64_t cycle, const transfer *transfer)
{
    return !transfer->evicted_bytes ||
           tick_memory_write(memory, partition, cycle, transfer->evicted_address, transfer->evicted_bytes);
}

uint64_t tick_memory_drain(tick_memory *memory, uint32_t partition, uint64_t cycle)
{
    slice *slice = &memory->slices[partition];
    const uint64_t written = ticks_drain(&slice->channel, cycle);
    const uint64_t moved = (slice->moved_until + TICK_ONE - 1) / TICK_ONE;
    return written > moved ? written : moved;
}

uint64_t tick_memory_bytes(const tick_memory *memory, bool written)
{
    return written ? memory->bytes_written : memory->bytes_read;
}
