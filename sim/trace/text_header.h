// The lines of the text form before its first draw.
#ifndef ROPSIM_TRACE_TEXT_HEADER_H
#define ROPSIM_TRACE_TEXT_HEADER_H

#include "lines.h"

#include <locale.h>

// Reads up to the first draw line, which is then the current line, or to the end. Fills all of `info` but draws, counts
// and hash.
status text_header_read(lines *lines, locale_t c_locale, trace_info *info);
// Refuses a line of other than `min` to `max` words; `form` shows one.
status text_expect_words(const lines *lines, int min, int max, const char *form);
// Reads word `index` as a whole number up to `max`; `what` names it.
status text_read_uint(const lines *lines, int index, uint64_t max, const char *what, uint64_t *value);
status text_read_float(const lines *lines, int index, locale_t c_locale, bool nonfinite, const char *what,
                       float *value);
status text_read_double(const lines *lines, int index, locale_t c_locale, bool nonfinite, const char *what,
                        double *value);

#endif
