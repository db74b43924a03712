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

bool sweep_read_level(const char *word, detail_level *level, char why[SWEEP_WHY_SIZE])
{
    char list[NAME_SIZE * DETAIL_COUNT] = "";
    for (int i = 0; i < DETAIL_COUNT; i++) {
        const size_t length = strlen(list);
        *level = (detail_level)i;
        if (strcmp(word, detail_level_names[i]) == 0)
            return true;
        snprintf(list + length, sizeof list - length, "%s%s",
                 i == 0                 ? ""
                 : i + 1 < DETAIL_COUNT ? ", "
                                        : " or ",
                 detail_level_names[i]);
    }
    const char *meant = nearest_word(word, detail_level_names, DETAIL_COUNT);
    snprintf(why, SWEEP_WHY_SIZE, "detail is `%.60s`, but must be %s%s%s%s", word, list,
             meant ? "; did you mean `" : "", meant ? meant : "", meant ? "`?" : "");
    return false;
}
