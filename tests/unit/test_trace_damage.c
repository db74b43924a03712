// Damaged and hostile binary traces: each is refused with its path, an offset and the reason; none crashes the reader.
//
// "Sealed" files have all checksums made right again after the damage, as a forger would: then the rules must catch it.
#include "trace_random.h"

#include <xxhash.h>
#include <zstd.h>

enum { HEADER = 128, DRAW = 96, CHUNK = 56, TRAILER = 64 };

typedef struct bytes {
    uint8_t *data;
    size_t size;
} bytes;

static uint64_t get64(const uint8_t *at)
{
    uint64_t value;
    memcpy(&value, at, 8);
    return value;
}

static bytes small_trace(uint32_t samples, uint32_t count)
{
    memory_trace *trace = random_trace(77 + samples, samples, 64, false, count);
    trace->info.draw_count = 1;
    trace->draws[0].fragments = count;
    char hash[33];
    assert_int_equal(write_trace(trace, test_path("small.ropt"), NULL, hash), STATUS_OK);
    free(trace);
    bytes file;
    file.data = file_bytes(test_path("small.ropt"), &file.size);
    return file;
}

// Checks the bytes as a file; "" if they hold, else the message.
static const char *verdict(const uint8_t *data, size_t size)
{
    const char *path = test_path("damaged.ropt");
    put_file(path, data, size);
    said[0] = 0;
    status result = trace_check(path, &keeping);
    assert_true(result == STATUS_OK ? said[0] == 0 : result == STATUS_REFUSED && strstr(said, path) == said);
    return said;
}

// Makes the checksums of header, tables and trailer right again.
static void seal(bytes file)
{
    uint8_t *trailer = file.data + file.size - TRAILER;
    uint64_t sum = XXH3_64bits(file.data, 120);
    memcpy(file.data + 120, &sum, 8);
    uint64_t from = get64(trailer + 8);
    if (from < file.size - 8) {
        sum = XXH3_64bits(file.data + from, file.size - 8 - from);
        memcpy(trailer + 56, &sum, 8);
    }
}

static void test_every_cut(void **state)
{
    (void)state;
    bytes file = small_trace(4, 3000);
    assert_true(file.size > 10000);
    assert_string_equal(verdict(file.data, file.size), "");
    for (size_t size = 64; size < file.size; size += 64)
        assert_non_null(strstr(verdict(file.data, size), "byte "));
    for (size_t size = file.size - TRAILER - 10; size < file.size; size++)
        assert_non_null(strstr(verdict(file.data, size), "byte "));
    assert_non_null(strstr(verdict(file.data, 0), "byte 0"));
    free(file.data);
}

static void test_added_bytes(void **state)
{
    (void)state;
    bytes file = small_trace(1, 100);
    file.data = realloc(file.data, file.size + 64);
    memset(file.data + file.size, 0, 64);
    for (size_t more = 1; more <= 64; more++)
        assert_non_null(strstr(verdict(file.data, file.size + more), "byte "));
    free(file.data);
}

