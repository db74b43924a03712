// An expectation and a run in, whether it holds and what was seen out.
//
// A depth is compared as the code that the plane holds, so 0.3 is met by whatever 0.3 is in the plane's format; with a
// tolerance it is compared as a number. Colours and floats agree within 1e-5 unless told.
#include "rtest.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

static const double DEFAULT_TOLERANCE = 1e-5;

static bool compare_counts(relation relation, uint64_t seen, uint64_t expected)
{
    switch (relation) {
    case RELATION_EQUAL: return seen == expected;
    case RELATION_LESS: return seen < expected;
    case RELATION_AT_MOST: return seen <= expected;
    case RELATION_GREATER: return seen > expected;
    case RELATION_AT_LEAST: return seen >= expected;
    }
    return false;
}

static bool is_near(double seen, double expected, double tolerance)
{
    return seen == expected || (isnan(seen) && isnan(expected)) || fabs(seen - expected) <= tolerance;
}

static bool compare_figures(const expectation *e, double seen)
{
    const double expected = e->values[0];
    switch (e->relation) {
    case RELATION_EQUAL: return is_near(seen, expected, e->has_tolerance ? e->tolerance : DEFAULT_TOLERANCE);
    case RELATION_LESS: return seen < expected;
    case RELATION_AT_MOST: return seen <= expected;
    case RELATION_GREATER: return seen > expected;
    case RELATION_AT_LEAST: return seen >= expected;
    }
    return false;
}

static uint64_t count_of(expect_kind kind, const run_result *r)
{
    switch (kind) {
#define EXPECT_COUNT(name, value, meaning) \
    case EXPECT_##name: \
        return value;
#define EXPECT_FIGURE(name, value, meaning)
#define EXPECT_FLAG(name, value, meaning) \
    case EXPECT_##name: \
        return value;
#define EXPECT_BYTES(name, field, meaning)
#define EXPECT_VALUES(name, arguments, meaning)
#define EXPECT_TEXT(name, meaning)
#include "expectations.def"
    default: return 0;
    }
}

static double figure_of(expect_kind kind, const run_result *r)
{
    switch (kind) {
#define EXPECT_COUNT(name, value, meaning)
#define EXPECT_FIGURE(name, value, meaning) \
    case EXPECT_##name: \
        return value;
#define EXPECT_FLAG(name, value, meaning)
#define EXPECT_BYTES(name, field, meaning)
#define EXPECT_VALUES(name, arguments, meaning)
#define EXPECT_TEXT(name, meaning)
#include "expectations.def"
    default: return 0;
    }
}

static uint64_t bytes_of(expect_kind kind, const plane_result *plane)
{
    switch (kind) {
#define EXPECT_COUNT(name, value, meaning)
#define EXPECT_FIGURE(name, value, meaning)
#define EXPECT_FLAG(name, value, meaning)
#define EXPECT_BYTES(name, field, meaning) \
    case EXPECT_##name: \
        return plane->field;
#define EXPECT_VALUES(name, arguments, meaning)
#define EXPECT_TEXT(name, meaning)
#include "expectations.def"
    default: return 0;
    }
}

static int find_plane(const expectation *e, const run_result *run, rtest_seen *seen)
{
    const char *names[PLANE_MAX];
    for (int i = 0; i < run->plane_count; i++) {
        names[i] = run->planes[i].name;
        if (strcmp(names[i], e->plane) == 0)
            return i;
    }
    const char *meant = nearest_word(e->plane, names, (size_t)run->plane_count);
    snprintf(seen->problem, sizeof seen->problem, "program %s has no plane `%.60s`%s%s%s", run->program, e->plane,
             meant ? "; did you mean `" : "", meant ? meant : "", meant ? "`?" : "");
    return -1;
}

// Shortest digits that read back as the value.
static void print_float(double value, char word[RTEST_FIGURE_SIZE])
{
    for (int digits = 1; digits <= 9; digits++) {
        float back = 0;
        snprintf(word, RTEST_FIGURE_SIZE, "%.*g", digits, value);
        if (sscanf(word, "%f", &back) == 1 && back == (float)value)
            return;
    }
}

static void print_depth(format format, uint32_t code, bool reversed, char word[RTEST_FIGURE_SIZE])
{
    const double depth = format_code_to_depth(format, code, reversed);
    for (int digits = 1; digits <= 17; digits++) {
        double back = 0;
        snprintf(word, RTEST_FIGURE_SIZE, "%.*g", digits, depth);
        if (sscanf(word, "%lf", &back) == 1 && format_depth_to_code(format, back, reversed) == code)
            return;
    }
}

static double float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

