// Lanes of a block in, quads and verdicts of depth tests out.
#include "arrival.h"

uint32_t quads_of(const arrival *a, uint64_t lanes)
{
    return count_lanes(frame_quads(&a->frame, lanes));
}

static bool holds(compare_function function, uint32_t fragment, uint32_t stored)
{
    switch (function) {
    case COMPARE_less: return fragment < stored;
    case COMPARE_equal: return fragment == stored;
    case COMPARE_lequal: return fragment <= stored;
    case COMPARE_greater: return fragment > stored;
    case COMPARE_notequal: return fragment != stored;
    case COMPARE_gequal: return fragment >= stored;
    case COMPARE_never: return false;
    default: return true;
    }
}

uint64_t depth_test_lanes(compare_function function, const uint32_t *codes, const uint32_t *plane, uint64_t lanes)
{
    uint64_t found = 0;
    for (uint64_t left = lanes; left; left &= left - 1) {
        const int lane = __builtin_ctzll(left);
        found |= (uint64_t)holds(function, codes[lane], plane[lane]) << lane;
    }
    return found;
}

// Codes of depth stay below 2^31, so that signed compares do, which every processor has as vectors.
depth_range depth_range_of(const uint32_t *codes, uint32_t count)
{
    int32_t least = INT32_MAX, most = 0;
    for (uint32_t i = 0; i < count; i++) {
        const int32_t code = (int32_t)codes[i];
        least = code < least ? code : least;
        most = code > most ? code : most;
    }
    return (depth_range){(uint32_t)least, (uint32_t)most};
}

depth_range depth_range_of_lanes(const uint32_t *codes, uint64_t lanes)
{
    if (lanes == UINT64_MAX)
        return depth_range_of(codes, TILE_LANES);
    depth_range range = {UINT32_MAX, 0};
    for (; lanes; lanes &= lanes - 1) {
        const uint32_t code = codes[__builtin_ctzll(lanes)];
        range.least = code < range.least ? code : range.least;
        range.most = code > range.most ? code : range.most;
    }
    return range;
}

depth_range stamp_depths(const stamp_chunk *chunk, const stamp_record *record, format format)
{
    const uint32_t *codes = chunk->codes[format] + record->offset;
    return chunk->by_lanes ? depth_range_of_lanes(codes, record->lanes) : depth_range_of(codes, record->fragments);
}

bool depth_range_fails(compare_function function, depth_range fragments, depth_range block)
{
    switch (function) {
    case COMPARE_less: return fragments.least >= block.most;
    case COMPARE_lequal: return fragments.least > block.most;
    case COMPARE_greater: return fragments.most <= block.least;
    case COMPARE_gequal: return fragments.most < block.least;
    case COMPARE_equal: return fragments.least > block.most || fragments.most < block.least;
    case COMPARE_never: return true;
    default: return false;
    }
}
