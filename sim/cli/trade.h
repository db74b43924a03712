// What the files of `ropsim trade` share: command_trade.c reads the words, trade_measure.c runs a level in a process of its own,
// trade_print.c and trade_json.c tell what came out.
#ifndef ROPSIM_TRADE_H
#define ROPSIM_TRADE_H

#include "../levels.h"

enum { TRADE_SEEDS_MAX = 1000 };

// One run at a level, as it comes through the pipe.
typedef struct trade_figures {
    double cpu_seconds;          // user and system, with reading and the function level's run
    double again_seconds;        // of these, what one more run on the trace and program takes that finds both done, as in a sweep
    double peak_mib;             // of the process so far
    uint64_t visits;             // fragments replayed
    uint64_t cycles, bytes_read, bytes_written;
    double half_cycles, half_bytes;
    uint64_t windows, stamps, stamps_measured;
} trade_figures;

// A trace, program and machine at all levels.
typedef struct trade_row {
    const char *trace, *program;
    const machine *machine;
    trade_figures levels[DETAIL_SAMPLED];
    trade_figures *seeds;        // DETAIL_SAMPLED: a run each
    int seed_count;
} trade_row;

// What the seeds' estimates of one number were worth. Errors in per cent of the truth.
typedef struct trade_summary { double bias, mean, worst, half_width; int covered; } trade_summary;
typedef enum trade_quantity { TRADE_CYCLES, TRADE_BYTES } trade_quantity;

// Fills the row's figures; `first`: sampling of the first seed, the others count on from there. STATUS_REFUSED, as an internal
// error, if traffic and cycle give other bytes.
status trade_measure(trade_row *row, const sampling *first);
trade_summary trade_summarize(const trade_row *row, trade_quantity quantity);
double trade_error(const trade_row *row, const trade_figures *figures, trade_quantity quantity);  // in per cent of the truth
bool trade_covers(const trade_row *row, const trade_figures *figures, trade_quantity quantity);
double trade_half_width(const trade_row *row, const trade_figures *figures, trade_quantity quantity);  // in per cent of the truth
double trade_rate(const trade_figures *figures);        // fragment visits a second
double trade_rate_again(const trade_figures *figures);  // the same of one more run; 0 at the function level
trade_figures trade_sampled(const trade_row *row); // the first seed's, with the time of all seeds shared evenly

void trade_print(const trade_row *rows, int count);
status trade_write_json(const trade_row *rows, int count, const sampling *first, const char *path);

#endif
