// The binary form, read chunk by chunk. Opening checks header, index and trailer, and that the index gives the hash of
// the whole; each chunk is checked as it is read: first its bytes, then what they hold. Memory: the index as it stands
// in the file, never more than the file's own size, and 8 MB for one chunk.
#include "columns.h"
#include "form.h"
#include "records.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include <zstd.h>

typedef struct binary_reader {
    const char *path;
    const report *report;
    int descriptor;
    const trace_info *info;
    uint8_t *tables;  // draw records, then chunk records
    const uint8_t *chunks;
    uint64_t chunk_count, next;
    bounds asked, region;  // as selected, and in force since the last rewind
    bool asked_places, places_only;
    columns *columns;
    block *block;
    content *content;
    uint8_t *frame, *planes;
    size_t frame_room;
    ZSTD_DCtx *zstd;
} binary_reader;

static void binary_close(void *self)
{
    binary_reader *reader = self;
    close(reader->descriptor);
    free(reader->tables);
    free(reader->columns);
    free(reader->block);
    content_destroy(reader->content);
    free(reader->frame);
    free(reader->planes);
    ZSTD_freeDCtx(reader->zstd);
    free(reader);
}

static status read_exact(const binary_reader *reader, void *bytes, size_t size, uint64_t offset)
{
    for (size_t done = 0; done < size;) {
        ssize_t got = pread(reader->descriptor, (uint8_t *)bytes + done, size - done, (off_t)(offset + done));
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return report_error(reader->report, STATUS_IO, "%s: byte %" PRIu64 ": cannot be read: %s", reader->path,
                                offset + done, strerror(errno));
        if (got == 0)
            return report_error(reader->report, STATUS_REFUSED,
                                "%s: byte %" PRIu64 ": the file ends here, %zu bytes early", reader->path,
                                offset + done, size - done);
        done += (size_t)got;
    }
    return STATUS_OK;
}

static status refuse(const binary_reader *reader, uint64_t offset, const char *why)
{
    return report_error(reader->report, STATUS_REFUSED, "%s: byte %" PRIu64 ": %s", reader->path, offset, why);
}

// The trailer and the tables it points to, whose place and size must add up to the file's.
static status read_tables(binary_reader *reader, uint64_t file_bytes, trailer_record *trailer)
{
    uint8_t bytes[TRAILER_BYTES];
    char why[WHY_SIZE];
    uint64_t place = file_bytes - TRAILER_BYTES;
    status result = read_exact(reader, bytes, sizeof bytes, place);
    if (result != STATUS_OK)
        return result;
    if (!trailer_decode(bytes, trailer, why))
        return refuse(reader, place, why);
    // The bounds on the counts come first, so that the sizes below cannot wrap.
    if (trailer->table_offset < HEADER_BYTES || trailer->table_offset > place ||
        trailer->chunk_count > file_bytes / CHUNK_BYTES)
        return refuse(reader, place, "the trailer's table offset or chunk count lies outside the file");
    uint64_t draws_bytes = (uint64_t)trailer->draw_count * DRAW_BYTES;
    uint64_t tables_bytes = draws_bytes + trailer->chunk_count * CHUNK_BYTES;
    if (tables_bytes != place - trailer->table_offset)
        return refuse(reader, place, "the trailer's counts of draws and chunks do not fit the file's size");
    reader->tables = malloc(tables_bytes ? (size_t)tables_bytes : 1);
    if (!reader->tables)
        return report_error(reader->report, STATUS_IO, "%s: no memory for an index of %" PRIu64 " bytes", reader->path,
                            tables_bytes);
    result = read_exact(reader, reader->tables, (size_t)tables_bytes, trailer->table_offset);
    if (result != STATUS_OK)
        return result;
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return report_error(reader->report, STATUS_IO, "%s: no memory", reader->path);
    XXH3_64bits_reset(state);
    XXH3_64bits_update(state, reader->tables, (size_t)tables_bytes);
    XXH3_64bits_update(state, bytes, TRAILER_CHECKSUM);
    uint64_t checksum = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    if (checksum != trailer->checksum)
        return refuse(reader, trailer->table_offset,
                      "the checksum of the draws, the index and the trailer does not fit");
    reader->chunks = reader->tables + draws_bytes;
    reader->chunk_count = trailer->chunk_count;
    return STATUS_OK;
}

