// "Did you mean": the word of a list that is fewest edits away from what was written.
#include "sim.h"

#include <string.h>

enum { WORD_SIZE = 64 };  // longer words are nobody's typing error

static size_t smallest(size_t a, size_t b, size_t c)
{
    size_t ab = a < b ? a : b;
    return ab < c ? ab : c;
}

// Levenshtein's distance by one row of the table; both words are shorter than WORD_SIZE.
static size_t edit_distance(const char *a, const char *b)
{
    size_t row[WORD_SIZE + 1];
    size_t b_length = strlen(b);
    for (size_t j = 0; j <= b_length; j++)
        row[j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= b_length; j++) {
            size_t changed = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            row[j] = smallest(row[j] + 1, row[j - 1] + 1, changed);
        }
    }
    return row[b_length];
}

const char *nearest_word(const char *word, const char *const *words, size_t count)
{
    const char *nearest = NULL;
    size_t length = strlen(word);
    size_t limit = length / 3 + 1;  // beyond this a guess is more puzzling than none
    if (length == 0 || length >= WORD_SIZE)
        return NULL;
    for (size_t i = 0; i < count; i++) {
        if (strlen(words[i]) >= WORD_SIZE)
            continue;
        size_t distance = edit_distance(word, words[i]);
        if (distance <= limit) {
            nearest = words[i];
            limit = distance - (distance > 0);
            if (distance == 0)
                break;
        }
    }
    return nearest;
}
