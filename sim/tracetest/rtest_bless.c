// Expected figures replaced by those seen, in place: comments, layout and bounds (<=, <, >=, >) stay as they are.
#include "rtest.h"

#include <stdlib.h>
#include <string.h>

void rtest_print_line(const rtest_text *text, int line, FILE *out)
{
    const char *at = text->bytes;
    for (int i = 1; i < line && at; i++) {
        at = strchr(at, '\n');
        at = at ? at + 1 : NULL;
    }
    if (!at)
        return;
    at += strspn(at, " \t");
    fprintf(out, "%.*s", (int)strcspn(at, "\r\n"), at);
}

static int by_place(const void *a, const void *b)
{
    const rtest_blessing *x = a, *y = b;
    return x->word.at < y->word.at ? -1 : x->word.at > y->word.at;
}

// A figure that is right already keeps its spelling: 0.5 stays 0.5, far stays far.
static bool is_same_figure(const rtest_blessing *blessing)
{
    const char *word = blessing->word.text;
    if (strcmp(word, "near") == 0 || strcmp(word, "far") == 0)
        return strtod(blessing->seen, NULL) == (word[0] == 'f');
    if (blessing->rounded)
        return (float)strtod(word, NULL) == (float)strtod(blessing->seen, NULL);
    return strcmp(word, blessing->seen) == 0;
}

static bool is_wanted(const rtest_blessing *blessing)
{
    return blessing->failed && !blessing->contradicted && !is_same_figure(blessing);
}

status rtest_bless(const rtest_text *text, rtest_result *result, const report *report)
{
    aside *aside = NULL;
    FILE *file = NULL;
    size_t at = 0;
    result->blessed = 0;
    for (int i = 0; i < result->blessing_count; i++)
        result->blessed += is_wanted(&result->blessings[i]);
    if (result->blessed == 0)
        return STATUS_OK;
    const status status = aside_open(text->path, report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    qsort(result->blessings, (size_t)result->blessing_count, sizeof *result->blessings, by_place);
    for (int i = 0; i < result->blessing_count; i++) {
        const rtest_blessing *blessing = &result->blessings[i];
        if (!is_wanted(blessing))
            continue;
        fwrite(text->bytes + at, 1, blessing->word.at - at, file);
        fputs(blessing->seen, file);
        at = blessing->word.at + (size_t)blessing->word.length;
    }
    fwrite(text->bytes + at, 1, text->size - at, file);
    return aside_finish(aside);
}
