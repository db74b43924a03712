// The hash of the whole: the same for the text and the binary form, and known from the index alone.
//
// A block's digest is XXH3-128 over its columns as arrays (x, y, sample, depth as 64-bit, r, g, b, a, primitive);
// the hash is XXH3-128 over header bytes 16 to 119, then for each draw its blocks' digests and its draw record.
#include "records.h"

#include <stdlib.h>
#include <xxhash.h>

struct content {
    XXH3_state_t *whole, *part;
};

content *content_create(const trace_info *info)
{
    content *content = calloc(1, sizeof *content);
    if (!content)
        return NULL;
    content->whole = XXH3_createState();
    content->part = XXH3_createState();
    if (!content->whole || !content->part) {
        content_destroy(content);
        return NULL;
    }
    uint8_t header[HEADER_BYTES];
    header_encode(info, header);
    XXH3_128bits_reset(content->whole);
    XXH3_128bits_update(content->whole, header + HEADER_CONTENT, HEADER_CHECKSUM - HEADER_CONTENT);
    return content;
}

void content_destroy(content *content)
{
    if (!content)
        return;
    XXH3_freeState(content->whole);
    XXH3_freeState(content->part);
    free(content);
}

static void digest_bytes(XXH3_state_t *state, uint8_t digest[DIGEST_BYTES])
{
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state));
    for (int i = 0; i < DIGEST_BYTES; i++)
        digest[i] = canonical.digest[i];
}

void content_digest(content *content, const block *block, uint8_t digest[DIGEST_BYTES])
{
    XXH3_state_t *state = content->part;
    size_t count = block->count;
    XXH3_128bits_reset(state);
    XXH3_128bits_update(state, block->x, count * sizeof *block->x);
    XXH3_128bits_update(state, block->y, count * sizeof *block->y);
    XXH3_128bits_update(state, block->sample, count);
    XXH3_128bits_update(state, block->depth, count * sizeof *block->depth);
    for (int c = 0; c < 4; c++)
        XXH3_128bits_update(state, block->rgba[c], count * sizeof *block->rgba[c]);
    XXH3_128bits_update(state, block->primitive, count * sizeof *block->primitive);
    digest_bytes(state, digest);
}

void content_add_digest(content *content, const uint8_t digest[DIGEST_BYTES])
{
    XXH3_128bits_update(content->whole, digest, DIGEST_BYTES);
}

void content_add_draw(content *content, const trace_draw *draw)
{
    uint8_t bytes[DRAW_BYTES];
    draw_encode(draw, bytes);
    XXH3_128bits_update(content->whole, bytes, sizeof bytes);
}

void content_end(content *content, uint8_t hash[DIGEST_BYTES])
{
    digest_bytes(content->whole, hash);
}

void content_hex(const uint8_t hash[DIGEST_BYTES], char hex[33])
{
    for (int i = 0; i < DIGEST_BYTES; i++)
        snprintf(hex + 2 * i, 3, "%02x", hash[i]);
}
