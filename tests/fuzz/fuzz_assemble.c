// libFuzzer target: any bytes as a program, as text and as words. What assembles must come back the same from its words
// and from its canonical text, and must bind; nothing may crash, whatever the bytes.
//
// Built on request only, with clang, as fuzz_trace.c says:
//   ninja -C build-fuzz fuzz_assemble
//   mkdir corpus && cp programs/*.rop corpus && build-fuzz/tests/fuzz_assemble -max_len=16384 -max_total_time=60 corpus
// (files made by `ropsim asm` belong into the corpus too.)
#include "../../isa/isa.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// Words -> program -> words, text -> program -> words: all the same.
static void check(const program *first)
{
    static const float background[4];
    const rop_limits limits = {.machine = "m",
                               .depth_format = FORMAT_z24,
                               .color_format = FORMAT_rgba8,
                               .stencil_bits = 8,
                               .formats = UINT32_MAX,
                               .opcodes = UINT32_MAX,
                               .planes_max = PLANE_MAX,
                               .bits_per_sample_max = 65536,
                               .color_targets_max = TARGET_MAX,
                               .instructions_max = WORD_MAX};
    uint32_t *words;
    size_t count;
    program *second;
    bound_program *bound;
    if (program_encode(first, &words, &count) != STATUS_OK ||
        program_decode("words", words, count, NULL, &second) != STATUS_OK)
        abort();
    free(words);
    program_destroy(second);
    verify_program(first, "text", &limits, NULL);
    bind_program(first, &limits, false, background, NULL, &bound);
    bound_destroy(bound);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    program *program;
    char *text = malloc(size + 1);
    uint32_t *words = malloc(size + 4);
    if (!text || !words)
        abort();
    memcpy(text, data, size);  // a heap block of its own, so that a byte read too far is seen
    memcpy(words, data, size / 4 * 4);
    if (assemble_text("text", text, size, NULL, &program) == STATUS_OK)
        check(program);
    program_destroy(program);
    if (program_decode("words", words, size / 4, NULL, &program) == STATUS_OK)
        check(program);
    program_destroy(program);
    free(text);
    free(words);
    return 0;
}
