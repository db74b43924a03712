// What a trace may hold, whatever its form: one check for reader and writer.
//
// A finite depth outside [0, 1] is allowed (the ROP clamps it); `info` and `check` mention it. Each fragment
// check first folds a whole column, which the compiler turns into vectors, and looks for the culprit only when that
// fails.
#include "block.h"

#include <math.h>
#include <string.h>

bool info_check(const trace_info *info, char why[WHY_SIZE])
{
    if (info->width < 1 || info->width > TRACE_SIZE_MAX || info->height < 1 || info->height > TRACE_SIZE_MAX)
        return snprintf(why, WHY_SIZE, "size %u x %u, each must be 1 to %d", info->width, info->height, TRACE_SIZE_MAX),
               false;
    uint32_t samples = info->samples;
    if (samples < 1 || samples > TRACE_SAMPLES_MAX || (samples & (samples - 1)) != 0)
        return snprintf(why, WHY_SIZE, "%u samples, must be 1, 2, 4, 8 or 16", samples), false;
    if (info->depth_bits != 32 && info->depth_bits != 64)
        return snprintf(why, WHY_SIZE, "depth bits must be 32 or 64"), false;
    for (int c = 0; c < 4; c++)
        if (!isfinite(info->background[c]))
            return snprintf(why, WHY_SIZE, "the background must be finite"), false;
    for (uint32_t s = 0; s < TRACE_SAMPLES_MAX; s++)
        for (int axis = 0; axis < 2; axis++) {
            int position = info->sample_positions[s][axis];
            if (s < samples ? position < -128 || position > 127 : position != 0)
                return snprintf(why, WHY_SIZE, "position %d of sample %u, must be %s", position, s,
                                s < samples ? "-128 to 127 (1/256 pixel)" : "0, as there is no such sample"),
                       false;
        }
    return true;
}

bool draw_name_check(const char *name, size_t length)
{
    if (length < 1 || length >= NAME_SIZE)
        return false;
    for (size_t i = 0; i < length; i++)
        if (name[i] <= ' ' || name[i] > '~' || name[i] == '#')
            return false;
    return true;
}

bounds block_bounds(const block *block)
{
    uint16_t x0 = UINT16_MAX, y0 = UINT16_MAX, x1 = 0, y1 = 0;
    for (uint32_t i = 0; i < block->count; i++) {
        x0 = block->x[i] < x0 ? block->x[i] : x0;
        x1 = block->x[i] > x1 ? block->x[i] : x1;
        y0 = block->y[i] < y0 ? block->y[i] : y0;
        y1 = block->y[i] > y1 ? block->y[i] : y1;
    }
    return (bounds){x0, y0, (uint16_t)(x1 + 1), (uint16_t)(y1 + 1)};
}

static bool columns_are_inside(const trace_info *info, const block *block)
{
    uint16_t x = 0, y = 0;
    uint8_t sample = 0;
    for (uint32_t i = 0; i < block->count; i++)
        x = block->x[i] > x ? block->x[i] : x;
    for (uint32_t i = 0; i < block->count; i++)
        y = block->y[i] > y ? block->y[i] : y;
    for (uint32_t i = 0; i < block->count; i++)
        sample = block->sample[i] > sample ? block->sample[i] : sample;
    return x < info->width && y < info->height && sample < info->samples;
}

// Is every value finite, or not finite and in its one form where that is allowed?
static bool float_is_allowed(float value, bool nonfinite)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return isfinite(value) || (nonfinite && (!isnan(value) || bits == CANONICAL_NAN_FLOAT));
}

static bool double_is_allowed(double value, bool nonfinite)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return isfinite(value) || (nonfinite && (!isnan(value) || bits == CANONICAL_NAN_DOUBLE));
}

static bool values_are_allowed(const trace_info *info, const block *block)
{
    uint32_t bad = 0;
    for (uint32_t i = 0; i < block->count; i++)
        bad |= (uint32_t) !(fabs(block->depth[i]) <= 1.7976931348623157e308);
    for (int c = 0; c < 4; c++)
        for (uint32_t i = 0; i < block->count; i++)
            bad |= (uint32_t) !(fabsf(block->rgba[c][i]) <= 3.40282347e38f);
    if (info->depth_bits == 32)
        for (uint32_t i = 0; i < block->count; i++)
            bad |= (uint32_t)((double)(float)block->depth[i] != block->depth[i]);
    return bad == 0;
}

static bool fragment_check(const trace_info *info, const block *block, uint32_t i, char why[WHY_SIZE])
{
    if (block->x[i] >= info->width)
        return snprintf(why, WHY_SIZE, "fragment %u: x is %u, must be below %u", i, block->x[i], info->width), false;
    if (block->y[i] >= info->height)
        return snprintf(why, WHY_SIZE, "fragment %u: y is %u, must be below %u", i, block->y[i], info->height), false;
    if (block->sample[i] >= info->samples)
        return snprintf(why, WHY_SIZE, "fragment %u: sample is %u, must be below %u", i, block->sample[i],
                        info->samples),
               false;
    const char *allowed = info->nonfinite ? "finite, an infinity or the NaN 0x7fc00000 (64-bit: 0x7ff8000000000000)"
                                          : "finite, as the trace is not marked nonfinite";
    double depth = block->depth[i];
    if (!double_is_allowed(depth, info->nonfinite))
        return snprintf(why, WHY_SIZE, "fragment %u: depth is %g, must be %s", i, depth, allowed), false;
    if (info->depth_bits == 32 && !isnan(depth) && (double)(float)depth != depth)
        return snprintf(why, WHY_SIZE, "fragment %u: depth %.17g is no 32-bit float, as depth_bits 32 says", i, depth),
               false;
    for (int c = 0; c < 4; c++)
        if (!float_is_allowed(block->rgba[c][i], info->nonfinite))
            return snprintf(why, WHY_SIZE, "fragment %u: %c is %g, must be %s", i, "rgba"[c],
                            (double)block -> rgba[c][i], allowed),
                   false;
    return true;
}

bool block_places_check(const trace_info *info, const block *block)
{
    return columns_are_inside(info, block);
}

bool block_check(const trace_info *info, const block *block, char why[WHY_SIZE])
{
    if (columns_are_inside(info, block) && values_are_allowed(info, block))
        return true;
    for (uint32_t i = 0; i < block->count; i++)
        if (!fragment_check(info, block, i, why))
            return false;
    return true;
}

void block_view(const block *block, uint32_t draw, fragments *fragments)
{
    *fragments = (struct fragments){.draw = draw,
                                    .count = block->count,
                                    .x = block->x,
                                    .y = block->y,
                                    .sample = block->sample,
                                    .depth = block->depth,
                                    .rgba = {block->rgba[0], block->rgba[1], block->rgba[2], block->rgba[3]},
                                    .primitive = block->primitive};
}
