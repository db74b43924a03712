// Requests nearly in order of time -> lines in order of time, one a burst, in the words of another simulator.
//
// Channels are told of their requests one after the other, and each may be ahead of the next. So requests wait in a
// heap, earliest on top, and are written when it is full or at the end.
#include "request_log.h"
#include "../levels.h"

#include <assert.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

typedef struct log_line {
    uint64_t core_cycle, memory_clock, local, flat;  // addresses in the channel and over all channels
    uint32_t bytes;
    int channel;
    bool write;
} log_line;

typedef struct log_format {
    const char *header;
    void (*print)(FILE *file, const log_line *line);
} log_format;

static void print_dramsim3(FILE *file, const log_line *line)
{
    fprintf(file, "0x%" PRIX64 " %s %" PRIu64 "\n", line->flat, line->write ? "WRITE" : "READ", line->memory_clock);
}

static void print_ramulator(FILE *file, const log_line *line)
{
    fprintf(file, "0x%" PRIx64 " %c\n", line->flat, line->write ? 'W' : 'R');
}

static void print_ramulator2(FILE *file, const log_line *line)
{
    fprintf(file, "%s 0x%" PRIx64 "\n", line->write ? "ST" : "LD", line->flat);
}

static void print_csv(FILE *file, const log_line *line)
{
    fprintf(file, "%" PRIu64 ",%" PRIu64 ",%d,0x%" PRIx64 ",%" PRIu32 ",%s,0x%" PRIx64 "\n", line->core_cycle,
            line->memory_clock, line->channel, line->local, line->bytes, line->write ? "write" : "read", line->flat);
}

const char *const request_formats[REQUEST_FORMATS] = {"dramsim3", "ramulator", "ramulator2", "csv"};
static const log_format formats[REQUEST_FORMATS] = {  // in their order
    {"", print_dramsim3},
    {"", print_ramulator},
    {"", print_ramulator2},
    {"core_cycle,memory_clock,channel,address,bytes,operation,flat_address\n", print_csv},
};

typedef struct held_request {
    logged_request request;
    uint64_t number;  // of the call, for requests of one cycle
} held_request;

struct request_log {
    aside *aside;
    FILE *file;
    const log_format *format;
    request_space space;
    uint64_t channels;                               // of the flat address: a power of two
    uint64_t calls, late, core_cycle, memory_clock;  // the last two: what the file has reached
    uint32_t held;
    held_request heap[REQUEST_LOG_HELD + 1];
};

static status refuse_format(const char *format, const report *report)
{
    const char *near = nearest_word(format, request_formats, REQUEST_FORMATS);
    return report_error(report, STATUS_USAGE, "'%s' is no format of a request log (dramsim3, ramulator, ramulator2, csv)%s%s%s", format,
                        near ? "; did you mean " : "", near ? near : "", near ? "?" : "");
}

status request_log_open(const char *path, const char *format, const request_space *space, const report *report, request_log **log)
{
    int found = 0;
    *log = NULL;
    assert(space->burst_bytes > 0 && space->channels > 0 && space->banks > 0 && space->row_bytes >= space->burst_bytes);
    while (found < REQUEST_FORMATS && strcmp(format, request_formats[found]) != 0)
        found++;
    if (found == REQUEST_FORMATS)
        return refuse_format(format, report);
    if (space->only >= space->channels)
        return report_error(report, STATUS_USAGE, "there is no channel %d: the machine has %d, numbered from 0", space->only, space->channels);
    request_log *new = malloc(sizeof *new);
    if (!new)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    new->format = &formats[found];
    new->space = *space;
    new->channels = 1;
    while (space->only < 0 && new->channels < (uint64_t)space->channels)
        new->channels *= 2;
    new->calls = new->late = new->core_cycle = new->memory_clock = 0;
    new->held = 0;
    status result = aside_open(path, report, &new->aside, &new->file);
    if (result != STATUS_OK) {
        free(new);
        return result;
    }
    fputs(new->format->header, new->file);  // an error stays with the file until request_log_finish
    *log = new;
    return STATUS_OK;
}

// ---- The heap ------------------------------------------------------------------------------------------

static bool before(const held_request *a, const held_request *b)
{
    if (a->request.core_cycle != b->request.core_cycle)
        return a->request.core_cycle < b->request.core_cycle;
    return a->number < b->number;
}

static void heap_push(request_log *log, const held_request *held)
{
    uint32_t at = log->held++;
    for (uint32_t parent; at > 0 && before(held, &log->heap[parent = (at - 1) / 2]); at = parent)
        log->heap[at] = log->heap[parent];
    log->heap[at] = *held;
}

static held_request heap_pop(request_log *log)
{
    const held_request top = log->heap[0], last = log->heap[--log->held];
    uint32_t at = 0;
    for (uint32_t child; (child = 2 * at + 1) < log->held; at = child) {
        if (child + 1 < log->held && before(&log->heap[child + 1], &log->heap[child]))
            child++;
        if (!before(&log->heap[child], &last))
            break;
        log->heap[at] = log->heap[child];
    }
    log->heap[at] = last;
    return top;
}

// ---- Lines ---------------------------------------------------------------------------------------------

// A simulator takes bank and row from an address's bits, so they stand there as the channel has them; a burst lies within a row.
static uint64_t flat_address(const request_log *log, const logged_request *request, uint64_t address)
{
    const request_space *space = &log->space;
    const uint64_t number = address / space->row_bytes, first_of_banks = number - number % space->banks;
    const uint64_t place = (first_of_banks + bank_of_row(number, space->banks)) * space->row_bytes + address % space->row_bytes;
    const uint64_t channel = space->only < 0 ? (uint64_t)request->channel : 0;
    return (place / space->burst_bytes * log->channels + channel) * space->burst_bytes;
}

static void write_earliest(request_log *log)
{
    const held_request top = heap_pop(log);
    const logged_request *request = &top.request;
    const uint64_t burst_bytes = log->space.burst_bytes, first = request->address / burst_bytes * burst_bytes;
    if (request->core_cycle > log->core_cycle) {
        log->core_cycle = request->core_cycle;
        log->memory_clock = request->memory_clock;
    }
    // A late one has the cycle of the line before, so that cycles never go back.
    for (uint64_t done = 0; done < request->bytes; done += burst_bytes)
        log->format->print(log->file, &(log_line){
                                          .core_cycle = log->core_cycle,
                                          .memory_clock = log->memory_clock,
                                          .local = first + done,
                                          .flat = flat_address(log, request, first + done),
                                          .bytes = (uint32_t)burst_bytes,
                                          .channel = request->channel,
                                          .write = request->write,
                                      });
}

void request_log_add(request_log *log, const logged_request *request)
{
    assert(request->channel >= 0 && request->channel < log->space.channels);
    if (log->space.only >= 0 && request->channel != log->space.only)
        return;
    log->late += request->core_cycle < log->core_cycle;
    heap_push(log, &(held_request){*request, log->calls++});
    if (log->held > REQUEST_LOG_HELD)
        write_earliest(log);
}

uint64_t request_log_late(const request_log *log)
{
    return log->late;
}

status request_log_finish(request_log *log)
{
    while (log->held > 0)
        write_earliest(log);
    status result = aside_finish(log->aside);
    free(log);
    return result;
}

void request_log_abandon(request_log *log)
{
    if (!log)
        return;
    aside_discard(log->aside);
    free(log);
}
