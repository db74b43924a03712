// What the files of sim/trace share: a block of fragments as columns, its rules, its hash.
//
// A *block* is up to 65536 consecutive fragments of one draw. Every block of a draw but its last is full,
// whatever form the trace has, so that hashes and files do not depend on how the fragments arrived.
#ifndef ROPSIM_TRACE_BLOCK_H
#define ROPSIM_TRACE_BLOCK_H

#include "../sim.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "traces are little-endian and copied as they are: this needs a byte swap on big-endian machines"
#endif

enum { BLOCK_MAX = 65536 };

typedef struct block {
    uint32_t count;
    uint16_t x[BLOCK_MAX], y[BLOCK_MAX];
    uint8_t sample[BLOCK_MAX];
    double depth[BLOCK_MAX];
    float rgba[4][BLOCK_MAX];
    uint32_t primitive[BLOCK_MAX];
} block;

// Pixels [x0, x1) x [y0, y1).
typedef struct bounds {
    uint16_t x0, y0, x1, y1;
} bounds;

// The block as the public type; valid as long as the block is not changed.
void block_view(const block *block, uint32_t draw, fragments *fragments);

// ---- Rules (rules.c) -----------------------------------------------------------------------------------

enum { WHY_SIZE = 256 };

// Each returns false and puts a sentence into `why` at the first rule that is broken.
bool info_check(const trace_info *info, char why[WHY_SIZE]);
bool block_check(const trace_info *info, const block *block, char why[WHY_SIZE]);
bool block_places_check(const trace_info *info, const block *block);  // x, y and sample alone
// 1 to 63 visible ASCII characters without '#'.
bool draw_name_check(const char *name, size_t length);
bounds block_bounds(const block *block);

// NaN has one form in a trace, the positive quiet one: text cannot tell others apart.
#define CANONICAL_NAN_FLOAT 0x7fc00000u
#define CANONICAL_NAN_DOUBLE 0x7ff8000000000000u

// ---- The hash of the whole (content.c) -----------------------------------------------------------------

enum { DIGEST_BYTES = 16 };

// XXH3-128 over the header's content, then for each draw the digests of its blocks and its record.
typedef struct content content;
content *content_create(const trace_info *info);  // NULL if memory ran out
void content_destroy(content *content);           // NULL is fine
// The digest of a block's columns. It does not change the hash: content_add_digest does.
void content_digest(content *content, const block *block, uint8_t digest[DIGEST_BYTES]);
void content_add_digest(content *content, const uint8_t digest[DIGEST_BYTES]);
void content_add_draw(content *content, const trace_draw *draw);
void content_end(content *content, uint8_t hash[DIGEST_BYTES]);
void content_hex(const uint8_t hash[DIGEST_BYTES], char hex[33]);

#endif
