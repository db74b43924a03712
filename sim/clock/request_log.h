// The requests to DRAM as a file that public DRAM simulators read: requests of all channels go in, nearly in order of
// time; one line a burst comes out, in order of time.
//
// The cycle of a line is the one in which the channel accepted the request, not the one in which it was performed: a
// simulator that reads the file has a write queue of its own. docs/dram.md has the formats and the addresses.
#ifndef ROPSIM_CLOCK_REQUEST_LOG_H
#define ROPSIM_CLOCK_REQUEST_LOG_H

#include "../../isa/isa.h"

typedef struct request_log request_log;

// Where a request lies in the one space of all channels.
typedef struct request_space {
    uint32_t burst_bytes;
    int channels;                  // at least 1
    int only;                      // -1: all, or the one channel that is logged: a space by itself
    uint64_t banks, row_bytes;     // of a channel; row_bytes: a multiple of burst_bytes
} request_space;

// format: one of request_formats (levels.h); STATUS_USAGE if it is none of them, or if there is no channel `only`. The file is
// written aside and renamed into place by request_log_finish. `report` outlives the log.
status request_log_open(const char *path, const char *format, const request_space *space, const report *report, request_log **log);

// A request as a channel accepted it. core_cycle and memory_clock: the same moment; address and bytes: within the
// channel, whole bursts. Lines are sorted by core cycle, then in order of calls, as long as none comes more than
// REQUEST_LOG_HELD requests late; one that does is written at the cycle that the file has reached.
enum { REQUEST_LOG_HELD = 65536 };
typedef struct logged_request {
    uint64_t core_cycle, memory_clock, address, bytes;
    int channel;
    bool write;
} logged_request;
void request_log_add(request_log *log, const logged_request *request);  // of another channel than `only`: nothing

uint64_t request_log_late(const request_log *log);  // requests that came too late for their place
status request_log_finish(request_log *log);        // frees the log, also on failure; then no file stays
void request_log_abandon(request_log *log);         // frees it and leaves no file; NULL is fine

#endif
