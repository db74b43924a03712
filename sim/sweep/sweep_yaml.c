// A sweep file to words: one YAML mapping with the keys of sweep_keys.def.
//
// libyaml parses; this file walks its events and is strict where YAML is lax, as for machine files: each key once, no
// anchors, aliases or tags, one document, no list in a list. Words may be quoted, since paths may need it; what a word
// means is decided from its text alone, so YAML's own ideas of numbers and booleans never come into play.
#include "sweep_file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

enum { FILE_SIZE_MAX = 65536, THREADS_MAX = 1024 };
typedef enum key_kind { KIND_WORD, KIND_NUMBER, KIND_LIST, KIND_MAP } key_kind;

static const struct {
    const char *key;
    key_kind kind;
    bool required;
    const char *what;
} key_rows[] = {
#define SWEEP_KEY(key, kind, required, what) {#key, KIND_##kind, required, what},
#include "sweep_keys.def"
#undef SWEEP_KEY
};

typedef struct yaml_reader {
    yaml_parser_t parser;
    const report *report;
    sweep_file *file;
    status status;
    bool seen[SWEEP_KEY_COUNT];
} yaml_reader;

static void refuse_at(yaml_reader *reader, yaml_mark_t mark, const char *why)
{
    reader->status = report_error(reader->report, STATUS_REFUSED, "%s:%zu:%zu: %s", reader->file->path, mark.line + 1,
                                  mark.column + 1, why);
}

static bool refuse_memory(yaml_reader *reader)
{
    reader->status = report_error(reader->report, STATUS_IO, "%s: out of memory", reader->file->path);
    return false;
}

static bool next_event(yaml_reader *reader, yaml_event_t *event)
{
    if (yaml_parser_parse(&reader->parser, event))
        return true;
    const yaml_parser_t *parser = &reader->parser;
    refuse_at(reader, parser->problem_mark, parser->problem ? parser->problem : "this is not YAML");
    return false;
}

static const char *event_text(const yaml_event_t *event)
{
    return (const char *)event->data.scalar.value;
}

static bool is_word(const yaml_event_t *event)
{
    return event->type == YAML_SCALAR_EVENT && !event->data.scalar.anchor && !event->data.scalar.tag &&
           event->data.scalar.style != YAML_LITERAL_SCALAR_STYLE &&
           event->data.scalar.style != YAML_FOLDED_SCALAR_STYLE && event->data.scalar.length > 0 &&
           strlen(event_text(event)) == event->data.scalar.length;
}

// Takes the event as a word of the list, or says what is wanted.
static bool take_word(yaml_reader *reader, const yaml_event_t *event, const char *key, const char *what,
                      sweep_list *list)
{
    if (!is_word(event)) {
        char why[SWEEP_WHY_SIZE];
        snprintf(why, sizeof why, "%.60s wants words without tags or anchors: %s", key, what);
        refuse_at(reader, event->start_mark, why);
        return false;
    }
    if (!sweep_list_add(list, event_text(event), event->start_mark.line + 1, event->start_mark.column + 1))
        return refuse_memory(reader);
    return true;
}

// A word, or a list of at least one if the key takes lists. False: the file is not read on.
static bool read_words(yaml_reader *reader, const char *key, const char *what, bool lists, sweep_list *list)
{
    yaml_event_t event;
    if (!next_event(reader, &event))
        return false;
    const bool in_list = lists && event.type == YAML_SEQUENCE_START_EVENT && !event.data.sequence_start.anchor &&
                         !event.data.sequence_start.tag;
    bool good = in_list || take_word(reader, &event, key, what, list);
    const yaml_mark_t mark = event.start_mark;
    yaml_event_delete(&event);
    while (good && in_list) {
        if (!next_event(reader, &event))
            return false;
        const bool end = event.type == YAML_SEQUENCE_END_EVENT;
        good = end || take_word(reader, &event, key, what, list);
        yaml_event_delete(&event);
        if (end)
            break;
    }
    if (good && list->count == 0) {
        char why[SWEEP_WHY_SIZE];
        snprintf(why, sizeof why, "%.60s is an empty list; it wants %s", key, what);
        refuse_at(reader, mark, why);
        return false;
    }
    return good;
}

// Checks a value against its key as --set does, and keeps it.
static bool add_value(yaml_reader *reader, sweep_setting *setting, const sweep_word *word, const char *value)
{
    sweep_place place;
    machine scratch = {0};
    char assignment[2 * SWEEP_WHY_SIZE];
    sweep_place_start(&place, reader->report, reader->file->path, word);
    if (snprintf(assignment, sizeof assignment, "%s=%s", setting->key.text, value) >= (int)sizeof assignment) {
        reader->status = report_error(&place.report, STATUS_REFUSED, "the value is too long");
        return false;
    }
    if (machine_set(&scratch, assignment, &place.report) != STATUS_OK) {
        reader->status = STATUS_REFUSED;
        return false;
    }
    if (setting->values.count == SWEEP_VALUES_MAX) {
        reader->status = report_error(&place.report, STATUS_REFUSED, "%s is given more than %d values",
                                      setting->key.text, SWEEP_VALUES_MAX);
        return false;
    }
    for (int i = 0; i < setting->values.count; i++) {
        if (strcmp(setting->values.words[i].text, value) == 0) {
            reader->status =
                report_error(&place.report, STATUS_REFUSED, "%s is given %s a second time", setting->key.text, value);
            return false;
        }
    }
    return sweep_list_add(&setting->values, value, word->line, word->column) || refuse_memory(reader);
}

