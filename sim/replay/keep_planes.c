// Tiles in, each plane as one array over the image's samples out: for tests and for looking inside.
#include "replay.h"

#include <stdlib.h>

static void keep_tile(const plan *plan, const tiling *tiling, uint32_t t, const tile *tile, bool empty, int plane,
                      uint32_t components, uint32_t *values)
{
    const uint32_t *words = tile->storage + plan->plane_offset[tile->plane_at[plane]];
    for (uint32_t row = 0; row < tiling->tile_height; row++) {
        const tiling_run run = tiling_row(tiling, t, row);
        for (uint32_t i = 0; i < run.count; i++)
            for (uint32_t c = 0; c < components; c++)
                values[(run.sample + i) * components + c] = words[c * TILE_LANES + (empty ? 0 : run.lane + i)];
    }
}

status keep_planes(const plan *plan, const tiling *tiling, const tile *tiles, const tile *empty, const report *report,
                   run_result *result)
{
    const size_t samples = (size_t)tiling->image_width * tiling->image_height * tiling->samples;
    for (int i = 0; i < plan->program->plane_count; i++) {
        const bool color = format_table[bound_plane_format(plan->bound, i)].class == FORMAT_CLASS_COLOR;
        const uint32_t components = color ? 4 : 1;
        result->plane_values[i] = malloc(samples * components * sizeof *result->plane_values[i]);
        if (!result->plane_values[i])
            return report_error(report, STATUS_IO, "out of memory: values of plane '%s'", plan->program->planes[i].name);
        for (uint32_t t = 0; t < tiling->tile_count; t++) {
            const bool is_empty = !tiles[t].storage;
            keep_tile(plan, tiling, t, is_empty ? empty : &tiles[t], is_empty, i, components, result->plane_values[i]);
        }
    }
    return STATUS_OK;
}
