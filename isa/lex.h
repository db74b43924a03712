// Lines of a program as tokens, and messages that point at one.
#ifndef ROPSIM_LEX_H
#define ROPSIM_LEX_H

#include "isa.h"

enum { TOKEN_MAX = 64, ERROR_MAX = 20 };

typedef struct token {
    const char *text;  // in the source, not terminated
    int length;        // 0: the end of the line
    int column;        // from 1
} token;

// Reads a text line by line. `at` is the next token of the current line.
typedef struct lexer {
    const char *file, *next, *end;
    const char *line_text;
    int line_length, line;
    const int *line_map;  // of unrolled text: source line of each line; NULL: as counted
    int count;            // lines read
    token tokens[TOKEN_MAX + 1];
    int token_count, at;
    const report *report;
    int errors;
} lexer;

void lex_start(lexer *lexer, const char *file, const char *text, size_t size, const report *report);
// Moves to the next line that has a token; false at the end of the text.
bool lex_line(lexer *lexer);
token lex_peek(const lexer *lexer);
token lex_take(lexer *lexer);
bool lex_is(token token, const char *word);
// Takes the next token if it is `word`.
bool lex_accept(lexer *lexer, const char *word);
// Says an error at a token: file:line:column, what is wrong, the line and a caret. Always false.
bool lex_error(lexer *lexer, token at, const char *format, ...) PRINTF_LIKE(3, 4);
// The same for a token of an earlier line.
bool lex_error_in_line(lexer *lexer, int line, token at, const char *format, ...) PRINTF_LIKE(4, 5);
bool lex_expect(lexer *lexer, const char *word);
// Fails if anything is left on the line.
bool lex_finish(lexer *lexer);
bool lex_name(lexer *lexer, const char *what, char name[NAME_SIZE]);
// An unsigned integer, decimal or 0x, of at most `max`.
bool lex_uint(lexer *lexer, const char *what, uint64_t max, uint64_t *value);
bool lex_parse_uint(token token, uint64_t *value);
bool lex_parse_float(token token, float *value);  // needs a '.', an exponent or 0x..p; finite
// The index of the next token among `count` names, `stride` bytes apart; says "did you mean" if it is none.
bool lex_lookup(lexer *lexer, const char *what, const char *const *names, int count, int *index);

#endif
