// Each keyword stands at most once, before the first draw, in any order; only `size` must be there, and `samples` comes
// before `positions`.
#include "text_header.h"

#include "block.h"
#include "numbers.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

status text_expect_words(const lines *lines, int min, int max, const char *form)
{
    if (lines->word_count > max)
        return lines_refuse(lines, lines->words[max].column, "too many fields; expected: %s", form);
    if (lines->word_count < min)
        return lines_refuse(lines, lines_end_column(lines), "too few fields; expected: %s", form);
    return STATUS_OK;
}

status text_read_uint(const lines *lines, int index, uint64_t max, const char *what, uint64_t *value)
{
    const word *word = &lines->words[index];
    if (number_read_uint(word->text, max, value) == NUMBER_OK)
        return STATUS_OK;
    return lines_refuse(lines, word->column, "%s is '%.40s', expected a whole number from 0 to %" PRIu64, what,
                        word->text, max);
}

static status refuse_number(const lines *lines, int index, const char *what, number_result result, bool nonfinite)
{
    const word *word = &lines->words[index];
    if (result == NUMBER_TOO_LARGE)
        return lines_refuse(lines, word->column, "%s '%.40s' is too large for its type", what, word->text);
    if (result == NUMBER_OK)
        return lines_refuse(lines, word->column,
                            "%s is '%s'; only a trace whose first line says `ropsim-trace 1 nonfinite` may hold it",
                            what, word->text);
    return lines_refuse(lines, word->column, "%s is '%.40s', expected a decimal or hexadecimal number%s", what,
                        word->text, nonfinite ? ", inf, -inf or nan" : "");
}

status text_read_float(const lines *lines, int index, locale_t c_locale, bool nonfinite, const char *what, float *value)
{
    number_result result = number_read_float(c_locale, lines->words[index].text, value);
    if (result != NUMBER_OK || !(nonfinite || isfinite(*value)))
        return refuse_number(lines, index, what, result, nonfinite);
    const uint32_t nan = CANONICAL_NAN_FLOAT;
    if (isnan(*value))
        memcpy(value, &nan, sizeof nan);
    return STATUS_OK;
}

status text_read_double(const lines *lines, int index, locale_t c_locale, bool nonfinite, const char *what,
                        double *value)
{
    number_result result = number_read_double(c_locale, lines->words[index].text, value);
    if (result != NUMBER_OK || !(nonfinite || isfinite(*value)))
        return refuse_number(lines, index, what, result, nonfinite);
    const uint64_t nan = CANONICAL_NAN_DOUBLE;
    if (isnan(*value))
        memcpy(value, &nan, sizeof nan);
    return STATUS_OK;
}

static status read_first_line(lines *lines, trace_info *info)
{
    const char *form = "ropsim-trace 1 [nonfinite]";
    status result = lines_next(lines);
    if (result == STATUS_OK)
        result = text_expect_words(lines, 2, 3, form);
    if (result != STATUS_OK)
        return result;
    const word *words = lines->words;
    if (lines->line != 1 || strcmp(words[0].text, "ropsim-trace") != 0)
        return lines_refuse(lines, words[0].column, "expected as the file's first line: %s", form);
    if (strcmp(words[1].text, "1") != 0)
        return lines_refuse(lines, words[1].column, "version '%.40s', only version 1 is known", words[1].text);
    if (lines->word_count == 3 && strcmp(words[2].text, "nonfinite") != 0)
        return lines_refuse(lines, words[2].column, "'%.40s', expected nonfinite or nothing", words[2].text);
    info->nonfinite = lines->word_count == 3;
    return STATUS_OK;
}

static status read_size(lines *lines, locale_t c_locale, trace_info *info)
{
    (void)c_locale;
    uint64_t width = 0, height = 0;
    status result = text_expect_words(lines, 3, 3, "size WIDTH HEIGHT");
    if (result == STATUS_OK)
        result = text_read_uint(lines, 1, TRACE_SIZE_MAX, "the width", &width);
    if (result == STATUS_OK)
        result = text_read_uint(lines, 2, TRACE_SIZE_MAX, "the height", &height);
    if (result == STATUS_OK && (width == 0 || height == 0))
        result = lines_refuse(lines, lines->words[width ? 2 : 1].column, "size 0, expected 1 to %d", TRACE_SIZE_MAX);
    info->width = (uint32_t)width;
    info->height = (uint32_t)height;
    return result;
}

static status read_samples(lines *lines, locale_t c_locale, trace_info *info)
{
    (void)c_locale;
    uint64_t samples = 0;
    status result = text_expect_words(lines, 2, 2, "samples COUNT");
    if (result == STATUS_OK && (number_read_uint(lines->words[1].text, TRACE_SAMPLES_MAX, &samples) != NUMBER_OK ||
                                samples == 0 || (samples & (samples - 1)) != 0))
        result = lines_refuse(lines, lines->words[1].column, "'%.40s' samples, expected 1, 2, 4, 8 or 16",
                              lines->words[1].text);
    info->samples = (uint32_t)samples;
    return result;
}