static bool expand_value(yaml_reader *reader, sweep_setting *setting, const sweep_word *word)
{
    char why[SWEEP_WHY_SIZE];
    sweep_range range;
    if (!sweep_range_read(word->text, &range, why))
        return add_value(reader, setting, word, word->text);
    if (why[0]) {
        sweep_place place;
        sweep_place_start(&place, reader->report, reader->file->path, word);
        reader->status = report_error(&place.report, STATUS_REFUSED, "%s", why);
        return false;
    }
    for (int64_t number = range.low; number <= range.high; number = sweep_range_next(&range, number)) {
        char value[32];
        snprintf(value, sizeof value, "%lld", (long long)number);
        if (!add_value(reader, setting, word, value))
            return false;
    }
    return true;
}

// One machine key, whose name was taken, and its values.
static bool read_setting(yaml_reader *reader, const yaml_event_t *event)
{
    sweep_file *file = reader->file;
    sweep_list name = {0}, words = {0};
    if (!take_word(reader, event, "set", key_rows[KEY_set].what, &name))
        return false;
    bool good = true;
    for (int i = 0; i < file->setting_count && good; i++) {
        if (strcmp(file->settings[i].key.text, name.words[0].text) == 0) {
            refuse_at(reader, event->start_mark, "this machine key is set a second time");
            good = false;
        }
    }
    if (good && file->setting_count == SWEEP_SETTINGS_MAX) {
        refuse_at(reader, event->start_mark, "a sweep sets at most 64 machine keys");
        good = false;
    }
    if (good) {
        sweep_setting *setting = &file->settings[file->setting_count++];
        setting->key = name.words[0];
        free(name.words);
        name = (sweep_list){0};
        good = read_words(reader, setting->key.text, key_rows[KEY_set].what, true, &words);
        for (int i = 0; good && i < words.count; i++)
            good = expand_value(reader, setting, &words.words[i]);
    }
    sweep_list_free(&name);
    sweep_list_free(&words);
    return good;
}

static bool read_settings(yaml_reader *reader)
{
    yaml_event_t event;
    if (!next_event(reader, &event))
        return false;
    bool good =
        event.type == YAML_MAPPING_START_EVENT && !event.data.mapping_start.anchor && !event.data.mapping_start.tag;
    if (!good)
        refuse_at(reader, event.start_mark, "set is a map of machine keys to values, lists or ranges");
    yaml_event_delete(&event);
    while (good) {
        if (!next_event(reader, &event))
            return false;
        const bool end = event.type == YAML_MAPPING_END_EVENT;
        good = end || read_setting(reader, &event);
        yaml_event_delete(&event);
        if (end)
            break;
    }
    return good;
}

// The row that a key event names, or -1 after an error.
static int read_key(yaml_reader *reader, const yaml_event_t *event)
{
    char why[SWEEP_WHY_SIZE];
    const char *names[SWEEP_KEY_COUNT];
    if (!is_word(event)) {
        refuse_at(reader, event->start_mark, "a key must be a word");
        return -1;
    }
    const char *key = event_text(event);
    for (int i = 0; i < SWEEP_KEY_COUNT; i++) {
        names[i] = key_rows[i].key;
        if (strcmp(key, names[i]) != 0)
            continue;
        if (!reader->seen[i]) {
            reader->seen[i] = true;
            return i;
        }
        snprintf(why, sizeof why, "%s stands here a second time", key);
        refuse_at(reader, event->start_mark, why);
        return -1;
    }
    const char *meant = nearest_word(key, names, SWEEP_KEY_COUNT);
    snprintf(why, sizeof why,
             "unknown key `%.60s`%s%s%s; a sweep has results, traces, programs, machines, set, detail, threads,"
             " max_iterations",
             key, meant ? "; did you mean `" : "", meant ? meant : "", meant ? "`?" : "");
    refuse_at(reader, event->start_mark, why);
    return -1;
}

// An integer of 0 to `most`, if the key is there.
static bool read_number(yaml_reader *reader, sweep_key key, uint64_t most, uint64_t *number)
{
    const sweep_list *list = &reader->file->lists[key];
    if (list->count == 0)
        return true;
    const sweep_word *word = &list->words[0];
    char *end;
    errno = 0;
    const unsigned long long value = strtoull(word->text, &end, 10);
    if (strspn(word->text, "0123456789") == strlen(word->text) && errno == 0 && value <= most) {
        *number = value;
        return true;
    }
    sweep_place place;
    sweep_place_start(&place, reader->report, reader->file->path, word);
    reader->status = report_error(&place.report, STATUS_REFUSED, "%s is `%s`, but must be an integer from 0 to %llu",
                                  key_rows[key].key, word->text, (unsigned long long)most);
    return false;
}

