// Words of a sweep file with their places: kept, freed, and named in messages.
#include "sweep_file.h"

#include <stdlib.h>
#include <string.h>

bool sweep_list_add(sweep_list *list, const char *text, size_t line, size_t column)
{
    sweep_word *grown = realloc(list->words, ((size_t)list->count + 1) * sizeof *grown);
    if (!grown)
        return false;
    list->words = grown;
    char *copy = strdup(text);
    if (!copy)
        return false;
    grown[list->count++] = (sweep_word){copy, line, column};
    return true;
}

void sweep_list_free(sweep_list *list)
{
    for (int i = 0; i < list->count; i++)
        free(list->words[i].text);
    free(list->words);
    *list = (sweep_list){0};
}

static void say_with_place(void *user, severity severity, const char *text)
{
    const sweep_place *place = user;
    if (severity == SEVERITY_WARNING)
        report_warning(place->to, "%s:%zu:%zu: %s", place->path, place->word->line, place->word->column, text);
    else
        report_error(place->to, STATUS_REFUSED, "%s:%zu:%zu: %s", place->path, place->word->line, place->word->column,
                     text);
}

void sweep_place_start(sweep_place *place, const report *report, const char *path, const sweep_word *word)
{
    *place = (sweep_place){.to = report, .path = path, .word = word};
    place->report = (struct report){.say = say_with_place, .user = place};
}