static status read_positions(lines *lines, locale_t c_locale, trace_info *info)
{
    (void)c_locale;
    char form[96];
    int numbers = 2 * (int)info->samples;
    snprintf(form, sizeof form, "positions and %d numbers, X Y of each sample (`samples` stands before this line)",
             numbers);
    status result = text_expect_words(lines, numbers + 1, numbers + 1, form);
    for (int i = 0; result == STATUS_OK && i < numbers; i++) {
        int position = 0;
        const word *word = &lines->words[i + 1];
        if (!number_read_int(word->text, -128, 127, &position))
            result = lines_refuse(lines, word->column,
                                  "position '%.40s', expected -128 to 127 (1/256 pixel from the centre)", word->text);
        info->sample_positions[i / 2][i % 2] = (int16_t)position;
    }
    return result;
}

static status read_background(lines *lines, locale_t c_locale, trace_info *info)
{
    status result = text_expect_words(lines, 5, 5, "background R G B A");
    for (int c = 0; result == STATUS_OK && c < 4; c++)
        result = text_read_float(lines, c + 1, c_locale, false, "the background", &info->background[c]);
    return result;
}

static status read_one_word(lines *lines, const char *form, const char *first, const char *second, bool *is_second)
{
    status result = text_expect_words(lines, 2, 2, form);
    if (result != STATUS_OK)
        return result;
    const word *word = &lines->words[1];
    *is_second = strcmp(word->text, second) == 0;
    if (!*is_second && strcmp(word->text, first) != 0)
        return lines_refuse(lines, word->column, "'%.40s', expected %s or %s", word->text, first, second);
    return STATUS_OK;
}

static status read_depth(lines *lines, locale_t c_locale, trace_info *info)
{
    (void)c_locale;
    return read_one_word(lines, "depth normal|reversed", "normal", "reversed", &info->reversed_depth);
}

static status read_depth_bits(lines *lines, locale_t c_locale, trace_info *info)
{
    (void)c_locale;
    bool narrow = false;
    status result = read_one_word(lines, "depth_bits 32|64", "64", "32", &narrow);
    info->depth_bits = narrow ? 32 : 64;
    return result;
}

static const struct keyword {
    const char *name;
    status (*read)(lines *lines, locale_t c_locale, trace_info *info);
} keywords[] = {
    {"size", read_size},           {"samples", read_samples},
    {"positions", read_positions}, {"background", read_background},
    {"depth", read_depth},         {"depth_bits", read_depth_bits},
};
enum {
    KEYWORD_COUNT = sizeof keywords / sizeof *keywords,
    KEYWORD_SIZE = 0,
    KEYWORD_SAMPLES = 1,
    KEYWORD_POSITIONS = 2
};

static status read_keyword(lines *lines, locale_t c_locale, trace_info *info, bool seen[KEYWORD_COUNT])
{
    const word *name = &lines->words[0];
    int k = 0;
    while (k < KEYWORD_COUNT && strcmp(name->text, keywords[k].name) != 0)
        k++;
    if (k == KEYWORD_COUNT)
        return lines_refuse(lines, name->column,
                            "'%.40s', expected size, samples, positions, background, depth, depth_bits or draw",
                            name->text);
    if (seen[k])
        return lines_refuse(lines, name->column, "a second `%s` line", name->text);
    if (k == KEYWORD_SAMPLES && seen[KEYWORD_POSITIONS])
        return lines_refuse(lines, name->column, "`samples` must stand before `positions`");
    seen[k] = true;
    return keywords[k].read(lines, c_locale, info);
}

status text_header_read(lines *lines, locale_t c_locale, trace_info *info)
{
    bool seen[KEYWORD_COUNT] = {false};
    info->samples = 1;
    info->depth_bits = 64;
    status result = read_first_line(lines, info);
    if (result == STATUS_OK)
        result = lines_next(lines);
    while (result == STATUS_OK && lines->word_count > 0 && strcmp(lines->words[0].text, "draw") != 0 &&
           strcmp(lines->words[0].text, "f") != 0) {
        result = read_keyword(lines, c_locale, info, seen);
        if (result == STATUS_OK)
            result = lines_next(lines);
    }
    if (result == STATUS_OK && !seen[KEYWORD_SIZE])
        result = lines_refuse(lines, 1, "no `size WIDTH HEIGHT` line before the first draw");
    if (!seen[KEYWORD_POSITIONS])
        trace_standard_positions(info);
    return result;
}
