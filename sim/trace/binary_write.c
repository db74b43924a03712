// Blocks to chunks: transform, compress, checksum, note in the index. The index, 56 bytes a chunk, is what grows.
#include "columns.h"
#include "form.h"
#include "records.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>
#include <zstd.h>

// Higher levels make meshes no smaller and cost twice the time; what packs here is packed by the guesses.
enum { ZSTD_LEVEL = 1 };

typedef struct binary_writer {
    FILE *file;
    trace_info info;
    uint64_t offset;
    uint8_t (*draws)[DRAW_BYTES];
    uint32_t draw_count, draw_room;
    uint8_t (*chunks)[CHUNK_BYTES];
    uint64_t chunk_count, chunk_room;
    uint64_t fragment_count;
    columns *columns;
    uint8_t *planes, *frame;
    size_t frame_room;
    ZSTD_CCtx *zstd;
} binary_writer;

static void binary_writer_destroy(void *self)
{
    binary_writer *writer = self;
    free(writer->draws);
    free(writer->chunks);
    free(writer->columns);
    free(writer->planes);
    free(writer->frame);
    ZSTD_freeCCtx(writer->zstd);
    free(writer);
}

static bool binary_begin_draw(void *self, const trace_draw *draw)
{
    (void)draw;
    binary_writer *writer = self;
    if (writer->draw_count == writer->draw_room) {
        uint32_t room = writer->draw_room ? 2 * writer->draw_room : 16;
        void *draws = realloc(writer->draws, (size_t)room * DRAW_BYTES);
        if (!draws)
            return false;
        writer->draws = draws;
        writer->draw_room = room;
    }
    return true;
}

static bool binary_block(void *self, const block *block, const uint8_t digest[DIGEST_BYTES])
{
    binary_writer *writer = self;
    if (writer->chunk_count == writer->chunk_room) {
        uint64_t room = writer->chunk_room ? 2 * writer->chunk_room : 64;
        void *chunks = realloc(writer->chunks, (size_t)room * CHUNK_BYTES);
        if (!chunks)
            return false;
        writer->chunks = chunks;
        writer->chunk_room = room;
    }
    columns_encode(writer->columns, block, writer->info.depth_bits, writer->planes);
    size_t stored = ZSTD_compressCCtx(writer->zstd, writer->frame, writer->frame_room, writer->planes,
                                      columns_bytes(block->count, writer->info.depth_bits), ZSTD_LEVEL);
    if (ZSTD_isError(stored) || fwrite(writer->frame, 1, stored, writer->file) != stored)
        return false;
    chunk_record record = {.offset = writer->offset,
                           .stored_bytes = (uint32_t)stored,
                           .draw = writer->draw_count,
                           .count = block->count,
                           .bounds = block_bounds(block),
                           .checksum = XXH3_64bits(writer->frame, stored)};
    memcpy(record.digest, digest, DIGEST_BYTES);
    chunk_encode(&record, writer->chunks[writer->chunk_count++]);
    writer->offset += stored;
    writer->fragment_count += block->count;
    return true;
}

static bool binary_end_draw(void *self, const trace_draw *draw)
{
    binary_writer *writer = self;
    draw_encode(draw, writer->draws[writer->draw_count++]);
    return true;
}

static bool binary_finish(void *self, const uint8_t hash[DIGEST_BYTES])
{
    binary_writer *writer = self;
    trailer_record trailer = {.table_offset = writer->offset,
                              .draw_count = writer->draw_count,
                              .chunk_count = writer->chunk_count,
                              .fragment_count = writer->fragment_count};
    memcpy(trailer.hash, hash, DIGEST_BYTES);
    uint8_t bytes[TRAILER_BYTES];
    trailer_encode(&trailer, bytes);
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return false;
    size_t draws_bytes = (size_t)writer->draw_count * DRAW_BYTES,
           chunks_bytes = (size_t)writer->chunk_count * CHUNK_BYTES;
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, writer->draws, draws_bytes);
    XXH3_64bits_update(state, writer->chunks, chunks_bytes);
    XXH3_64bits_update(state, bytes, TRAILER_CHECKSUM);
    trailer.checksum = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    trailer_encode(&trailer, bytes);
    // fwrite of nothing from NULL is not defined
    return (draws_bytes == 0 || fwrite(writer->draws, 1, draws_bytes, writer->file) == draws_bytes) &&
           (chunks_bytes == 0 || fwrite(writer->chunks, 1, chunks_bytes, writer->file) == chunks_bytes) &&
           fwrite(bytes, 1, TRAILER_BYTES, writer->file) == TRAILER_BYTES;
}

static const writer_form binary_writer_form = {binary_begin_draw, binary_block, binary_end_draw, binary_finish,
                                               binary_writer_destroy};

bool binary_create(FILE *file, const trace_info *info, created *created)
{
    binary_writer *writer = calloc(1, sizeof *writer);
    if (!writer)
        return false;
    *created = (struct created){&binary_writer_form, writer};
    writer->file = file;
    writer->info = *info;
    size_t planes_room = columns_bytes(BLOCK_MAX, info->depth_bits);
    writer->frame_room = ZSTD_compressBound(planes_room);
    writer->columns = columns_create();
    writer->planes = malloc(planes_room);
    writer->frame = malloc(writer->frame_room);
    writer->zstd = ZSTD_createCCtx();
    uint8_t header[HEADER_BYTES];
    header_encode(info, header);
    writer->offset = HEADER_BYTES;
    if (!writer->columns || !writer->planes || !writer->frame || !writer->zstd ||
        fwrite(header, 1, HEADER_BYTES, file) != HEADER_BYTES) {
        binary_writer_destroy(writer);
        return false;
    }
    return true;
}
