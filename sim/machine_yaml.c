// A machine file to a machine: one YAML mapping from every key of params.def to its value.
//
// libyaml parses; this file walks its events and is strict where YAML is lax: every key exactly once, plain
// scalars only, no anchors, aliases or tags, one document. Values stay text until param_read, so YAML's own
// ideas of numbers and booleans (yes, 0o17, 1_000) never come into play.
#include "machine_yaml.h"
#include "machine_params.h"

#include <errno.h>
#include <string.h>
#include <yaml.h>

enum { FILE_SIZE_MAX = 65536, KEYS_MAX = 256 };

typedef struct yaml_reader {
    yaml_parser_t parser;
    const char *path;
    const report *report;
    machine *machine;
    status status;
    int line_of_key[KEYS_MAX];  // 0: not seen yet
} yaml_reader;

static void refuse_at(yaml_reader *reader, yaml_mark_t mark, const char *why)
{
    reader->status = report_error(reader->report, STATUS_REFUSED, "%s:%zu:%zu: %s", reader->path, mark.line + 1,
                                  mark.column + 1, why);
}

static bool next_event(yaml_reader *reader, yaml_event_t *event)
{
    if (yaml_parser_parse(&reader->parser, event))
        return true;
    const yaml_parser_t *parser = &reader->parser;
    yaml_mark_t mark = parser->problem_mark;
    refuse_at(reader, mark, parser->problem ? parser->problem : "this is not YAML");
    return false;
}

static bool is_plain(const yaml_event_t *event)
{
    return event->type == YAML_SCALAR_EVENT && event->data.scalar.style == YAML_PLAIN_SCALAR_STYLE &&
           !event->data.scalar.anchor && !event->data.scalar.tag &&
           strlen((const char *)event->data.scalar.value) == event->data.scalar.length;
}

static const char *scalar_text(const yaml_event_t *event)
{
    return (const char *)event->data.scalar.value;
}

// Reads and drops what is left of a value whose first event was taken, so that later keys are still checked.
static bool skip_value(yaml_reader *reader, yaml_event_type_t first)
{
    int depth = first == YAML_MAPPING_START_EVENT || first == YAML_SEQUENCE_START_EVENT;
    while (depth > 0) {
        yaml_event_t event;
        if (!next_event(reader, &event))
            return false;
        depth += event.type == YAML_MAPPING_START_EVENT || event.type == YAML_SEQUENCE_START_EVENT;
        depth -= event.type == YAML_MAPPING_END_EVENT || event.type == YAML_SEQUENCE_END_EVENT;
        yaml_event_delete(&event);
    }
    return true;
}

// The elements of a SET, after its sequence start.
static bool read_elements(yaml_reader *reader, const param_row *row)
{
    param_empty(row, reader->machine);
    for (;;) {
        yaml_event_t event;
        char why[PARAM_TEXT_SIZE];
        if (!next_event(reader, &event))
            return false;
        yaml_event_type_t type = event.type;
        if (type == YAML_SEQUENCE_END_EVENT) {
            yaml_event_delete(&event);
            return true;
        }
        if (!is_plain(&event)) {
            snprintf(why, sizeof why, "an element of %s must be a plain word", row->key);
            refuse_at(reader, event.start_mark, why);
        } else if (!param_add(row, scalar_text(&event), reader->machine, why)) {
            refuse_at(reader, event.start_mark, why);
        }
        yaml_event_delete(&event);
        if (!skip_value(reader, type))
            return false;
    }
}

// The value of a key; row NULL: the key was refused, and the value is passed over. False: the file cannot
// be read on.
static bool read_value(yaml_reader *reader, const param_row *row)
{
    yaml_event_t event;
    char why[PARAM_TEXT_SIZE];
    if (!next_event(reader, &event))
        return false;
    yaml_event_type_t type = event.type;
    bool in_set = row && row->kind == PARAM_KIND_SET && type == YAML_SEQUENCE_START_EVENT &&
                  !event.data.sequence_start.anchor && !event.data.sequence_start.tag;
    if (row && !in_set) {
        if (!is_plain(&event)) {
            char accepted[PARAM_TEXT_SIZE];
            param_accepted(row, accepted);
            snprintf(why, sizeof why, "%s must be %.800s, written plain: no quotes, tags or anchors", row->key,
                     accepted);
            refuse_at(reader, event.start_mark, why);
        } else if (!param_read(row, scalar_text(&event), reader->machine, why)) {
            refuse_at(reader, event.start_mark, why);
        }
    }
    yaml_event_delete(&event);
    return in_set ? read_elements(reader, row) : skip_value(reader, type);
}

