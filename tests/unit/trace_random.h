// Traces for tests: seeded random content, written, read and compared. For the test_trace programs only.
#ifndef ROPSIM_TEST_TRACE_RANDOM_H
#define ROPSIM_TEST_TRACE_RANDOM_H

#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "../../sim/sim.h"

enum { RANDOM_MAX = 140000 };  // more than two blocks

// All fragments of a trace in memory.
typedef struct memory_trace {
    trace_info info;
    trace_draw draws[8];
    uint32_t count;
    uint32_t draw[RANDOM_MAX], primitive[RANDOM_MAX];
    uint16_t x[RANDOM_MAX], y[RANDOM_MAX];
    uint8_t sample[RANDOM_MAX];
    double depth[RANDOM_MAX];
    float rgba[4][RANDOM_MAX];
} memory_trace;

// What was said last, for tests of messages.
static char said[4096];

static inline void keep_message(void *user, severity severity, const char *text)
{
    (void)user;
    if (severity == SEVERITY_ERROR)
        snprintf(said, sizeof said, "%s", text);
}

static const report keeping = {.say = keep_message};

static inline uint64_t random_next(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static inline double random_unit(uint64_t *state)
{
    return (double)(random_next(state) >> 11) * 0x1p-53;
}

// Some values are ordinary, some are random bits, some are zeros, denormals and limits.
static inline double random_value(uint64_t *state, bool nonfinite, bool narrow)
{
    static const double special[] = {0.0, -0.0, 1.0, 0.5, 5e-324, 1.7976931348623157e308, -3.25, 1e-300};
    double value = random_unit(state);
    uint64_t kind = random_next(state) % 16;
    if (kind < 2)
        value = special[random_next(state) % 8];
    else if (kind < 4) {
        uint64_t bits = random_next(state);
        memcpy(&value, &bits, sizeof value);
    } else if (kind == 4 && nonfinite)
        value = random_next(state) % 2 ? __builtin_inf() : __builtin_nan("");
    if (narrow)
        value = (double)(float)value;
    if (__builtin_isnan(value))
        value = __builtin_nan("");
    if (!nonfinite && !__builtin_isfinite(value))
        value = 0.25;
    return value;
}

// Triangle-like runs: rows of pixels of one primitive with affine values, mixed with noise.
static inline memory_trace *random_trace(uint64_t seed, uint32_t samples, int depth_bits, bool nonfinite,
                                         uint32_t count)
{
    memory_trace *trace = calloc(1, sizeof *trace);
    assert_non_null(trace);
    uint64_t state = seed;
    trace_info *info = &trace->info;
    *info = (trace_info){
        .samples = samples, .depth_bits = depth_bits, .nonfinite = nonfinite, .background = {0.1f, 0, -0.0f, 1}};
    // one call a statement: C leaves the order of calls within an expression open
    info->width = 1 + (uint32_t)(random_next(&state) % 300);
    info->height = 1 + (uint32_t)(random_next(&state) % 300);
    info->reversed_depth = random_next(&state) % 2;
    trace_standard_positions(info);
    if (random_next(&state) % 2)
        info->sample_positions[samples - 1][1] = -77;
    info->draw_count = 1 + (uint32_t)(random_next(&state) % 8);
    trace->count = count;
    uint32_t primitive = 0;
    for (uint32_t i = 0; i < count; i++) {
        trace->draw[i] = (uint32_t)((uint64_t)i * info->draw_count / count);
        trace->draws[trace->draw[i]].fragments++;
        bool run = i > 0 && random_next(&state) % 8;
        uint64_t next = random_next(&state);
        primitive = run ? primitive : (uint32_t)next >> (next >> 59);
        trace->primitive[i] = primitive;
        trace->x[i] = (uint16_t)(run ? (trace->x[i - 1] + 1u) % info->width : random_next(&state) % info->width);
        trace->y[i] = (uint16_t)(run ? trace->y[i - 1] : random_next(&state) % info->height);
        trace->sample[i] = (uint8_t)(random_next(&state) % samples);
        trace->depth[i] = run && random_next(&state) % 4 ? (double)(float)(trace->depth[i - 1] * 0.999)
                                                         : random_value(&state, nonfinite, depth_bits == 32);
        if (!nonfinite && !__builtin_isfinite(trace->depth[i]))
            trace->depth[i] = 0;
        if (__builtin_isnan(trace->depth[i]))
            trace->depth[i] = __builtin_nan("");
        for (int c = 0; c < 4; c++)
            trace->rgba[c][i] = run ? trace->rgba[c][i - 1] : (float)random_value(&state, nonfinite, true);
    }
    for (uint32_t d = 0; d < info->draw_count; d++) {
        trace_draw *draw = &trace->draws[d];
        snprintf(draw->name, sizeof draw->name, "draw%u", d);
        draw->class = (draw_class)(random_next(&state) % CLASS_COUNT);
        draw->triangles = random_next(&state) % 3 ? random_next(&state) : 0;
        draw->vertices = draw->triangles / 2;
    }
    return trace;
}

// Writes it in appends of uneven sizes. Returns trace_finish's status.
static inline status write_trace(const memory_trace *trace, const char *path, const report *report, char hash[33])
{
    trace_writer *writer;
    uint64_t state = trace->count;
    assert_int_equal(trace_create(path, &trace->info, report, &writer), STATUS_OK);
    uint32_t i = 0;
    for (uint32_t d = 0; d < trace->info.draw_count; d++) {
        trace_begin_draw(writer, trace->draws[d].name, trace->draws[d].class);
        for (uint64_t left = trace->draws[d].fragments; left > 0;) {
            uint32_t count = 1 + (uint32_t)(random_next(&state) % 90000);
            count = count < left ? count : (uint32_t)left;
            fragments run = {.count = count,
                             .x = trace->x + i,
                             .y = trace->y + i,
                             .sample = trace->sample + i,
                             .depth = trace->depth + i,
                             .primitive = trace->primitive + i,
                             .rgba = {trace->rgba[0] + i, trace->rgba[1] + i, trace->rgba[2] + i, trace->rgba[3] + i}};
            trace_append(writer, &run);
            i += count;
            left -= count;
        }
        trace_end_draw(writer, trace->draws[d].triangles, trace->draws[d].vertices);
    }
    return trace_finish(writer, hash);
}

static inline void assert_same_info(const trace_info *a, const memory_trace *expected)
{
    const trace_info *b = &expected->info;
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    assert_int_equal(a->samples, b->samples);
    assert_int_equal(a->depth_bits, b->depth_bits);
    assert_int_equal(a->nonfinite, b->nonfinite);
    assert_int_equal(a->reversed_depth, b->reversed_depth);
    assert_memory_equal(a->background, b->background, sizeof a->background);
    assert_memory_equal(a->sample_positions, b->sample_positions, sizeof a->sample_positions);
    assert_int_equal(a->fragment_count, expected->count);
    assert_int_equal(a->draw_count, b->draw_count);
    for (uint32_t d = 0; d < a->draw_count; d++) {
        assert_string_equal(a->draws[d].name, expected->draws[d].name);
        assert_int_equal(a->draws[d].class, expected->draws[d].class);
        assert_int_equal(a->draws[d].triangles, expected->draws[d].triangles);
        assert_int_equal(a->draws[d].vertices, expected->draws[d].vertices);
        assert_int_equal(a->draws[d].fragments, expected->draws[d].fragments);
    }
}

// Every fragment, bit by bit, in order.
static inline void assert_same_fragments(trace *trace, const memory_trace *expected)
{
    uint32_t i = 0;
    for (;;) {
        fragments run;
        assert_int_equal(trace_next(trace, &run), STATUS_OK);
        if (run.count == 0)
            break;
        assert_true(run.count <= expected->count - i);
        for (uint32_t k = 0; k < run.count; k++)
            assert_int_equal(run.draw, expected->draw[i + k]);
        assert_memory_equal(run.x, expected->x + i, run.count * sizeof *run.x);
        assert_memory_equal(run.y, expected->y + i, run.count * sizeof *run.y);
        assert_memory_equal(run.sample, expected->sample + i, run.count);
        assert_memory_equal(run.depth, expected->depth + i, run.count * sizeof *run.depth);
        for (int c = 0; c < 4; c++)
            assert_memory_equal(run.rgba[c], expected->rgba[c] + i, run.count * sizeof *run.rgba[c]);
        assert_memory_equal(run.primitive, expected->primitive + i, run.count * sizeof *run.primitive);
        i += run.count;
    }
    assert_int_equal(i, expected->count);
}

// The file's bytes; free() them.
static inline uint8_t *file_bytes(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    uint8_t *bytes = malloc(*size + 1);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    bytes[*size] = 0;
    return bytes;
}

static inline void put_file(const char *path, const void *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

// A folder of the test program's own: give remove_test_folder as the group's teardown.
static inline const char *test_folder(void)
{
    // In memory where that is possible: the damage tests write some ten thousand files.
    static char folders[][32] = {"/dev/shm/ropsim-test-XXXXXX", "/tmp/ropsim-test-XXXXXX"};
    static const char *made;
    if (!made)
        made = mkdtemp(folders[0]);
    if (!made)
        made = mkdtemp(folders[1]);
    assert_non_null(made);
    return made;
}

// How many files it holds.
static inline int test_folder_files(void)
{
    DIR *folder = opendir(test_folder());
    assert_non_null(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(folder));)
        count += entry->d_name[0] != '.';
    closedir(folder);
    return count;
}

static inline int remove_test_folder(void **state)
{
    (void)state;
    DIR *folder = opendir(test_folder());
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        unlinkat(dirfd(folder), entry->d_name, 0);
    if (folder)
        closedir(folder);
    return rmdir(test_folder());
}

static inline const char *test_path(const char *name)
{
    static char paths[4][256];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", test_folder(), name);
    return path;
}

#endif
