// A vector width in, the dispatch function that this processor can run out.
#include "isa.h"

execute_kernel execute_16, execute_32, execute_64;

execute_kernel *execute_select(int bytes)
{
#if defined(__x86_64__)
    __builtin_cpu_init();
    if ((bytes == 0 || bytes == 64) && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
        return execute_64;
    if ((bytes == 0 || bytes == 32) && __builtin_cpu_supports("avx2"))
        return execute_32;
#endif
    return bytes == 0 || bytes == 16 ? execute_16 : NULL;
}
