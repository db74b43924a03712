// The decision of compress.c as this processor makes it fastest; every width gives the same.
#include "compress.h"

compress_choice compress_choose(format format, int bits, const uint32_t *plane, int first_lane, int lane_count)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return compress_32(format, bits, plane, first_lane, lane_count);
#endif
    return compress_16(format, bits, plane, first_lane, lane_count);
}

int compress_quarters(format format, int bits, const uint32_t *plane, int first_lane, int lane_count)
{
    return compress_choose(format, bits, plane, first_lane, lane_count).quarters;
}
