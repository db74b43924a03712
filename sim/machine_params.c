// Values of machine keys from text and to text, by the rows of params.def.
//
// Numbers are strict: decimal digits, nothing else; 64k, 0x10, 010 and 1e3 are refused, since one reader's
// octal is another's decimal.
#include "machine_params.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { ELEMENT_MAX = 64, NUMBER_DIGITS_MAX = 18 };  // 18 digits always fit an int64_t

const param_row param_rows[] = {
#define PARAM_INT(key, min, max, unit, meaning) \
    {#key, PARAM_KIND_INT, offsetof(machine, key), min, max, unit, 0, NULL, 0, meaning},
#define PARAM_BOOL(key, meaning) {#key, PARAM_KIND_BOOL, offsetof(machine, key), 0, 1, NULL, 0, NULL, 0, meaning},
#define PARAM_FORMAT(key, class, meaning) \
    {#key, PARAM_KIND_FORMAT, offsetof(machine, key), 0, 0, NULL, FORMAT_CLASS_##class, NULL, 0, meaning},
#define PARAM_CHOICE(key, words, meaning) \
    {#key, PARAM_KIND_CHOICE, offsetof(machine, key), 0, 0, NULL, 0, words, 0, meaning},
#define PARAM_SET(key, table, meaning) \
    {#key, PARAM_KIND_SET, offsetof(machine, key), 0, 0, NULL, 0, NULL, PARAM_TABLE_##table, meaning},
#include "params.def"
#undef PARAM_INT
#undef PARAM_BOOL
#undef PARAM_FORMAT
#undef PARAM_CHOICE
#undef PARAM_SET
};
const int param_count = sizeof param_rows / sizeof param_rows[0];

// The words that a FORMAT, CHOICE, BOOL or SET key accepts; `value` is what each stands for.
typedef struct word_list {
    const char *words[ELEMENT_MAX];
    int values[ELEMENT_MAX];
    size_t count;
    char storage[PARAM_TEXT_SIZE];
} word_list;

static void word_list_add(word_list *list, const char *word, int value)
{
    if (list->count < ELEMENT_MAX) {
        list->words[list->count] = word;
        list->values[list->count++] = value;
    }
}

static void list_words(const param_row *row, word_list *list)
{
    list->count = 0;
    if (row->kind == PARAM_KIND_BOOL) {
        word_list_add(list, "false", 0);
        word_list_add(list, "true", 1);
    } else if (row->kind == PARAM_KIND_CHOICE) {
        snprintf(list->storage, sizeof list->storage, "%s", row->words);
        char *rest = NULL;
        int value = 0;
        for (char *word = strtok_r(list->storage, " ", &rest); word; word = strtok_r(NULL, " ", &rest))
            word_list_add(list, word, value++);
    } else if (row->kind == PARAM_KIND_SET && row->table == PARAM_TABLE_opcodes) {
        for (int i = 0; i < OPCODE_COUNT; i++)
            word_list_add(list, opcode_table[i].name, i);
    } else {
        for (int i = 0; i < FORMAT_COUNT; i++) {
            if (row->kind == PARAM_KIND_SET || format_table[i].class == row->class)
                word_list_add(list, format_table[i].name, i);
        }
    }
}

static void append(char text[PARAM_TEXT_SIZE], const char *more)
{
    size_t length = strlen(text);
    snprintf(text + length, PARAM_TEXT_SIZE - length, "%s", more);
}

static bool refuse(const param_row *row, const char *text, const word_list *list, char why[PARAM_TEXT_SIZE])
{
    char accepted[PARAM_TEXT_SIZE];
    param_accepted(row, accepted);
    snprintf(why, PARAM_TEXT_SIZE, "%s is `%.60s`, but must be %.800s", row->key, text, accepted);
    const char *meant = list ? nearest_word(text, list->words, list->count) : NULL;
    if (meant) {
        append(why, "; did you mean `");
        append(why, meant);
        append(why, "`?");
    }
    return false;
}

static bool find_word(const param_row *row, const char *text, int *value, char why[PARAM_TEXT_SIZE])
{
    word_list list;
    list_words(row, &list);
    for (size_t i = 0; i < list.count; i++) {
        if (strcmp(list.words[i], text) == 0) {
            *value = list.values[i];
            return true;
        }
    }
    return refuse(row, text, &list, why);
}

static bool read_int(const param_row *row, const char *text, int64_t *value, char why[PARAM_TEXT_SIZE])
{
    const char *digits = text + (*text == '-');
    size_t count = strspn(digits, "0123456789");
    bool octal_looking = count > 1 && digits[0] == '0';
    if (count == 0 || count > NUMBER_DIGITS_MAX || digits[count] || octal_looking)
        return refuse(row, text, NULL, why);
    int64_t number = strtoll(text, NULL, 10);
    if (number < row->min || number > row->max)
        return refuse(row, text, NULL, why);
    *value = number;
    return true;
}

static void *field(const param_row *row, machine *machine)
{
    return (char *)machine + row->offset;
}

static const void *const_field(const param_row *row, const machine *machine)
{
    return (const char *)machine + row->offset;
}

void param_empty(const param_row *row, machine *machine)
{
    *(uint32_t *)field(row, machine) = 0;
}

bool param_add(const param_row *row, const char *element, machine *machine, char why[PARAM_TEXT_SIZE])
{
    int bit = 0;
    if (!find_word(row, element, &bit, why))
        return false;
    uint32_t *set = field(row, machine);
    if (*set >> bit & 1) {
        snprintf(why, PARAM_TEXT_SIZE, "%s lists `%s` twice", row->key, element);
        return false;
    }
    *set |= UINT32_C(1) << bit;
    return true;
}

// Every row of the table: what `all` stands for.
static uint32_t full_set(const param_row *row)
{
    int count = row->table == PARAM_TABLE_opcodes ? (int)OPCODE_COUNT : (int)FORMAT_COUNT;
    return count >= 32 ? UINT32_MAX : (UINT32_C(1) << count) - 1;
}

static bool read_set(const param_row *row, const char *text, machine *machine, char why[PARAM_TEXT_SIZE])
{
    uint32_t *set = field(row, machine);
    if (strcmp(text, "all") == 0) {
        *set = full_set(row);
        return true;
    }
    char copy[PARAM_TEXT_SIZE];
    size_t length = strlen(text);
    if (length == 0 || length >= sizeof copy)
        return refuse(row, text, NULL, why);
    bool bracketed = text[0] == '[' && text[length - 1] == ']';
    snprintf(copy, sizeof copy, "%.*s", (int)(length - 2 * bracketed), text + bracketed);
    uint32_t before = *set;
    *set = 0;
    char *rest = NULL;
    for (char *word = strtok_r(copy, ", ", &rest); word; word = strtok_r(NULL, ", ", &rest)) {
        if (!param_add(row, word, machine, why)) {
            *set = before;
            return false;
        }
    }
    return true;
}

bool param_read(const param_row *row, const char *text, machine *machine, char why[PARAM_TEXT_SIZE])
{
    int value = 0;
    switch (row->kind) {
    case PARAM_KIND_INT: return read_int(row, text, field(row, machine), why);
    case PARAM_KIND_SET: return read_set(row, text, machine, why);
    case PARAM_KIND_BOOL:
        if (!find_word(row, text, &value, why))
            return false;
        *(bool *)field(row, machine) = value != 0;
        return true;
    case PARAM_KIND_FORMAT:
        if (!find_word(row, text, &value, why))
            return false;
        *(format *)field(row, machine) = (format)value;
        return true;
    case PARAM_KIND_CHOICE: break;
    }
    if (!find_word(row, text, &value, why))
        return false;
    *(int *)field(row, machine) = value;
    return true;
}

static void write_set(const param_row *row, uint32_t set, char text[PARAM_TEXT_SIZE])
{
    if (set == full_set(row)) {
        snprintf(text, PARAM_TEXT_SIZE, "all");
        return;
    }
    word_list list;
    list_words(row, &list);
    const char *separator = "[";
    text[0] = 0;
    for (size_t i = 0; i < list.count; i++) {
        if (set >> list.values[i] & 1) {
            append(text, separator);
            append(text, list.words[i]);
            separator = ", ";
        }
    }
    append(text, set ? "]" : "[]");
}

void param_write(const param_row *row, const machine *machine, char text[PARAM_TEXT_SIZE])
{
    const void *value = const_field(row, machine);
    word_list list;
    list_words(row, &list);
    switch (row->kind) {
    case PARAM_KIND_INT: snprintf(text, PARAM_TEXT_SIZE, "%lld", (long long)*(const int64_t *)value); break;
    case PARAM_KIND_BOOL: snprintf(text, PARAM_TEXT_SIZE, "%s", *(const bool *)value ? "true" : "false"); break;
    case PARAM_KIND_FORMAT: snprintf(text, PARAM_TEXT_SIZE, "%s", format_table[*(const format *)value].name); break;
    case PARAM_KIND_CHOICE: snprintf(text, PARAM_TEXT_SIZE, "%s", list.words[*(const int *)value]); break;
    case PARAM_KIND_SET: write_set(row, *(const uint32_t *)value, text); break;
    }
}

void param_accepted(const param_row *row, char text[PARAM_TEXT_SIZE])
{
    if (row->kind == PARAM_KIND_INT) {
        snprintf(text, PARAM_TEXT_SIZE, "an integer from %lld to %lld (%s)", (long long)row->min, (long long)row->max,
                 row->unit);
        return;
    }
    word_list list;
    list_words(row, &list);
    snprintf(text, PARAM_TEXT_SIZE, "%s", row->kind == PARAM_KIND_SET ? "`all` or a list of " : "");
    for (size_t i = 0; i < list.count; i++) {
        append(text, i == 0 ? "" : i + 1 < list.count ? ", " : row->kind == PARAM_KIND_SET ? " and " : " or ");
        append(text, list.words[i]);
    }
}

const param_row *param_find(const char *key)
{
    for (int i = 0; i < param_count; i++) {
        if (strcmp(param_rows[i].key, key) == 0)
            return &param_rows[i];
    }
    return NULL;
}

const char *param_nearest(const char *key)
{
    const char *keys[sizeof param_rows / sizeof param_rows[0]];
    for (int i = 0; i < param_count; i++)
        keys[i] = param_rows[i].key;
    return nearest_word(key, keys, (size_t)param_count);
}
