// Numbers of the text form, whatever the locale: strict to read, shortest to write.
#ifndef ROPSIM_TRACE_NUMBERS_H
#define ROPSIM_TRACE_NUMBERS_H

#include <locale.h>
#include <stdbool.h>
#include <stdint.h>

typedef enum number_result {
    NUMBER_OK,
    NUMBER_MALFORMED,  // not a decimal or C hexadecimal number, not inf, -inf or nan
    NUMBER_TOO_LARGE,  // a finite text whose value is beyond the type
} number_result;

// `text` ends with a NUL and must be a number to its end. inf and nan are read: ask isfinite.
number_result number_read_double(locale_t c_locale, const char *text, double *value);
number_result number_read_float(locale_t c_locale, const char *text, float *value);
// Digits only, at most `max`.
number_result number_read_uint(const char *text, uint64_t max, uint64_t *value);
bool number_read_int(const char *text, int min, int max, int *value);

enum { NUMBER_SIZE = 32 };

// The shortest text that reads back as the same bits. Needs the C locale in force (uselocale).
int number_write_double(double value, char text[NUMBER_SIZE]);
int number_write_float(float value, char text[NUMBER_SIZE]);

#endif
