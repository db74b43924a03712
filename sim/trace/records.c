// The binary form's records to bytes and back. A field is put and taken at the offset that docs/trace.md gives it.
#include "records.h"

#include <string.h>
#include <xxhash.h>

const uint8_t header_magic[8] = {0x89, 'R', 'O', 'P', 'T', '\r', '\n', 0x1a};
const uint8_t trailer_magic[8] = {'R', 'O', 'P', 'T', 'E', 'N', 'D', '\n'};

enum { FLAG_NONFINITE = 1, FLAG_REVERSED = 2 };

static void put(uint8_t *bytes, const void *value, size_t size)
{
    memcpy(bytes, value, size);
}

static void put_u16(uint8_t *bytes, uint16_t value)
{
    put(bytes, &value, sizeof value);
}
static void put_u32(uint8_t *bytes, uint32_t value)
{
    put(bytes, &value, sizeof value);
}
static void put_u64(uint8_t *bytes, uint64_t value)
{
    put(bytes, &value, sizeof value);
}

static uint16_t get_u16(const uint8_t *bytes)
{
    uint16_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

static uint32_t get_u32(const uint8_t *bytes)
{
    uint32_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

static uint64_t get_u64(const uint8_t *bytes)
{
    uint64_t value;
    memcpy(&value, bytes, sizeof value);
    return value;
}

void header_encode(const trace_info *info, uint8_t bytes[HEADER_BYTES])
{
    memset(bytes, 0, HEADER_BYTES);
    put(bytes, header_magic, sizeof header_magic);
    put_u32(bytes + 8, TRACE_VERSION);
    put_u32(bytes + 12, HEADER_BYTES);
    put_u32(bytes + 16, info->width);
    put_u32(bytes + 20, info->height);
    put_u32(bytes + 24, info->samples);
    put_u32(bytes + 28, (uint32_t)info->depth_bits);
    put_u32(bytes + 32, (info->nonfinite ? FLAG_NONFINITE : 0u) | (info->reversed_depth ? FLAG_REVERSED : 0u));
    put_u32(bytes + 36, BLOCK_MAX);
    put(bytes + 40, info->background, sizeof info->background);
    for (uint32_t s = 0; s < info->samples; s++)
        put(bytes + 56 + 4 * s, info->sample_positions[s], 4);
    put_u64(bytes + HEADER_CHECKSUM, XXH3_64bits(bytes, HEADER_CHECKSUM));
}

bool header_decode(const uint8_t bytes[HEADER_BYTES], trace_info *info, char why[WHY_SIZE])
{
    memset(info, 0, sizeof *info);
    if (memcmp(bytes, header_magic, sizeof header_magic) != 0)
        return snprintf(why, WHY_SIZE, "byte 0: not the mark of a binary trace"), false;
    if (get_u32(bytes + 8) != TRACE_VERSION)
        return snprintf(why, WHY_SIZE, "byte 8: version %u, only version %d is known", get_u32(bytes + 8),
                        TRACE_VERSION),
               false;
    if (get_u64(bytes + HEADER_CHECKSUM) != XXH3_64bits(bytes, HEADER_CHECKSUM))
        return snprintf(why, WHY_SIZE, "byte %d: the header's checksum does not fit bytes 0 to 119", HEADER_CHECKSUM),
               false;
    if (get_u32(bytes + 12) != HEADER_BYTES)
        return snprintf(why, WHY_SIZE, "byte 12: header of %u bytes, must be %d", get_u32(bytes + 12), HEADER_BYTES),
               false;
    if (get_u32(bytes + 32) > (FLAG_NONFINITE | FLAG_REVERSED))
        return snprintf(why, WHY_SIZE, "byte 32: flags 0x%x, only bits 0 and 1 are known", get_u32(bytes + 32)), false;
    if (get_u32(bytes + 36) != BLOCK_MAX)
        return snprintf(why, WHY_SIZE, "byte 36: %u fragments a chunk, must be %d", get_u32(bytes + 36), BLOCK_MAX),
               false;
    info->width = get_u32(bytes + 16);
    info->height = get_u32(bytes + 20);
    info->samples = get_u32(bytes + 24);
    info->depth_bits = get_u32(bytes + 28) <= 64 ? (int)get_u32(bytes + 28) : -1;
    info->nonfinite = get_u32(bytes + 32) & FLAG_NONFINITE;
    info->reversed_depth = get_u32(bytes + 32) & FLAG_REVERSED;
    memcpy(info->background, bytes + 40, sizeof info->background);
    for (uint32_t s = 0; s < TRACE_SAMPLES_MAX; s++)
        memcpy(info->sample_positions[s], bytes + 56 + 4 * s, 4);
    char reason[WHY_SIZE - 32];
    if (!info_check(info, why)) {
        snprintf(reason, sizeof reason, "%s", why);
        return snprintf(why, WHY_SIZE, "header (bytes 16 to 119): %s", reason), false;
    }
    return true;
}

void draw_encode(const trace_draw *draw, uint8_t bytes[DRAW_BYTES])
{
    memset(bytes, 0, DRAW_BYTES);
    put(bytes, draw->name, strnlen(draw->name, NAME_SIZE - 1));
    put_u32(bytes + 64, draw->class);
    put_u64(bytes + 72, draw->triangles);
    put_u64(bytes + 80, draw->vertices);
    put_u64(bytes + 88, draw->fragments);
}

bool draw_decode(const uint8_t bytes[DRAW_BYTES], trace_draw *draw, char why[WHY_SIZE])
{
    memset(draw, 0, sizeof *draw);
    size_t length = strnlen((const char *)bytes, NAME_SIZE);
    for (size_t i = length; i < NAME_SIZE; i++)
        if (bytes[i] != 0)
            return snprintf(why, WHY_SIZE, "bytes after its name's end are not 0"), false;
    if (!draw_name_check((const char *)bytes, length))
        return snprintf(why, WHY_SIZE, "its name is not 1 to 63 visible ASCII characters without '#'"), false;
    uint32_t class = get_u32(bytes + 64);
    if (class >= CLASS_COUNT)
        return snprintf(why, WHY_SIZE, "class %u, must be 0 (opaque), 1 (transparent) or 2 (sorted)", class), false;
    if (get_u32(bytes + 68) != 0)
        return snprintf(why, WHY_SIZE, "its bytes 68 to 71 are not 0"), false;
    memcpy(draw->name, bytes, length);
    draw->class = (draw_class) class;
    draw->triangles = get_u64(bytes + 72);
    draw->vertices = get_u64(bytes + 80);
    draw->fragments = get_u64(bytes + 88);
    return true;
}

void chunk_encode(const chunk_record *chunk, uint8_t bytes[CHUNK_BYTES])
{
    put_u64(bytes, chunk->offset);
    put_u32(bytes + 8, chunk->stored_bytes);
    put_u32(bytes + 12, chunk->draw);
    put_u32(bytes + 16, chunk->count);
    put_u16(bytes + 20, chunk->bounds.x0);
    put_u16(bytes + 22, chunk->bounds.y0);
    put_u16(bytes + 24, chunk->bounds.x1);
    put_u16(bytes + 26, chunk->bounds.y1);
    put_u32(bytes + 28, 0);
    put_u64(bytes + 32, chunk->checksum);
    put(bytes + 40, chunk->digest, DIGEST_BYTES);
}

void chunk_decode(const uint8_t bytes[CHUNK_BYTES], chunk_record *chunk)
{
    chunk->offset = get_u64(bytes);
    chunk->stored_bytes = get_u32(bytes + 8);
    chunk->draw = get_u32(bytes + 12);
    chunk->count = get_u32(bytes + 16);
    chunk->bounds = (bounds){get_u16(bytes + 20), get_u16(bytes + 22), get_u16(bytes + 24), get_u16(bytes + 26)};
    chunk->checksum = get_u64(bytes + 32);
    memcpy(chunk->digest, bytes + 40, DIGEST_BYTES);
}

void trailer_encode(const trailer_record *trailer, uint8_t bytes[TRAILER_BYTES])
{
    put(bytes, trailer_magic, sizeof trailer_magic);
    put_u64(bytes + 8, trailer->table_offset);
    put_u32(bytes + 16, trailer->draw_count);
    put_u32(bytes + 20, 0);
    put_u64(bytes + 24, trailer->chunk_count);
    put_u64(bytes + 32, trailer->fragment_count);
    put(bytes + 40, trailer->hash, DIGEST_BYTES);
    put_u64(bytes + TRAILER_CHECKSUM, trailer->checksum);
}

bool trailer_decode(const uint8_t bytes[TRAILER_BYTES], trailer_record *trailer, char why[WHY_SIZE])
{
    memset(trailer, 0, sizeof *trailer);
    if (memcmp(bytes, trailer_magic, sizeof trailer_magic) != 0)
        return snprintf(why, WHY_SIZE, "the last 64 bytes are no trailer: the file was cut or was not finished"), false;
    if (get_u32(bytes + 20) != 0)
        return snprintf(why, WHY_SIZE, "the trailer's bytes 20 to 23 are not 0"), false;
    trailer->table_offset = get_u64(bytes + 8);
    trailer->draw_count = get_u32(bytes + 16);
    trailer->chunk_count = get_u64(bytes + 24);
    trailer->fragment_count = get_u64(bytes + 32);
    memcpy(trailer->hash, bytes + 40, DIGEST_BYTES);
    trailer->checksum = get_u64(bytes + TRAILER_CHECKSUM);
    if (trailer->draw_count > TRACE_DRAWS_MAX)
        return snprintf(why, WHY_SIZE, "%u draws, at most %d", trailer->draw_count, TRACE_DRAWS_MAX), false;
    return true;
}
