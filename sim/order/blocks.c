// The image cut into blocks, each active as long as the item buffer shows a primitive in it: once nothing is left at a
// sample, nothing comes back, so that an inactive block need not be read back or scanned again.
#include "order.h"

#include <stdlib.h>

bool blocks_create(const trace_info *info, uint32_t side, blocks *b)
{
    const uint32_t whole = info->width > info->height ? info->width : info->height;
    *b = (blocks){.width = info->width, .height = info->height, .samples = info->samples};
    b->side = side && side < whole ? side : whole;
    b->columns = (info->width + b->side - 1) / b->side;
    b->count = b->columns * ((info->height + b->side - 1) / b->side);
    b->active = malloc(b->count * sizeof *b->active);
    for (uint32_t i = 0; b->active && i < b->count; i++)
        b->active[i] = true;
    return b->active;
}

void blocks_free(blocks *b)
{
    free(b->active);
    b->active = NULL;
}

static uint32_t at_most(uint32_t value, uint32_t limit)
{
    return value < limit ? value : limit;
}

block_area blocks_area(const blocks *b, uint32_t block)
{
    const uint32_t x = block % b->columns * b->side, y = block / b->columns * b->side;
    return (block_area){x * b->samples, at_most(x + b->side, b->width) * b->samples, y,
                        at_most(y + b->side, b->height)};
}

uint64_t blocks_active_samples(const blocks *b)
{
    uint64_t samples = 0;
    for (uint32_t i = 0; i < b->count; i++) {
        const block_area area = blocks_area(b, i);
        samples += b->active[i] ? (uint64_t)(area.x1 - area.x0) * (area.y1 - area.y0) : 0;
    }
    return samples;
}
