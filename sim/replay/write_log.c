// Rows of bits, a tile's up to its last draw that wrote: a tile that is finished takes no more room, however long others go on.
#include "write_log.h"

#include <stdlib.h>
#include <string.h>

enum { WORD_BITS = 64 };

typedef struct tile_writes {
    uint64_t *rows;
    uint64_t row_count, row_capacity;
    uint32_t words;           // of a row
} tile_writes;

struct write_log {
    tile_writes *tiles;
    uint32_t tile_count, batch_count;
    uint64_t most_bytes;
    _Atomic uint64_t bytes;
    atomic_bool lost;
};

write_log *write_log_create(const bins *bins, uint64_t most_bytes)
{
    write_log *log = calloc(1, sizeof *log);
    if (!log)
        return NULL;
    log->tiles = calloc(bins->tile_count, sizeof *log->tiles);
    log->tile_count = bins->tile_count;
    log->most_bytes = most_bytes;
    if (!log->tiles) {
        write_log_destroy(log);
        return NULL;
    }
    for (uint32_t t = 0; t < bins->tile_count; t++) {
        const uint32_t batches = bins->bins[t].opaque_count + bins->bins[t].transparent_count;
        log->tiles[t].words = (batches + WORD_BITS - 1) / WORD_BITS;
        log->batch_count += batches;
    }
    return log;
}

void write_log_destroy(write_log *log)
{
    if (!log)
        return;
    for (uint32_t t = 0; log->tiles && t < log->tile_count; t++)
        free(log->tiles[t].rows);
    free(log->tiles);
    free(log);
}

// Has the tile at least so many rows; false: the log is lost.
static bool reserve(write_log *log, tile_writes *tile, uint64_t rows)
{
    enum { FEW_ROWS = 8 };
    if (rows > tile->row_capacity && !atomic_load(&log->lost)) {
        const uint64_t capacity = rows + rows / 2 + FEW_ROWS, bytes = (capacity - tile->row_capacity) * tile->words * sizeof *tile->rows;
        uint64_t *grown = NULL;
        if (atomic_fetch_add(&log->bytes, bytes) + bytes <= log->most_bytes)
            grown = realloc(tile->rows, (size_t)(capacity * tile->words * sizeof *grown));
        if (grown) {
            tile->rows = grown;
            tile->row_capacity = capacity;
        } else {
            atomic_store(&log->lost, true);
        }
    }
    if (atomic_load(&log->lost))
        return false;
    if (rows > tile->row_count) {
        memset(tile->rows + tile->row_count * tile->words, 0, (size_t)((rows - tile->row_count) * tile->words * sizeof *tile->rows));
        tile->row_count = rows;
    }
    return true;
}

void write_log_note(write_log *log, uint32_t tile, uint64_t draw, uint64_t batch)
{
    tile_writes *t = &log->tiles[tile];
    if (reserve(log, t, draw + 1))
        t->rows[draw * t->words + batch / WORD_BITS] |= UINT64_C(1) << batch % WORD_BITS;
}

void write_log_repeat(write_log *log, uint32_t tile, uint64_t draw, uint64_t count)
{
    tile_writes *t = &log->tiles[tile];
    if (t->row_count <= draw - count)  // none of them wrote
        return;
    if (reserve(log, t, draw + count))
        memcpy(t->rows + draw * t->words, t->rows + (draw - count) * t->words, (size_t)(count * t->words * sizeof *t->rows));
}

bool write_log_is_of(const write_log *log, uint32_t batch_count)
{
    return log && !atomic_load(&log->lost) && log->batch_count == batch_count;
}

const uint64_t *write_log_row(const write_log *log, uint32_t tile, uint64_t draw)
{
    const tile_writes *t = &log->tiles[tile];
    return draw < t->row_count ? t->rows + draw * t->words : NULL;
}

uint32_t write_log_next(const uint64_t *row, uint32_t batch, uint32_t end)
{
    while (batch < end) {
        const uint64_t left = row[batch / WORD_BITS] >> batch % WORD_BITS;
        if (left) {
            const uint32_t found = batch + (uint32_t)__builtin_ctzll(left);
            return found < end ? found : end;
        }
        batch = (batch / WORD_BITS + 1) * WORD_BITS;
    }
    return end;
}
