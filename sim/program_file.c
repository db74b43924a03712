// Programs in files: text or assembled words in, told apart by content; words out, little-endian.
#include "program_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

// The largest program of the language takes 0.2 MiB in words; text has its own limit of 1 MiB.
enum { FILE_SIZE_MAX = 1 << 20, WORD_BYTES = 4 };
static const unsigned char magic[WORD_BYTES] = {'R', 'O', 'P', 'B'};

static status decode_bytes(const char *path, const unsigned char *bytes, size_t size, const report *report,
                           program **program)
{
    if (size % WORD_BYTES != 0 || size > FILE_SIZE_MAX)
        return report_error(report, STATUS_REFUSED,
                            "%s: an assembled program is words of 4 bytes, at most %d bytes; this has %s%zu bytes",
                            path, FILE_SIZE_MAX, size > FILE_SIZE_MAX ? "more than " : "",
                            size > FILE_SIZE_MAX ? (size_t)FILE_SIZE_MAX : size);
    uint32_t *words = malloc(size);
    if (!words)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    for (size_t i = 0; i < size / WORD_BYTES; i++) {
        const unsigned char *byte = bytes + i * WORD_BYTES;
        words[i] = (uint32_t)byte[0] | (uint32_t)byte[1] << 8 | (uint32_t)byte[2] << 16 | (uint32_t)byte[3] << 24;
    }
    status status = program_decode(path, words, size / WORD_BYTES, report, program);
    free(words);
    return status;
}

status program_read(const char *path, const parameter *parameters, int parameter_count, const report *report,
                    program **program)
{
    *program = NULL;
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: %s", path, strerror(errno));
    unsigned char *bytes = malloc(FILE_SIZE_MAX + 1);
    size_t size = bytes ? fread(bytes, 1, FILE_SIZE_MAX + 1, file) : 0;
    bool failed = !bytes || ferror(file);
    fclose(file);
    status status;
    if (failed)
        status = report_error(report, STATUS_IO, "%s: could not be read", path);
    else if (size >= sizeof magic && memcmp(bytes, magic, sizeof magic) == 0)
        status = parameter_count ? report_error(report, STATUS_REFUSED, "%s: words have no parameters left to set", path)
                                 : decode_bytes(path, bytes, size, report, program);
    else
        status = assemble_text_with(path, (const char *)bytes, size, parameters, parameter_count, report, program);
    free(bytes);
    return status;
}

status program_save_words(const char *path, const uint32_t *words, size_t count, const report *report)
{
    aside *aside = NULL;
    FILE *file = NULL;
    status status = aside_open(path, report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    for (size_t i = 0; i < count; i++) {
        const unsigned char bytes[WORD_BYTES] = {(unsigned char)words[i], (unsigned char)(words[i] >> 8),
                                                 (unsigned char)(words[i] >> 16), (unsigned char)(words[i] >> 24)};
        fwrite(bytes, 1, sizeof bytes, file);  // aside_finish asks whether all was written
    }
    return aside_finish(aside);
}
