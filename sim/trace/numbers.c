// strtod reads more than the text form allows (blanks, "infinity", nan(...)), so the grammar is checked first.
#include "numbers.h"

#include <ctype.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *skip_digits(const char *text, bool hexadecimal)
{
    while (hexadecimal ? isxdigit((unsigned char)*text) != 0 : *text >= '0' && *text <= '9')
        text++;
    return text;
}

// [+-] then digits[.digits][e[+-]digits] or 0x hexdigits[.hexdigits][p[+-]digits], a digit on one side of the point.
static bool is_finite_number(const char *text)
{
    text += *text == '+' || *text == '-';
    bool hexadecimal = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    text += hexadecimal ? 2 : 0;
    const char *point = skip_digits(text, hexadecimal), *end = point;
    ptrdiff_t digits = point - text;
    if (*point == '.') {
        end = skip_digits(point + 1, hexadecimal);
        digits += end - point - 1;
    }
    if (digits == 0)
        return false;
    if (hexadecimal ? *end == 'p' || *end == 'P' : *end == 'e' || *end == 'E') {
        const char *exponent = end + 1;
        exponent += *exponent == '+' || *exponent == '-';
        end = skip_digits(exponent, false);
        if (end == exponent)
            return false;
    }
    return *end == 0;
}

static bool is_nonfinite_number(const char *text)
{
    return strcmp(text, "inf") == 0 || strcmp(text, "+inf") == 0 || strcmp(text, "-inf") == 0 ||
           strcmp(text, "nan") == 0;
}

number_result number_read_double(locale_t c_locale, const char *text, double *value)
{
    bool finite = is_finite_number(text);
    if (!finite && !is_nonfinite_number(text))
        return NUMBER_MALFORMED;
    *value = strtod_l(text, NULL, c_locale);
    return finite && isinf(*value) ? NUMBER_TOO_LARGE : NUMBER_OK;
}

// Not by way of double: that would round twice.
number_result number_read_float(locale_t c_locale, const char *text, float *value)
{
    bool finite = is_finite_number(text);
    if (!finite && !is_nonfinite_number(text))
        return NUMBER_MALFORMED;
    *value = strtof_l(text, NULL, c_locale);
    return finite && isinf(*value) ? NUMBER_TOO_LARGE : NUMBER_OK;
}

number_result number_read_uint(const char *text, uint64_t max, uint64_t *value)
{
    *value = 0;
    if (!*text || *skip_digits(text, false))
        return NUMBER_MALFORMED;
    for (; *text; text++)
        if (__builtin_mul_overflow(*value, 10u, value) ||
            __builtin_add_overflow(*value, (unsigned)(*text - '0'), value))
            return NUMBER_TOO_LARGE;
    return *value <= max ? NUMBER_OK : NUMBER_TOO_LARGE;
}

bool number_read_int(const char *text, int min, int max, int *value)
{
    bool negative = *text == '-';
    uint64_t size;
    if (number_read_uint(text + negative, 1u << 30, &size) != NUMBER_OK)
        return false;
    *value = negative ? -(int)size : (int)size;
    return *value >= min && *value <= max;
}

// %g drops trailing zeros, so a value that needs fewer digits than the first try comes out as short.
int number_write_double(double value, char text[NUMBER_SIZE])
{
    for (int digits = 15;; digits++) {
        int length = snprintf(text, NUMBER_SIZE, "%.*g", digits, value);
        if (digits == 17 || isnan(value) || strtod(text, NULL) == value)
            return length;
    }
}

int number_write_float(float value, char text[NUMBER_SIZE])
{
    for (int digits = 6;; digits++) {
        int length = snprintf(text, NUMBER_SIZE, "%.*g", digits, (double)value);
        if (digits == 9 || isnan(value) || strtof(text, NULL) == value)
            return length;
    }
}
