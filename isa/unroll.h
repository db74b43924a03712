// Program text with parameters and loops, written out.
#ifndef ROPSIM_UNROLL_H
#define ROPSIM_UNROLL_H

#include "lex.h"

typedef struct unrolled {
    char *text;
    size_t size;
    int *lines;       // of each line of `text`: the source's line
    int line_count;
    bool failed;
} unrolled;

// False after saying what is wrong. Free with unroll_free.
bool unroll_text(const char *file, const char *text, size_t size, const parameter *parameters, int parameter_count,
                 const report *report, unrolled *out);
void unroll_free(unrolled *unrolled);

#endif
