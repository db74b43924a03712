// Text in, tokens of one line out. A token is a word (letters, digits and _ . + -), one of the marks
// , : ( ) @ ! or a comparison. A comment runs from # to the end of its line.
#include "lex.h"

#include <ctype.h>
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

void lex_start(lexer *lexer, const char *file, const char *text, size_t size, const report *report)
{
    memset(lexer, 0, sizeof *lexer);
    lexer->file = file;
    lexer->next = text;
    lexer->end = size ? text + size : text;  // an empty text may be NULL
    lexer->report = report;
    lexer->tokens[0] = (token){text, 0, 1};  // an error before the first line points there
}

static bool is_word(char c)
{
    return isalnum((unsigned char)c) || c == '_' || c == '.' || c == '+' || c == '-';
}

static int token_length(const char *text, const char *end)
{
    int length = 0;
    while (text + length < end && is_word(text[length]))
        length++;
    if (length)
        return length;
    return text + 1 < end && (*text == '<' || *text == '>') && text[1] == '=' ? 2 : 1;
}

static void split_line(lexer *lexer)
{
    const char *at = lexer->line_text, *end = at + lexer->line_length;
    lexer->token_count = lexer->at = 0;
    while (at < end && *at != '#') {
        if (isspace((unsigned char)*at)) {
            at++;
            continue;
        }
        const token token = {at, token_length(at, end), (int)(at - lexer->line_text) + 1};
        if (lexer->token_count == TOKEN_MAX) {
            lex_error(lexer, token, "too many words in one line; at most %d", TOKEN_MAX);
            break;
        }
        lexer->tokens[lexer->token_count++] = token;
        at += token.length;
    }
    lexer->tokens[lexer->token_count] = (token){at, 0, (int)(at - lexer->line_text) + 1};
}

bool lex_line(lexer *lexer)
{
    while (lexer->next < lexer->end) {
        const char *end = memchr(lexer->next, '\n', (size_t)(lexer->end - lexer->next));
        if (!end)
            end = lexer->end;
        lexer->line_text = lexer->next;
        lexer->line_length = (int)(end - lexer->next);
        lexer->line = lexer->line_map ? lexer->line_map[lexer->count++] : lexer->line + 1;
        lexer->next = end < lexer->end ? end + 1 : end;
        split_line(lexer);
        if (lexer->token_count)
            return true;
    }
    return false;
}

token lex_peek(const lexer *lexer)
{
    return lexer->tokens[lexer->at];
}

token lex_take(lexer *lexer)
{
    const token token = lexer->tokens[lexer->at];
    if (token.length)
        lexer->at++;
    return token;
}

bool lex_is(token token, const char *word)
{
    return (size_t)token.length == strlen(word) && memcmp(token.text, word, (size_t)token.length) == 0;
}

bool lex_accept(lexer *lexer, const char *word)
{
    if (!lex_is(lex_peek(lexer), word))
        return false;
    lexer->at++;
    return true;
}

PRINTF_LIKE(4, 0)
static void say_error(lexer *lexer, int line, token at, const char *format, va_list arguments)
{
    if (++lexer->errors > ERROR_MAX)
        return;
    char text[512];
    vsnprintf(text, sizeof text, format, arguments);
    enum { SHOWN = 160 };
    const char *const line_text = at.text - (at.column - 1);
    int shown = 0;
    while (shown < SHOWN && line_text + shown < lexer->end && line_text[shown] != '\n')
        shown++;
    char caret[SHOWN + 2];
    int column = at.column - 1 < shown ? at.column - 1 : shown;
    for (int i = 0; i < column; i++)
        caret[i] = line_text[i] == '\t' ? '\t' : ' ';
    caret[column] = '^';
    caret[column + 1] = 0;
    report_error(lexer->report, STATUS_REFUSED, "%s:%d:%d: %s\n    %.*s\n    %s", lexer->file, line, at.column, text,
                 shown, line_text, caret);
}

bool lex_error(lexer *lexer, token at, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say_error(lexer, lexer->line, at, format, arguments);
    va_end(arguments);
    return false;
}

bool lex_error_in_line(lexer *lexer, int line, token at, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    say_error(lexer, line, at, format, arguments);
    va_end(arguments);
    return false;
}

bool lex_expect(lexer *lexer, const char *word)
{
    if (lex_accept(lexer, word))
        return true;
    return lex_error(lexer, lex_peek(lexer), "expected '%s'", word);
}