// The row that a key event names, or NULL after an error.
static const param_row *read_key(yaml_reader *reader, const yaml_event_t *event)
{
    char why[PARAM_TEXT_SIZE];
    if (!is_plain(event)) {
        refuse_at(reader, event->start_mark, "a key must be a plain word");
        return NULL;
    }
    const char *key = scalar_text(event);
    const param_row *row = param_find(key);
    if (!row) {
        const char *meant = param_nearest(key);
        snprintf(why, sizeof why, "unknown key `%.60s`%s%s%s", key,
                 meant ? "; did you mean `" : "; `ropsim machine --keys` lists all", meant ? meant : "",
                 meant ? "`?" : "");
        refuse_at(reader, event->start_mark, why);
        return NULL;
    }
    int *line = &reader->line_of_key[row - param_rows];
    if (*line) {
        snprintf(why, sizeof why, "%s is set a second time; the first is in line %d", key, *line);
        refuse_at(reader, event->start_mark, why);
        return NULL;
    }
    *line = (int)event->start_mark.line + 1;
    return row;
}

static void refuse_missing(yaml_reader *reader, yaml_mark_t end)
{
    for (int i = 0; i < param_count; i++) {
        if (reader->line_of_key[i])
            continue;
        char accepted[PARAM_TEXT_SIZE], why[PARAM_TEXT_SIZE + 128];
        param_accepted(&param_rows[i], accepted);
        snprintf(why, sizeof why, "missing key %s: %s", param_rows[i].key, accepted);
        refuse_at(reader, end, why);
    }
}

static void read_mapping(yaml_reader *reader)
{
    for (;;) {
        yaml_event_t event;
        if (!next_event(reader, &event))
            return;
        if (event.type == YAML_MAPPING_END_EVENT) {
            refuse_missing(reader, event.start_mark);
            yaml_event_delete(&event);
            return;
        }
        yaml_event_type_t type = event.type;
        const param_row *row = read_key(reader, &event);
        yaml_event_delete(&event);
        // A key that is itself a list or mapping is passed over whole, as its value is.
        if (!skip_value(reader, type) || !read_value(reader, row))
            return;
    }
}

// Takes one event of the wanted type.
static bool expect(yaml_reader *reader, yaml_event_type_t wanted, const char *why)
{
    yaml_event_t event;
    if (!next_event(reader, &event))
        return false;
    bool good = event.type == wanted;
    if (!good)
        refuse_at(reader, event.start_mark, why);
    yaml_event_delete(&event);
    return good;
}

static void read_stream(yaml_reader *reader)
{
    const char *one_mapping = "a machine file is one mapping of keys to values";
    if (!expect(reader, YAML_STREAM_START_EVENT, one_mapping) ||
        !expect(reader, YAML_DOCUMENT_START_EVENT, one_mapping) ||
        !expect(reader, YAML_MAPPING_START_EVENT, one_mapping))
        return;
    read_mapping(reader);
    if (reader->status == STATUS_OK && expect(reader, YAML_DOCUMENT_END_EVENT, one_mapping))
        expect(reader, YAML_STREAM_END_EVENT, "a machine file holds one document");
}

status machine_read_yaml(const char *path, const report *report, machine *machine)
{
    unsigned char text[FILE_SIZE_MAX + 1];
    FILE *file = fopen(path, "rb");
    if (!file)
        return report_error(report, STATUS_IO, "%s: cannot be opened: %s", path, strerror(errno));
    size_t size = fread(text, 1, sizeof text, file);
    bool failed = ferror(file) != 0;
    fclose(file);
    if (failed)
        return report_error(report, STATUS_IO, "%s: cannot be read", path);
    if (size > FILE_SIZE_MAX)
        return report_error(report, STATUS_REFUSED, "%s: a machine file has at most %d bytes", path, FILE_SIZE_MAX);
    yaml_reader reader = {.path = path, .report = report, .machine = machine};
    if (!yaml_parser_initialize(&reader.parser))
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    yaml_parser_set_input_string(&reader.parser, text, size);
    read_stream(&reader);
    yaml_parser_delete(&reader.parser);
    return reader.status;
}
