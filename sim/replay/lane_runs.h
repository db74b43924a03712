// Fragments that follow each other in a trace and lie in lanes of one block that do: found in all of a trace's run at once, then
// placed and moved in one piece. A triangle that covers a block is one such lane run.
#ifndef ROPSIM_LANE_RUNS_H
#define ROPSIM_LANE_RUNS_H

#include "replay.h"

#include <string.h>

typedef struct lane_runs {
    uint8_t *follows;              // of each fragment, 0 or 1: it lies in the lane behind that of the fragment before it; then 8 zeros
    uint32_t *codes[FORMAT_COUNT]; // its depth as codes of the formats asked for
    uint32_t capacity;
} lane_runs;

// Looks through a run. `primitives`: another primitive ends a lane run. False: out of memory. Free also after a failure.
bool lane_runs_find(lane_runs *lane_runs, const tiling *tiling, const fragments *run, bool primitives);
// Fills the codes. False: out of memory.
bool lane_runs_code(lane_runs *lane_runs, const fragments *run, uint32_t formats, bool reversed);
void lane_runs_free(lane_runs *lane_runs);

// How many fragments from this one on are a lane run; at most 64.
static inline uint32_t lane_runs_length(const lane_runs *lane_runs, uint32_t fragment)
{
    const uint8_t *follows = lane_runs->follows + fragment + 1;
    uint32_t length = 1;
    uint64_t ends;
    do {
        uint64_t flags;
        memcpy(&flags, follows, sizeof flags);
        ends = ~flags & UINT64_C(0x0101010101010101);
        length += ends ? (uint32_t)__builtin_ctzll(ends) / 8 : 8;
        follows += 8;
    } while (!ends);
    return length;
}

// Columns of 4-byte words and where they go.
typedef struct word_columns {
    uint32_t count;
    const void *from[COLUMNS_MAX];
    void *to[COLUMNS_MAX];
} word_columns;

static inline void word_columns_add(word_columns *columns, const void *from, void *to)
{
    columns->from[columns->count] = from;
    columns->to[columns->count++] = to;
}

// Below 4 and below 16 words, pieces of one size overlap: how many there are does not depend on the number of words.
static inline void words_copy(char *restrict to, const char *restrict from, uint32_t words)
{
    if (words < 4) {
        memcpy(to, from, 4);
        memcpy(to + words / 2 * 4, from + words / 2 * 4, 4);
        memcpy(to + words * 4 - 4, from + words * 4 - 4, 4);
    } else if (words < 16) {
        for (uint32_t i = 0; i + 4 < words; i += 4)
            memcpy(to + i * 4, from + i * 4, 16);
        memcpy(to + words * 4 - 16, from + words * 4 - 16, 16);
    } else {
        memcpy(to, from, words * 4);
    }
}

// Single words are most of what meshes of small triangles have.
static inline void word_columns_copy(const word_columns *columns, uint64_t from, uint64_t to, uint32_t words)
{
    if (words == 1)
        for (uint32_t c = 0; c < columns->count; c++)
            memcpy((char *)columns->to[c] + 4 * to, (const char *)columns->from[c] + 4 * from, 4);
    else
        for (uint32_t c = 0; c < columns->count; c++)
            words_copy((char *)columns->to[c] + 4 * to, (const char *)columns->from[c] + 4 * from, words);
}

#endif