bool lex_finish(lexer *lexer)
{
    if (lex_peek(lexer).length == 0)
        return true;
    return lex_error(lexer, lex_peek(lexer), "expected the end of the line");
}

bool lex_name(lexer *lexer, const char *what, char name[NAME_SIZE])
{
    const token token = lex_peek(lexer);
    bool good = token.length > 0 && token.length < NAME_SIZE && (isalpha((unsigned char)*token.text) || *token.text == '_');
    for (int i = 0; good && i < token.length; i++)
        good = isalnum((unsigned char)token.text[i]) || token.text[i] == '_';
    if (!good)
        return lex_error(lexer, token, "expected %s: a letter or _, then letters, digits and _, at most %d", what,
                         NAME_SIZE - 1);
    lex_take(lexer);
    memcpy(name, token.text, (size_t)token.length);
    name[token.length] = 0;
    return true;
}

bool lex_parse_uint(token token, uint64_t *value)
{
    char text[32];
    if (token.length == 0 || token.length >= (int)sizeof text || !isdigit((unsigned char)*token.text))
        return false;
    memcpy(text, token.text, (size_t)token.length);
    text[token.length] = 0;
    const bool hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    char *end;
    errno = 0;
    *value = strtoull(text, &end, hex ? 16 : 10);
    return *end == 0 && errno == 0;
}

bool lex_parse_float(token token, float *value)
{
    char text[64];
    if (token.length == 0 || token.length >= (int)sizeof text)
        return false;
    memcpy(text, token.text, (size_t)token.length);
    text[token.length] = 0;
    const char *digits = text + (*text == '-' || *text == '+');
    if (!isdigit((unsigned char)*digits) && *digits != '.')
        return false;
    const bool hex = digits[0] == '0' && (digits[1] == 'x' || digits[1] == 'X');
    if (!strpbrk(text, hex ? ".pP" : ".eE"))
        return false;
    char *end;
    *value = strtof(text, &end);
    return *end == 0 && end != text && *value - *value == 0.0f;
}

bool lex_uint(lexer *lexer, const char *what, uint64_t max, uint64_t *value)
{
    if (!lex_parse_uint(lex_peek(lexer), value) || *value > max)
        return lex_error(lexer, lex_peek(lexer), "expected %s: an integer from 0 to %llu", what, (unsigned long long)max);
    lex_take(lexer);
    return true;
}

// Levenshtein's distance, for "did you mean".
static int edit_distance(const char *a, int a_length, const char *b)
{
    int row[NAME_SIZE + 1];
    const int b_length = (int)strlen(b);
    if (a_length >= NAME_SIZE || b_length >= NAME_SIZE)
        return NAME_SIZE;
    for (int j = 0; j <= b_length; j++)
        row[j] = j;
    for (int i = 1; i <= a_length; i++) {
        int diagonal = row[0];
        row[0] = i;
        for (int j = 1; j <= b_length; j++) {
            const int replace = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            const int insert = (row[j - 1] < row[j] ? row[j - 1] : row[j]) + 1;
            row[j] = replace < insert ? replace : insert;
        }
    }
    return row[b_length];
}

bool lex_lookup(lexer *lexer, const char *what, const char *const *names, int count, int *index)
{
    const token token = lex_peek(lexer);
    int best = -1, best_distance = 4;
    for (int i = 0; i < count; i++) {
        if (lex_is(token, names[i])) {
            lex_take(lexer);
            *index = i;
            return true;
        }
        const int distance = edit_distance(token.text, token.length, names[i]);
        if (distance < best_distance && 2 * distance <= token.length) {
            best = i;
            best_distance = distance;
        }
    }
    if (best >= 0)
        return lex_error(lexer, token, "there is no %s '%.*s'; did you mean '%s'?", what, token.length, token.text,
                         names[best]);
    char accepted[384] = "";
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        if (used + NAME_SIZE + 8 > sizeof accepted) {
            snprintf(accepted + used, sizeof accepted - used, ", ...");
            break;
        }
        used += (size_t)snprintf(accepted + used, sizeof accepted - used, "%s%s", i ? ", " : "", names[i]);
    }
    return lex_error(lexer, token, "expected a%s %s: %s", strchr("aeiou", *what) ? "n" : "", what,
                     count ? accepted : "none is declared yet");
}
