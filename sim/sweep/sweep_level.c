// Words of the key `detail` in, levels out: `cycle`, or `sampled,every=64,window=1024,seed=2`.
//
// What is as by default is left out of a level's name, and the rest stands in one order: so databases know a run again, however it was
// written.
#include "sweep_file.h"

#include <ctype.h>
#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { PARTS = 3 };

// What may stand behind `sampled`: its name, what it may be, and what it is.
typedef struct part {
    const char *name;
    uint64_t least, most, standard, value;
    bool given;
} part;

static const char *read_name(const char *word, detail_level *level, char why[SWEEP_WHY_SIZE])
{
    char list[NAME_SIZE * DETAIL_COUNT] = "", name[NAME_SIZE];
    const size_t end = strcspn(word, ",");
    snprintf(name, sizeof name, "%.*s", (int)end, word);
    for (int i = 0; i < DETAIL_COUNT; i++) {
        const size_t length = strlen(list);
        *level = (detail_level)i;
        if (strcmp(name, detail_level_names[i]) == 0)
            return word + end;
        snprintf(list + length, sizeof list - length, "%s%s", i == 0 ? "" : i + 1 < DETAIL_COUNT ? ", " : " or ", detail_level_names[i]);
    }
    const char *meant = nearest_word(name, detail_level_names, DETAIL_COUNT);
    snprintf(why, SWEEP_WHY_SIZE, "detail is `%.60s`, but must be %s%s%s%s", word, list, meant ? "; did you mean `" : "", meant ? meant : "",
             meant ? "`?" : "");
    return NULL;
}

// Reads ",NAME=NUMBER" at *at, and goes on behind it.
static bool read_part(const char **at, part parts[PARTS])
{
    const char *name = *at + 1, *value = name + strcspn(name, "=,");
    char *end = NULL;
    for (part *p = parts; p < parts + PARTS; p++) {
        if (strlen(p->name) != (size_t)(value - name) || strncmp(p->name, name, strlen(p->name)) != 0 || p->given || *value != '=' ||
            !isdigit((unsigned char)value[1]))
            continue;
        errno = 0;
        p->value = strtoull(value + 1, &end, 10);
        p->given = true;
        *at = end;
        return (*end == ',' || !*end) && !errno && p->value >= p->least && p->value <= p->most;
    }
    return false;
}

static bool read_parts(const char *word, const char *at, part parts[PARTS], char why[SWEEP_WHY_SIZE])
{
    while (*at)
        if (!read_part(&at, parts)) {
            snprintf(why, SWEEP_WHY_SIZE,
                     "detail is `%.100s`, but behind `sampled` may stand, once each: `,every=N` from %" PRIu64 " to %" PRIu64
                     ", `,window=STAMPS` from %" PRIu64 " to %" PRIu64 ", `,seed=N`",
                     word, parts[0].least, parts[0].most, parts[1].least, parts[1].most);
            return false;
        }
    return true;
}

bool sweep_read_level(const char *word, sweep_level *level, char why[SWEEP_WHY_SIZE])
{
    const sampling s = sampling_default();
    part parts[PARTS] = {{.name = "every", .least = SAMPLE_EVERY_LEAST, .most = SAMPLE_EVERY_MOST, .standard = s.period / s.window},
                         {.name = "window", .least = SAMPLE_WINDOW_LEAST, .most = SAMPLE_WINDOW_MOST, .standard = s.window},
                         {.name = "seed", .most = UINT64_MAX, .standard = s.seed}};
    *level = (sweep_level){0};
    const char *behind = read_name(word, &level->level, why);
    if (!behind)
        return false;
    if (*behind && level->level != DETAIL_SAMPLED) {
        snprintf(why, SWEEP_WHY_SIZE, "detail is `%.60s`, but only `sampled` takes more than its name", word);
        return false;
    }
    if (!read_parts(word, behind, parts, why))
        return false;
    int length = snprintf(level->name, sizeof level->name, "%s", detail_level_names[level->level]);
    for (part *p = parts; p < parts + PARTS; p++) {
        p->value = p->given ? p->value : p->standard;
        if (p->value != p->standard)
            length += snprintf(level->name + length, sizeof level->name - (size_t)length, ",%s=%" PRIu64, p->name, p->value);
    }
    level->sampling = sampling_of(parts[0].value, parts[1].value, parts[2].value);
    return true;
}
