// Which batches wrote to a plane in which draw. The function level finds that out on its way; a deeper level that meets the same batches
// (bins_share.c) again, and wants no more of them than what planes hold, need not run any other.
#ifndef ROPSIM_WRITE_LOG_H
#define ROPSIM_WRITE_LOG_H

#include "replay.h"

// Of all tiles of a run. Each tile may be written to by another thread.
typedef struct write_log write_log;

// For bins that are shared. At most so many bytes are taken; what needs more is lost. NULL: out of memory.
write_log *write_log_create(const bins *bins, uint64_t most_bytes);
void write_log_destroy(write_log *log);  // NULL is fine
// A batch of the tile, counted from its first in the bins' columns, wrote in draw number `draw`; draws come in order.
void write_log_note(write_log *log, uint32_t tile, uint64_t draw, uint64_t batch);
// The tile's draws before number `draw`, so many, come again as they were.
void write_log_repeat(write_log *log, uint32_t tile, uint64_t draw, uint64_t count);
// Whether nothing was lost, and it is of so many batches in all.
bool write_log_is_of(const write_log *log, uint32_t batch_count);
// A bit for each of the tile's batches, by 64; NULL: none of them wrote. Draws behind the last of the schedule wrote nothing.
const uint64_t *write_log_row(const write_log *log, uint32_t tile, uint64_t draw);
// The first batch from `batch` on, and before `end`, whose bit is set; `end`: none.
uint32_t write_log_next(const uint64_t *row, uint32_t batch, uint32_t end);

#endif
