// Lossless block compression as a size: the samples of a part of a tile's plane go in, what that part takes in memory
// comes out. Nothing is stored: the memory model needs sizes, and a plane keeps its values.
//
// Each size is that of a bit stream that a decoder without further knowledge reads back (docs/compression.md draws it,
// tests/unit/test_compress.c writes and reads it). Sizes in memory are whole quarters, so a part that shrinks by a
// fifth takes as much as one that does not shrink.
#ifndef ROPSIM_COMPRESS_H
#define ROPSIM_COMPRESS_H

#include "../../isa/isa.h"

// How many quarters (1 to 4) of its uncompressed size a part of a block takes in memory. 4: stored as it is.
// bits: of a sample as stored, all channels together; the values fit. plane: 64 words, for COLOR formats 4 x 64 of
// float bits, values as the format keeps them. The part is lanes [first_lane, first_lane + lane_count): a power of two
// of lanes that starts at a multiple of it.
int compress_quarters(format format, int bits, const uint32_t *plane, int first_lane, int lane_count);

// The first two bits of the stream.
typedef enum compress_scheme {
    COMPRESS_BASE,        // each channel: its least code, and what each lane is above it
    COMPRESS_PLANE,       // depth: a plane, and what each lane is above it
    COMPRESS_TWO_BASES,   // depth: the least and the greatest code; each lane is above the one or below the other
    COMPRESS_PLANE_FILL,  // depth: a plane, and one code that other lanes have
} compress_scheme;

// What an encoder needs to know to write the stream.
typedef struct compress_choice {
    int quarters;   // 4: the lanes as they are, and nothing below is set
    int size_bits;  // of the stream, its first two bits included
    compress_scheme scheme;
    int width[4];      // bits of a lane's difference in each channel
    uint32_t base[4];  // of each channel; a plane's height at the part's first lane; [1]: greatest code, or the fill
    int32_t step_x, step_y;  // the plane's, in eighths of a code, from lane to lane and from row of 8 lanes to row
} compress_choice;

// The same decision in full. The first scheme that comes down to one quarter is taken, else the least size.
typedef compress_choice compress_chooser(format format, int bits, const uint32_t *plane, int first_lane, int lane_count);
compress_chooser compress_choose;
extern compress_chooser compress_16, compress_32;  // of vectors of so many bytes, the same (compress_select.c)

#endif