static void test_every_bit(void **state)
{
    (void)state;
    bytes file = small_trace(2, 20);
    for (size_t bit = 0; bit < 8 * file.size; bit++) {
        file.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
        assert_non_null(strstr(verdict(file.data, file.size), "byte "));
        file.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    assert_string_equal(verdict(file.data, file.size), "");
    free(file.data);
}

// One field of one record set to an extreme in a sealed file, and a part of the message that must come.
static const struct field_case {
    char record;  // h header, d draw, c chunk, t trailer
    int offset, size;
    uint64_t value;
    const char *message;
} field_cases[] = {
    {'h', 0, 8, 0, "is no trace"},
    {'h', 8, 4, 0, "byte 8: version 0"},
    {'h', 8, 4, 2, "byte 8: version 2"},
    {'h', 8, 4, UINT32_MAX, "byte 8: version 4294967295"},
    {'h', 12, 4, 0, "byte 12: header of 0 bytes"},
    {'h', 12, 4, UINT32_MAX, "byte 12: header of 4294967295 bytes"},
    {'h', 16, 4, 0, "size 0 x"},
    {'h', 16, 4, 32768, "hash is not that"},
    {'h', 16, 4, 32769, "size 32769 x"},
    {'h', 16, 4, UINT32_MAX, "size 4294967295 x"},
    {'h', 20, 4, 0, "x 0, each"},
    {'h', 20, 4, 32768, "hash is not that"},
    {'h', 20, 4, 32769, "x 32769, each"},
    {'h', 20, 4, UINT32_MAX, "x 4294967295, each"},
    {'h', 24, 4, 0, "0 samples"},
    {'h', 24, 4, 3, "3 samples"},
    {'h', 24, 4, 16, "hash is not that"},
    {'h', 24, 4, 17, "17 samples"},
    {'h', 24, 4, UINT32_MAX, "4294967295 samples"},
    {'h', 28, 4, 0, "depth bits"},
    {'h', 28, 4, 32, "hash is not that"},
    {'h', 28, 4, 33, "depth bits"},
    {'h', 28, 4, UINT32_MAX, "depth bits"},
    {'h', 32, 4, 1, "hash is not that"},
    {'h', 32, 4, 4, "byte 32: flags"},
    {'h', 32, 4, UINT32_MAX, "byte 32: flags"},
    {'h', 36, 4, 0, "byte 36: 0 fragments a chunk"},
    {'h', 36, 4, UINT32_MAX, "byte 36: 4294967295 fragments a chunk"},
    {'h', 40, 4, 0x7f800000, "background must be finite"},
    {'h', 52, 4, 0x7fc00000, "background must be finite"},
    {'h', 56, 2, 128, "position 128 of sample 0"},
    {'h', 58, 2, 0xff7f, "position -129 of sample 0"},
    {'h', 58, 2, 0x8000, "position -32768 of sample 0"},
    {'h', 116, 2, 1, "position 1 of sample 15"},
    {'d', 0, 8, 0, "its name"},
    {'d', 0, 1, '#', "name is not"},
    {'d', 0, 1, 0x80, "name is not"},
    {'d', 63, 1, 'x', "name's end are not 0"},
    {'d', 64, 4, 3, "class 3"},
    {'d', 64, 4, UINT32_MAX, "class 4294967295"},
    {'d', 68, 4, 1, "bytes 68 to 71"},
    {'d', 72, 8, UINT64_MAX, "hash is not that"},
    {'d', 80, 8, UINT64_MAX, "hash is not that"},
    {'d', 88, 8, 0, "do not add up"},
    {'d', 88, 8, UINT64_MAX, "do not add up"},
    {'c', 0, 8, 0, "offset or size"},
    {'c', 0, 8, UINT64_MAX, "offset or size"},
    {'c', 8, 4, 0, "offset or size"},
    {'c', 8, 4, 1, "belong to no draw"},
    {'c', 8, 4, UINT32_MAX, "offset or size"},
    {'c', 12, 4, 1, "its draw"},
    {'c', 12, 4, UINT32_MAX, "its draw"},
    {'c', 16, 4, 0, "its count"},
    {'c', 16, 4, 65536, "its count"},
    {'c', 16, 4, UINT32_MAX, "its count"},
    {'c', 20, 2, 0xffff, "bounding box"},
    {'c', 22, 2, 0xffff, "bounding box"},
    {'c', 24, 2, 0, "bounding box"},
    {'c', 24, 2, 0xffff, "bounding box"},
    {'c', 26, 2, 0, "bounding box"},
    {'c', 26, 2, 0xffff, "bounding box"},
    {'c', 28, 4, 1, "bytes 28 to 31"},
    {'c', 32, 8, 0, "checksum"},
    {'c', 40, 8, 0, "hash is not that"},
    {'t', 0, 8, 0, "no trailer"},
    {'t', 8, 8, 0, "table offset"},
    {'t', 8, 8, 129, "do not fit the file's size"},
    {'t', 8, 8, UINT64_MAX, "table offset"},
    {'t', 16, 4, 0, "do not fit the file's size"},
    {'t', 16, 4, 65536, "do not fit the file's size"},
    {'t', 16, 4, 65537, "65537 draws"},
    {'t', 16, 4, UINT32_MAX, "4294967295 draws"},
    {'t', 20, 4, 1, "bytes 20 to 23"},
    {'t', 24, 8, 0, "do not fit the file's size"},
    {'t', 24, 8, UINT64_MAX / 56 + 1, "chunk count"},
    {'t', 24, 8, UINT64_MAX, "chunk count"},
    {'t', 32, 8, 0, "do not add up"},
    {'t', 32, 8, UINT64_MAX, "do not add up"},
    {'t', 40, 8, 0, "hash is not that"},
};

static void test_fields_at_their_extremes(void **state)
{
    (void)state;
    bytes file = small_trace(2, 200), copy = {malloc(file.size), file.size};
    for (size_t i = 0; i < sizeof field_cases / sizeof *field_cases; i++) {
        const struct field_case *test = &field_cases[i];
        memcpy(copy.data, file.data, file.size);
        uint8_t *trailer = copy.data + copy.size - TRAILER;
        uint8_t *draw = copy.data + get64(trailer + 8);
        uint8_t *record = test->record == 'h'   ? copy.data
                          : test->record == 'd' ? draw
                          : test->record == 'c' ? draw + DRAW
                                                : trailer;
        memcpy(record + test->offset, &test->value, (size_t)test->size);
        seal(copy);
        const char *message = verdict(copy.data, copy.size);
        if (!strstr(message, test->message))
            fail_msg("%c %d %d: expected '%s', seen '%s'", test->record, test->offset, test->size, test->message,
                     message);
    }
    free(file.data);
    free(copy.data);
}

// The file with its only chunk's frame replaced, sealed but for the digest and the hash of the whole.
static bytes with_frame(bytes file, const uint8_t *frame, size_t frame_size)
{
    size_t tables = DRAW + CHUNK + TRAILER;
    bytes forged = {malloc(HEADER + frame_size + tables), HEADER + frame_size + tables};
    memcpy(forged.data, file.data, HEADER);
    memcpy(forged.data + HEADER, frame, frame_size);
    uint8_t *draw = forged.data + HEADER + frame_size, *chunk = draw + DRAW, *trailer = chunk + CHUNK;
    memcpy(draw, file.data + file.size - tables, tables);
    uint64_t sum = XXH3_64bits(frame, frame_size), place = HEADER + frame_size;
    uint32_t stored = (uint32_t)frame_size;
    memcpy(chunk + 8, &stored, 4);
    memcpy(chunk + 32, &sum, 8);
    memcpy(trailer + 8, &place, 8);
    seal(forged);
    return forged;
}

enum { FORGED = 50, ROOM = 8192 };

// Sets one byte of the planes and packs them again.
static const char *verdict_with_plane_byte(bytes file, size_t at, uint8_t value)
{
    uint8_t planes[ROOM], frame[ROOM];
    size_t size =
        ZSTD_decompress(planes, sizeof planes, file.data + HEADER, file.size - HEADER - DRAW - CHUNK - TRAILER);
    assert_int_equal(size, 33 * FORGED);
    planes[at] = value;
    size_t stored = ZSTD_compress(frame, sizeof frame, planes, size, 1);
    bytes forged = with_frame(file, frame, stored);
    const char *message = verdict(forged.data, forged.size);
    free(forged.data);
    return message;
}

static void test_forged_fragments(void **state)
{
    (void)state;
    bytes file = small_trace(2, FORGED);
    assert_non_null(strstr(verdict_with_plane_byte(file, FORGED, 0x70), "x is "));  // high byte of the first x
    assert_non_null(strstr(verdict_with_plane_byte(file, 3 * FORGED, 0x70), "y is "));
    assert_non_null(strstr(verdict_with_plane_byte(file, 4 * FORGED, 0x20), "sample is "));
    assert_non_null(strstr(verdict_with_plane_byte(file, 5 * FORGED, 0x33), "digest"));  // a primitive
    assert_non_null(strstr(verdict_with_plane_byte(file, 10 * FORGED - 1, 0x01), "digest"));
    int nonfinite = 0;
    for (int value = 0; value < 256; value++)  // the highest byte of the first red
        nonfinite += strstr(verdict_with_plane_byte(file, 20 * FORGED, (uint8_t)value),
                            "as the trace is not marked nonfinite") != NULL;
    assert_true(nonfinite > 0);
    free(file.data);
}

static void test_forged_frames(void **state)
{
    (void)state;
    bytes file = small_trace(2, FORGED);
    uint8_t planes[ROOM] = {0}, frame[ROOM];
    const size_t sizes[] = {0, 1, 33 * FORGED - 1, 33 * FORGED + 1, ROOM};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {  // one frame of another size
        bytes forged = with_frame(file, frame, ZSTD_compress(frame, sizeof frame, planes, sizes[i], 1));
        assert_non_null(strstr(verdict(forged.data, forged.size), "not one zstd frame"));
        free(forged.data);
    }
    size_t half =
        ZSTD_compress(frame, sizeof frame, planes, 33 * FORGED / 2, 1);  // two frames of the right size together
    half += ZSTD_compress(frame + half, sizeof frame - half, planes, 33 * FORGED - 33 * FORGED / 2, 1);
    bytes forged = with_frame(file, frame, half);
    assert_non_null(strstr(verdict(forged.data, forged.size), "not one zstd frame"));
    free(forged.data);
    forged = with_frame(file, (const uint8_t *)"no frame at all", 15);
    assert_non_null(strstr(verdict(forged.data, forged.size), "not one zstd frame"));
    free(forged.data);
    free(file.data);
}

// Many random changes, sealed: none may crash, and none that changes a byte may pass.
static void test_random_forgeries(void **state)
{
    (void)state;
    bytes file = small_trace(4, 300), copy = {malloc(file.size), file.size};
    uint64_t random = 3;
    for (int round = 0; round < 4000; round++) {
        memcpy(copy.data, file.data, file.size);
        for (uint64_t changes = 1 + random_next(&random) % 4; changes > 0; changes--) {
            size_t tail = DRAW + CHUNK + TRAILER;
            size_t at = random_next(&random) % 2 ? file.size - tail + random_next(&random) % tail
                                                 : random_next(&random) % file.size;
            copy.data[at] = (uint8_t)random_next(&random);
        }
        seal(copy);
        bool same = memcmp(copy.data, file.data, file.size) == 0;
        assert_int_equal(verdict(copy.data, copy.size)[0] == 0, same);
    }
    free(file.data);
    free(copy.data);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_cut),        cmocka_unit_test(test_added_bytes),
        cmocka_unit_test(test_every_bit),        cmocka_unit_test(test_fields_at_their_extremes),
        cmocka_unit_test(test_forged_fragments), cmocka_unit_test(test_forged_frames),
        cmocka_unit_test(test_random_forgeries),
    };
    return cmocka_run_group_tests(tests, NULL, remove_test_folder);
}
