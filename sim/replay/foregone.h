// Batches whose outcome is foregone: ranges of their depths and of what planes hold show that the kernel would write nothing, and which
// instructions it would execute. Those are counted; the batch's columns are not even read. foregone_find.c finds which compares
// decide that, foregone.c asks them.
#ifndef ROPSIM_FOREGONE_H
#define ROPSIM_FOREGONE_H

#include "replay.h"

enum {
    COLUMN_MAX = 4 * PLANE_MAX,  // column 4 * plane + channel: 64 words that a tile's plane holds
    LEAST_OF_MAX = CLIP_MAX,
    FOREGONE_TEST_MAX = 48,      // a bit each
    FOREGONE_END_MAX = FOREGONE_TEST_MAX + 1,
};

// What a compare looks at, as far as a range is known of it.
typedef enum ranged_kind { RANGED_UNKNOWN, RANGED_DEPTH, RANGED_CONSTANT, RANGED_COLUMNS } ranged_kind;
typedef struct ranged {
    ranged_kind kind;
    uint32_t constant;
    uint8_t columns[LEAST_OF_MAX];  // the least of these
    uint8_t count;
} ranged;

// A compare that all lanes reach. What comes next if it holds nowhere, and if it holds everywhere: a test, or ~i for end i.
typedef struct foregone_test {
    opcode op;
    ranged a, b;
    int16_t next[2];
} foregone_test;

// Where nothing was written: a bit for each instruction that all lanes executed. The first is not one of these: execute the batch.
enum { END_EXECUTE = 0 };
typedef struct foregone_end { uint64_t executed[WORD_MAX / 64]; } foregone_end;

// The tests of one kernel, a tree.
struct foregone {
    int16_t root;
    int test_count, end_count;
    foregone_test tests[FOREGONE_TEST_MAX];
    uint64_t tests_of[PLANE_MAX];  // bit t: test t looks at the plane
    foregone_end ends[FOREGONE_END_MAX];
};

// A store to a plane that some kernel's test looks at.
typedef struct watched_store { uint32_t at; uint8_t plane; } watched_store;  // in a counts array

// A test as long as planes do not change. What comes next if all depths are below the one bound, or none is below the other.
typedef struct settled_test {
    uint64_t below, from;
    int16_t next_below, next_from;
} settled_test;

// What one worker knows of the tile at hand.
typedef struct foresight {
    const plan *plan;
    const struct foregone *tree;                 // of the kernel at hand; NULL: all of its batches are executed
    uint64_t settled;                            // bit t: test t of the tree
    settled_test tests[FOREGONE_TEST_MAX];
    bool tested[PLANE_MAX];                      // some kernel's test looks at the plane: its stores are watched
    depth_range ranges[COLUMN_MAX];
    bool known[COLUMN_MAX];                      // never of a plane that is not tested: nobody would notice a store
    uint64_t batches;                            // passed over so far
    uint64_t lanes[FOREGONE_END_MAX];            // that came to each end in this draw
    bool uncounted;                              // some did
    watched_store *stores;                       // kernel k's are those from store_start[k] to store_start[k + 1]
    uint32_t store_start[KERNEL_MAX + 1];
    uint64_t *seen;                              // of each, how often it had been executed when last looked at
} foresight;

// The trees of all kernels, to free with free(); NULL: out of memory.
struct foregone *foregone_find(const program *program, const bound_program *bound, format depth_format);
// The format of depths whose ranges help most: the machine's, if any kernel looks at it.
format foregone_format(const bound_program *bound, format machine);

bool foresight_make(const plan *plan, foresight *foresight);  // false: out of memory
void foresight_free(foresight *foresight);
// A tile comes: nothing is known of it. Its plane was cleared to these words, was copied from another, swapped, or written to.
void foresight_start(foresight *foresight);
void foresight_cleared(foresight *foresight, int plane, const uint32_t value[4]);
void foresight_copied(foresight *foresight, int plane, int source);
void foresight_swapped(foresight *foresight, int plane, int other);
void foresight_wrote(foresight *foresight, int plane);
void foresight_executed(foresight *foresight, int kernel, const uint64_t *counts);  // the kernel has run; finds out what it wrote
// A draw with the kernel begins. Whether the outcome of these lanes of a batch is foregone; then they need not run. Counts
// what those would have executed.
void foresight_begin(foresight *foresight, int kernel);
bool foresight_passes_over(foresight *foresight, const tile_plane *planes, const bins *bins, bin_batch *batch, uint64_t lanes);
void foresight_count(foresight *foresight, uint64_t *counts);

#endif
