// libFuzzer target: any bytes as a trace file. Binary ones get right checksums, so that the fuzzer reaches the rules
// behind them.
//
// Built on request only, with clang:
//   cmake -S . -B build-fuzz -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ -DROPSIM_FUZZ=ON \
//         -DCMAKE_C_FLAGS="-g -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined"
//   ninja -C build-fuzz fuzz_trace
//   mkdir corpus && cp traces/*.rtxt corpus && build-fuzz/tests/fuzz_trace -max_len=65536 -max_total_time=60 corpus
// (.ropt files made by `ropsim convert` belong into the corpus too.)
#include "../../sim/sim.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>
#include <xxhash.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { HEADER = 128, TRAILER = 64 };

static void seal(uint8_t *bytes, size_t size)
{
    if (size < HEADER + TRAILER || bytes[0] != 0x89)
        return;
    uint64_t from, sum = XXH3_64bits(bytes, HEADER - 8);
    memcpy(bytes + HEADER - 8, &sum, sizeof sum);
    memcpy(&from, bytes + size - TRAILER + 8, sizeof from);
    if (from > size - 8)
        return;
    sum = XXH3_64bits(bytes + from, size - 8 - from);
    memcpy(bytes + size - 8, &sum, sizeof sum);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char path[64];
    int descriptor = memfd_create("trace", 0);
    uint8_t *bytes = malloc(size + 1);
    if (descriptor < 0 || !bytes)
        abort();
    memcpy(bytes, data, size);
    seal(bytes, size);
    if (write(descriptor, bytes, size) != (ssize_t)size)
        abort();
    free(bytes);
    snprintf(path, sizeof path, "/proc/self/fd/%d", descriptor);
    trace *trace;
    trace_summary summary;
    if (trace_open(path, NULL, &trace) == STATUS_OK) {
        const trace_info *info = trace_get_info(trace);
        if ((uint64_t)info->width * info->height * info->samples <= 1 << 20)
            trace_summarize(trace, NULL, &summary);
        trace_close(trace);
    }
    close(descriptor);
    return 0;
}
