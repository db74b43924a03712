// D3D11.3's standard sample positions (19.2.4.1), given there in 1/16 pixel from the centre.
#include "../sim.h"

#include <string.h>

static const int8_t positions_1[][2] = {{0, 0}};
static const int8_t positions_2[][2] = {{4, 4}, {-4, -4}};
static const int8_t positions_4[][2] = {{-2, -6}, {6, -2}, {-6, 2}, {2, 6}};
static const int8_t positions_8[][2] = {{1, -3}, {-1, 3}, {5, 1}, {-3, -5}, {-5, 5}, {-7, -1}, {3, 7}, {7, -7}};
static const int8_t positions_16[][2] = {{1, 1},  {-1, -3}, {-3, 2},  {4, -1}, {-5, -2}, {2, 5},  {5, 3}, {3, -5},
                                         {-2, 6}, {0, -7},  {-4, -6}, {-6, 4}, {-8, 0},  {7, -4}, {6, 7}, {-7, -8}};

void trace_standard_positions(trace_info *info)
{
    memset(info->sample_positions, 0, sizeof info->sample_positions);
    const int8_t(*table)[2] = info->samples == 2    ? positions_2
                              : info->samples == 4  ? positions_4
                              : info->samples == 8  ? positions_8
                              : info->samples == 16 ? positions_16
                                                    : positions_1;
    uint32_t count = table == positions_1 ? 1 : info->samples;
    for (uint32_t s = 0; s < count; s++)
        for (int axis = 0; axis < 2; axis++)
            info->sample_positions[s][axis] = (int16_t)(16 * table[s][axis]);
}