// Words to levels, each once.
static void read_details(yaml_reader *reader)
{
    sweep_file *file = reader->file;
    const sweep_list *list = &file->lists[KEY_detail];
    if (list->count == 0)
        sweep_read_level(detail_level_names[DETAIL_FUNCTION], &file->details[file->detail_count++], (char[SWEEP_WHY_SIZE]){0});
    for (int i = 0; i < list->count; i++) {
        char why[SWEEP_WHY_SIZE] = "";
        sweep_level level;
        sweep_read_level(list->words[i].text, &level, why);
        if (file->detail_count == SWEEP_LEVELS_MAX)
            snprintf(why, sizeof why, "detail has more than %d levels", SWEEP_LEVELS_MAX);
        for (int k = 0; k < file->detail_count && !why[0]; k++) {
            if (strcmp(file->details[k].name, level.name) == 0)
                snprintf(why, sizeof why, "detail is given %s a second time", level.name);
        }
        if (why[0]) {
            sweep_place place;
            sweep_place_start(&place, reader->report, file->path, &list->words[i]);
            reader->status = report_error(&place.report, STATUS_REFUSED, "%s", why);
            return;
        }
        file->details[file->detail_count++] = level;
    }
}

static void finish_mapping(yaml_reader *reader, yaml_mark_t end)
{
    uint64_t threads = 1;
    for (int i = 0; i < SWEEP_KEY_COUNT; i++) {
        if (key_rows[i].required && !reader->seen[i]) {
            char why[SWEEP_WHY_SIZE];
            snprintf(why, sizeof why, "missing key %s: %s", key_rows[i].key, key_rows[i].what);
            refuse_at(reader, end, why);
        }
    }
    if (read_number(reader, KEY_threads, THREADS_MAX, &threads))
        read_number(reader, KEY_max_iterations, INT64_MAX, &reader->file->max_iterations);
    reader->file->threads = (int)threads;
    if (reader->status == STATUS_OK)
        read_details(reader);
}

static bool read_mapping(yaml_reader *reader)
{
    for (;;) {
        yaml_event_t event;
        if (!next_event(reader, &event))
            return false;
        const bool end = event.type == YAML_MAPPING_END_EVENT;
        const int row = end ? -1 : read_key(reader, &event);
        const yaml_mark_t mark = event.start_mark;
        yaml_event_delete(&event);
        if (end) {
            finish_mapping(reader, mark);
            return reader->status == STATUS_OK;
        }
        if (row < 0)
            return false;
        const key_kind kind = key_rows[row].kind;
        if (kind == KIND_MAP ? !read_settings(reader)
                             : !read_words(reader, key_rows[row].key, key_rows[row].what, kind == KIND_LIST,
                                           &reader->file->lists[row]))
            return false;
    }
}

// Takes one event of the wanted type.
static bool expect(yaml_reader *reader, yaml_event_type_t wanted, const char *why)
{
    yaml_event_t event;
    if (!next_event(reader, &event))
        return false;
    const bool good = event.type == wanted;
    if (!good)
        refuse_at(reader, event.start_mark, why);
    yaml_event_delete(&event);
    return good;
}

status sweep_file_read(const char *path, const report *report, sweep_file *file)
{
    unsigned char text[FILE_SIZE_MAX + 1];
    *file = (sweep_file){.path = strdup(path)};
    if (!file->path)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    FILE *in = fopen(path, "rb");
    if (!in)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    const size_t size = fread(text, 1, sizeof text, in);
    const bool failed = ferror(in) != 0;
    fclose(in);
    if (failed)
        return report_error(report, STATUS_IO, "%s: cannot be read", path);
    if (size > FILE_SIZE_MAX)
        return report_error(report, STATUS_REFUSED, "%s: a sweep file has at most %d bytes", path, FILE_SIZE_MAX);
    yaml_reader reader = {.report = report, .file = file};
    if (!yaml_parser_initialize(&reader.parser))
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    yaml_parser_set_input_string(&reader.parser, text, size);
    const char *one_mapping = "a sweep file is one mapping: results, traces, programs, machines, and perhaps set";
    if (expect(&reader, YAML_STREAM_START_EVENT, one_mapping) &&
        expect(&reader, YAML_DOCUMENT_START_EVENT, one_mapping) &&
        expect(&reader, YAML_MAPPING_START_EVENT, one_mapping) && read_mapping(&reader) &&
        expect(&reader, YAML_DOCUMENT_END_EVENT, one_mapping))
        expect(&reader, YAML_STREAM_END_EVENT, "a sweep file holds one document");
    yaml_parser_delete(&reader.parser);
    return reader.status;
}

void sweep_file_free(sweep_file *file)
{
    for (int i = 0; i < SWEEP_KEY_COUNT; i++)
        sweep_list_free(&file->lists[i]);
    for (int i = 0; i < file->setting_count; i++) {
        free(file->settings[i].key.text);
        sweep_list_free(&file->settings[i].values);
    }
    free(file->path);
    *file = (sweep_file){0};
}
