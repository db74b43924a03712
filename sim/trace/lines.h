// A text file as lines of words, each word with its column, in a fixed amount of memory.
#ifndef ROPSIM_TRACE_LINES_H
#define ROPSIM_TRACE_LINES_H

#include "../sim.h"

enum { LINE_MAX_BYTES = 4096, WORDS_MAX = 64, LINES_BUFFER = 65536 };

typedef struct word {
    const char *text;  // ends with a NUL
    int length, column;
} word;

typedef struct lines {
    const char *path;
    const report *report;
    int descriptor;
    uint64_t offset;        // of the next byte to read into `buffer`
    size_t begin, end;      // what of `buffer` is still to come
    uint64_t line;          // number of the current line, from 1
    word words[WORDS_MAX];  // of the current line, its comment left out
    int word_count;
    char text[LINE_MAX_BYTES + 1], buffer[LINES_BUFFER];
} lines;

// Reads `descriptor`, which stays the caller's, from its beginning.
void lines_begin(lines *lines, const char *path, int descriptor, const report *report);
// The next line that has a word; word_count 0: the end.
status lines_next(lines *lines);
// "path:line:column: " and a message; STATUS_REFUSED.
status lines_refuse(const lines *lines, int column, const char *format, ...) PRINTF_LIKE(3, 4);
// Of the column after the last word: where something is missing.
int lines_end_column(const lines *lines);

#endif