static bool check_float(const expectation *e, int i, double value, rtest_seen *seen)
{
    print_float(value, seen->words[i]);
    return is_near(value, e->values[i], e->has_tolerance ? e->tolerance : DEFAULT_TOLERANCE);
}

static bool check_depth(const expectation *e, format format, uint32_t code, bool reversed, rtest_seen *seen)
{
    const double depth = format_code_to_depth(format, code, reversed);
    if (e->has_tolerance) {
        snprintf(seen->words[0], sizeof seen->words[0], "%.12g", depth);
        return is_near(depth, e->values[0], e->tolerance);
    }
    print_depth(format, code, reversed, seen->words[0]);
    return code == format_depth_to_code(format, e->values[0], reversed);
}

static void check_plane(const expectation *e, const run_result *run, bool reversed, size_t sample, rtest_seen *seen)
{
    const int plane = find_plane(e, run, seen);
    if (plane < 0)
        return;
    const format format = run->planes[plane].format;
    const format_class class = format_table[format].class;
    seen->count = class == FORMAT_CLASS_COLOR ? 4 : 1;
    seen->looks_at_sample = true;
    if (seen->count != e->value_count) {
        snprintf(seen->problem, sizeof seen->problem, "plane `%s` has the format %s, so %s expected", e->plane,
                 format_table[format].name, seen->count == 4 ? "four values, R G B A, are" : "one value is");
        return;
    }
    const uint32_t *values = run->plane_values[plane] + sample * (size_t)seen->count;
    seen->passed = true;
    switch (class) {
    case FORMAT_CLASS_DEPTH: seen->passed = check_depth(e, format, values[0], reversed, seen); break;
    case FORMAT_CLASS_UINT:
        snprintf(seen->words[0], sizeof seen->words[0], "%" PRIu32, values[0]);
        seen->passed = is_near((double)values[0], e->values[0], e->tolerance);
        break;
    case FORMAT_CLASS_FLOAT:
    case FORMAT_CLASS_COLOR:
        for (int i = 0; i < seen->count; i++)
            seen->passed &= check_float(e, i, float_of(values[i]), seen);
        break;
    }
}

static void check_values(const expectation *e, const run_result *run, bool reversed, rtest_seen *seen)
{
    if (e->x >= run->width || e->y >= run->height || e->sample >= run->samples) {
        snprintf(seen->problem, sizeof seen->problem, "the trace has %u x %u pixels of %u sample%s, counted from 0",
                 run->width, run->height, run->samples, run->samples > 1 ? "s" : "");
        return;
    }
    const size_t pixel = (size_t)e->y * run->width + e->x, sample = pixel * run->samples + e->sample;
    if (e->kind == EXPECT_plane && run->samples > 1 && !e->has_sample) {
        snprintf(seen->problem, sizeof seen->problem, "the trace has %u samples a pixel; `sample S` is missing",
                 run->samples);
        return;
    }
    if (e->kind == EXPECT_plane) {
        check_plane(e, run, reversed, sample, seen);
        return;
    }
    const float *rgb = e->has_sample ? run->sample_rgb + 3 * sample : run->image + 3 * pixel;
    seen->count = 3;
    seen->looks_at_sample = seen->passed = true;
    for (int i = 0; i < 3; i++)
        seen->passed &= check_float(e, i, (double)rgb[i], seen);
}

static void see_count(const expectation *e, uint64_t count, rtest_seen *seen)
{
    snprintf(seen->words[0], sizeof seen->words[0], "%" PRIu64, count);
    seen->count = 1;
    seen->passed = compare_counts(e->relation, count, e->count);
}

void rtest_check(const expectation *e, const run_result *run, bool reversed_depth, rtest_seen *seen)
{
    *seen = (rtest_seen){0};
    switch (expect_rows[e->kind].form) {
    case FORM_COUNT: see_count(e, count_of(e->kind, run), seen); break;
    case FORM_BYTES: {
        const int plane = find_plane(e, run, seen);
        if (plane >= 0)
            see_count(e, bytes_of(e->kind, &run->planes[plane]), seen);
        break;
    }
    case FORM_FIGURE: {
        const double figure = figure_of(e->kind, run);
        snprintf(seen->words[0], sizeof seen->words[0], "%.9g", figure);
        seen->count = 1;
        seen->passed = compare_figures(e, figure);
        break;
    }
    case FORM_FLAG: {
        const bool flag = count_of(e->kind, run) != 0;
        snprintf(seen->words[0], sizeof seen->words[0], "%s%s", flag ? "" : "not ", expect_rows[e->kind].name);
        seen->count = 1;
        seen->passed = flag != e->negated;
        break;
    }
    case FORM_VALUES: check_values(e, run, reversed_depth, seen); break;
    case FORM_TEXT: break;  // of messages, not of a run
    }
}