static status read_draws(binary_reader *reader, const trailer_record *trailer, trace_info *info)
{
    info->draws = calloc(trailer->draw_count ? trailer->draw_count : 1, sizeof *info->draws);
    if (!info->draws)
        return report_error(reader->report, STATUS_IO, "%s: no memory", reader->path);
    info->draw_count = trailer->draw_count;
    for (uint32_t d = 0; d < info->draw_count; d++) {
        char why[WHY_SIZE];
        if (!draw_decode(reader->tables + (size_t)d * DRAW_BYTES, &info->draws[d], why))
            return report_error(reader->report, STATUS_REFUSED, "%s: byte %" PRIu64 ": draw %u: %s", reader->path,
                                trailer->table_offset + (uint64_t)d * DRAW_BYTES, d, why);
        if (__builtin_add_overflow(info->fragment_count, info->draws[d].fragments, &info->fragment_count))
            return refuse(reader, trailer->table_offset, "the draws have more fragments than 64 bits count");
    }
    if (info->fragment_count != trailer->fragment_count)
        return refuse(reader, trailer->table_offset, "the draws' fragments do not add up to the trailer's count");
    return STATUS_OK;
}

// What is wrong with one index record that follows `end` and has `left` fragments of its draw to come; NULL: nothing.
static const char *chunk_flaw(const binary_reader *reader, const uint8_t bytes[CHUNK_BYTES], const chunk_record *chunk,
                              uint32_t draw, uint64_t left, uint64_t end)
{
    uint8_t again[CHUNK_BYTES];
    chunk_encode(chunk, again);
    if (memcmp(bytes, again, CHUNK_BYTES) != 0)
        return "bytes 28 to 31 are not 0";
    if (chunk->draw != draw)
        return "its draw is not the next one with fragments to come";
    if (chunk->count != (left < BLOCK_MAX ? left : BLOCK_MAX))
        return "its count is not 65536 or, for a draw's last chunk, the rest of the draw";
    if (chunk->offset != end || chunk->stored_bytes == 0 || chunk->stored_bytes > reader->frame_room)
        return "its offset or size is not that of the chunk that follows the one before";
    const bounds *box = &chunk->bounds;
    if (box->x0 >= box->x1 || box->x1 > reader->info->width || box->y0 >= box->y1 || box->y1 > reader->info->height)
        return "its bounding box is empty or outside the picture";
    return NULL;
}

// Walks the index along the draws; every byte between header and tables must belong to exactly one chunk.
static status check_index(binary_reader *reader, const trailer_record *trailer)
{
    const trace_info *info = reader->info;
    uint64_t end = HEADER_BYTES, c = 0;
    for (uint32_t d = 0; d < info->draw_count; d++) {
        for (uint64_t left = info->draws[d].fragments; left > 0; c++) {
            if (c == reader->chunk_count)
                return refuse(reader, trailer->table_offset, "the index has fewer chunks than the draws need");
            const uint8_t *bytes = reader->chunks + c * CHUNK_BYTES;
            chunk_record chunk;
            chunk_decode(bytes, &chunk);
            const char *flaw = chunk_flaw(reader, bytes, &chunk, d, left, end);
            if (flaw)
                return report_error(reader->report, STATUS_REFUSED,
                                    "%s: byte %" PRIu64 ": index of chunk %" PRIu64 ": %s", reader->path,
                                    trailer->table_offset + (uint64_t)(bytes - reader->tables), c, flaw);
            end += chunk.stored_bytes;
            left -= chunk.count;
            content_add_digest(reader->content, chunk.digest);
        }
        content_add_draw(reader->content, &info->draws[d]);
    }
    if (c != reader->chunk_count || end != trailer->table_offset)
        return refuse(reader, end, "bytes or index records that belong to no draw");
    uint8_t hash[DIGEST_BYTES];
    content_end(reader->content, hash);
    if (memcmp(hash, trailer->hash, DIGEST_BYTES) != 0)
        return refuse(reader, trailer->table_offset, "the trailer's hash is not that of the index");
    return STATUS_OK;
}

// Checks a chunk's bytes and unpacks them into reader->block.
static status read_chunk(binary_reader *reader, uint64_t index, const chunk_record *chunk)
{
    status result = read_exact(reader, reader->frame, chunk->stored_bytes, chunk->offset);
    if (result != STATUS_OK)
        return result;
    size_t planes_bytes = columns_bytes(chunk->count, reader->info->depth_bits);
    char why[WHY_SIZE];
    const char *flaw = NULL;
    uint8_t digest[DIGEST_BYTES];
    block *block = reader->block;
    if (XXH3_64bits(reader->frame, chunk->stored_bytes) != chunk->checksum)
        flaw = "its bytes do not fit its checksum";
    else if (ZSTD_findFrameCompressedSize(reader->frame, chunk->stored_bytes) != chunk->stored_bytes ||
             ZSTD_getFrameContentSize(reader->frame, chunk->stored_bytes) != planes_bytes ||
             ZSTD_decompressDCtx(reader->zstd, reader->planes, planes_bytes, reader->frame, chunk->stored_bytes) !=
                 planes_bytes)
        flaw = "is not one zstd frame of its fragments' size";
    if (!flaw && reader->places_only) {
        block->count = chunk->count;
        columns_decode_places(reader->planes, block);
        flaw = block_places_check(reader->info, block) ? NULL : "a fragment lies outside the image";
    } else if (!flaw) {
        block->count = chunk->count;
        columns_decode(reader->columns, reader->planes, reader->info->depth_bits, block);
        bounds box = block_bounds(block);
        if (!block_check(reader->info, block, why))
            flaw = why;
        else if (memcmp(&box, &chunk->bounds, sizeof box) != 0)
            flaw = "its fragments do not fit its bounding box";
        else if (content_digest(reader->content, block, digest), memcmp(digest, chunk->digest, DIGEST_BYTES) != 0)
            flaw = "its fragments do not fit its digest";
    }
    return flaw ? report_error(reader->report, STATUS_REFUSED, "%s: byte %" PRIu64 ": chunk %" PRIu64 ": %s",
                               reader->path, chunk->offset, index, flaw)
                : STATUS_OK;
}

static status binary_next(void *self, fragments *fragments)
{
    binary_reader *reader = self;
    const bounds *region = &reader->region;
    while (reader->next < reader->chunk_count) {
        uint64_t index = reader->next++;
        chunk_record chunk;
        chunk_decode(reader->chunks + index * CHUNK_BYTES, &chunk);
        const bounds *box = &chunk.bounds;
        if (box->x0 >= region->x1 || box->x1 <= region->x0 || box->y0 >= region->y1 || box->y1 <= region->y0)
            continue;
        status result = read_chunk(reader, index, &chunk);
        if (result == STATUS_OK)
            block_view(reader->block, chunk.draw, fragments);
        if (reader->places_only) {
            fragments->depth = NULL;
            fragments->primitive = NULL;
            memset(fragments->rgba, 0, sizeof fragments->rgba);
        }
        return result;
    }
    return STATUS_OK;
}

static status binary_rewind(void *self)
{
    binary_reader *reader = self;
    reader->next = 0;
    reader->region = reader->asked;
    reader->places_only = reader->asked_places;
    return STATUS_OK;
}

static void binary_select(void *self, const bounds *region)
{
    ((binary_reader *)self)->asked = *region;
}

static void binary_places(void *self, bool only)
{
    ((binary_reader *)self)->asked_places = only;
}

static const trace_form binary_form = {binary_next, binary_rewind, binary_select, binary_places, binary_close};

static status open_checked(binary_reader *reader, trace_info *info)
{
    struct stat file;
    uint8_t header[HEADER_BYTES];
    char why[WHY_SIZE];
    if (fstat(reader->descriptor, &file) != 0)
        return report_error(reader->report, STATUS_IO, "%s: %s", reader->path, strerror(errno));
    status result = read_exact(reader, header, sizeof header, 0);
    if (result != STATUS_OK)
        return result;
    if (!header_decode(header, info, why))
        return report_error(reader->report, STATUS_REFUSED, "%s: %s", reader->path, why);
    uint64_t file_bytes = (uint64_t)file.st_size;
    if (file_bytes < HEADER_BYTES + TRAILER_BYTES)
        return refuse(reader, file_bytes, "the file ends before its trailer: it was cut or was not finished");

    size_t planes_room = columns_bytes(BLOCK_MAX, info->depth_bits);
    reader->frame_room = ZSTD_compressBound(planes_room);
    reader->planes = malloc(planes_room);
    reader->frame = malloc(reader->frame_room);
    reader->block = malloc(sizeof *reader->block);
    reader->columns = columns_create();
    reader->content = content_create(info);
    reader->zstd = ZSTD_createDCtx();
    if (!reader->planes || !reader->frame || !reader->block || !reader->columns || !reader->content || !reader->zstd)
        return report_error(reader->report, STATUS_IO, "%s: no memory", reader->path);

    trailer_record trailer;
    result = read_tables(reader, file_bytes, &trailer);
    if (result == STATUS_OK)
        result = read_draws(reader, &trailer, info);
    if (result == STATUS_OK)
        result = check_index(reader, &trailer);
    if (result == STATUS_OK)
        content_hex(trailer.hash, info->hash);
    return result;
}

status binary_open(const char *path, int descriptor, const report *report, trace_info *info, opened *opened)
{
    binary_reader *reader = calloc(1, sizeof *reader);
    if (!reader) {
        close(descriptor);
        return report_error(report, STATUS_IO, "%s: no memory", path);
    }
    *reader = (binary_reader){.path = path, .report = report, .descriptor = descriptor, .info = info};
    reader->asked = reader->region = (bounds){0, 0, UINT16_MAX, UINT16_MAX};
    status result = open_checked(reader, info);
    if (result != STATUS_OK) {
        binary_close(reader);
        return result;
    }
    *opened = (struct opened){&binary_form, reader};
    return STATUS_OK;
}
