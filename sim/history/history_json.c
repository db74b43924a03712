// The walk in, one JSON object out, a line a fragment or step: written as the walk goes, so that memory does not grow
// with the number of passes. docs/history.md lists the keys.
#include "history.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <string.h>

static json_t *number(double value)
{
    if (isfinite(value))
        return json_real(value);
    return json_string(isnan(value) ? "nan" : value > 0 ? "inf" : "-inf");  // JSON has no such numbers
}

static json_t *count(uint64_t value)
{
    return json_integer((json_int_t)value);
}

// Names in a trace may be any bytes; JSON is UTF-8.
static json_t *name_or_null(const char *name)
{
    json_t *string = name ? json_string(name) : NULL;
    return string ? string : json_null();
}

static double as_double(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return (double)value;
}

static json_t *floats(const uint32_t *words, int length)
{
    json_t *array = json_array();
    for (int c = 0; c < length; c++)
        json_array_append_new(array, number(as_double(words[c])));
    return array;
}

static json_t *value_object(const history *h, const named_value *value)
{
    const uint32_t word = value->words[0];
    switch (format_table[value->format].class) {
    case FORMAT_CLASS_DEPTH:
        return json_pack("{s:o, s:o}", "depth",
                         number(format_code_to_depth(value->format, word, h->info->reversed_depth)), "code",
                         count(word));
    case FORMAT_CLASS_UINT: return count(word);
    case FORMAT_CLASS_FLOAT: return number(as_double(word));
    case FORMAT_CLASS_COLOR: return floats(value->words, 4);
    }
    return json_null();
}

static void put(json_writer *w, json_t *object)
{
    json_dumpf(object, w->out, JSON_REAL_PRECISION(17));
    json_decref(object);
}

// A step's object in the array of steps; the writer keeps no more of it than a comma.
static void put_step(json_writer *w, json_t *object)
{
    fputs(w->steps ? ",\n  " : "\n  ", w->out);
    w->steps = true;
    put(w, object);
}

static json_t *iterations(const history *h)
{
    json_t *array = json_array();
    for (int i = 0; i < h->nest; i++)
        json_array_append_new(array, count(h->iterations[i]));
    return array;
}

static json_t *change(const history *h, const named_value *before, const named_value *after)
{
    return json_pack("{s:s, s:s, s:o, s:o}", "plane", after->name, "format", format_table[after->format].name, "before",
                     value_object(h, before), "after", value_object(h, after));
}

static json_t *plane_change(const history *h, int plane)
{
    const named_value before = value_of_plane(h, plane, h->before[plane]),
                      after = value_of_plane(h, plane, h->planes[plane]);
    return change(h, &before, &after);
}

static json_t *fragment_object(const history *h, uint64_t i)
{
    const sample_fragment *f = &h->fragments[i];
    const trace_draw *draw = &h->info->draws[f->draw];
    json_t *rgba = json_array();
    for (int c = 0; c < 4; c++)
        json_array_append_new(rgba, number((double)f->input.rgba[c]));
    return json_pack("{s:o, s:o, s:s, s:o, s:o, s:o}", "number", count(i + 1), "draw", name_or_null(draw->name),
                     "class", draw_class_names[draw->class], "primitive", count(f->input.primitive), "depth",
                     number(f->input.depth), "rgba", rgba);
}

static void begin(void *user, const history *h)
{
    json_writer *w = user;
    json_t *head = json_pack("{s:s, s:s, s:s, s:s, s:o, s:s, s:o, s:o, s:o}", "version", ROPSIM_VERSION, "program",
                             h->program->name, "machine", h->machine, "machine_hash", h->run->machine_hash, "trace",
                             name_or_null(h->options->trace_name), "trace_hash", h->run->trace_hash, "x", count(h->x),
                             "y", count(h->y), "sample", count(h->sample));
    fputc('{', w->out);
    json_dumpf(head, w->out, JSON_EMBED);
    json_decref(head);
    fputs(",\n \"fragments\": [", w->out);
    for (uint64_t i = 0; i < h->fragment_count; i++) {
        fputs(i ? ",\n  " : "\n  ", w->out);
        put(w, fragment_object(h, i));
    }
    fputs("],\n \"steps\": [", w->out);
}

static void transfer(void *user, const history *h, const step *step)
{
    static const char *const names[] = {
        [STEP_CLEAR] = "clear", [STEP_COPY] = "copy", [STEP_SWAP] = "swap", [STEP_RESET] = "reset"};
    json_t *object =
        json_pack("{s:s, s:i, s:o}", "step", names[step->kind], "line", step->line, "iteration", iterations(h));
    if (step->kind == STEP_RESET) {
        json_object_set_new(object, "query", json_string(h->program->queries[step->query].name));
    } else {
        json_t *planes = json_array();
        json_array_append_new(planes, plane_change(h, step->plane));
        if (step->kind == STEP_SWAP && step->source != step->plane)
            json_array_append_new(planes, plane_change(h, step->source));
        if (step->kind == STEP_COPY)
            json_object_set_new(object, "from", json_string(h->program->planes[step->source].name));
        json_object_set_new(object, "planes", planes);
    }
    put_step(user, object);
}

static void pass(void *user, const history *h, const step *step)
{
    json_writer *w = user;
    const bool fullscreen = step->kind == STEP_FULLSCREEN, list = step->kind == STEP_LIST;
    fputs(w->steps ? ",\n  " : "\n  ", w->out);
    w->steps = true;
    w->fragments = false;
    fprintf(w->out, "{\"step\": \"%s\", \"line\": %d, ",
            fullscreen    ? "fullscreen"
            : !list       ? "draw"
            : h->blending ? "list_blend"
                          : "list",
            step->line);
    if (!fullscreen)
        fprintf(w->out, "\"class\": \"%s\", ", value_classes(step->classes));
    if (list)
        fprintf(w->out, "\"entries\": %u, \"into\": \"%s\", \"blend\": \"%s\"", step->entries,
                h->program->planes[step->plane].name, h->program->blends[step->kernel].name);
    else
        fprintf(w->out, "\"kernel\": \"%s\"", h->program->kernels[step->kernel].name);
    if (fullscreen || step->classes != DRAW_OPAQUE)
        fprintf(w->out, ", \"pass\": %" PRIu64, h->pass);
    fputs(", \"iteration\": ", w->out);
    put(w, iterations(h));
    fputs(", \"fragments\": [", w->out);
}

static json_t *side(const history *h, const named_value *value)
{
    return json_pack("{s:s, s:o}", "name", value->name, "value", value_object(h, value));
}

static json_t *event_object(const history *h, const event *event)
{
    static const char *const names[] = {
        [EVENT_KEEP] = "keep",   [EVENT_CLIP] = "clip",           [EVENT_STENCIL] = "stencil",
        [EVENT_DEPTH] = "depth", [EVENT_COMPARE] = "compare",     [EVENT_WRITE] = "write",
        [EVENT_COUNT] = "count", [EVENT_COMPOSITE] = "composite", [EVENT_LIST] = "list",
    };
    json_t *object = json_pack("{s:s}", "event", names[event->kind]);
    if (event->kind == EVENT_COUNT)
        json_object_set_new(object, "query", json_string(h->program->queries[event->query].name));
    else if (event->kind == EVENT_WRITE)
        json_object_update_new(object, change(h, &event->left, &event->right));
    else if (event->kind != EVENT_COMPOSITE) {
        if (event->kind != EVENT_KEEP && event->kind != EVENT_LIST)
            json_object_set_new(object, "relation", json_string(event->relation));
        if (*event->relation && strlen(event->relation) <= 2) {
            json_object_set_new(object, "left", side(h, &event->left));
            json_object_set_new(object, "right", side(h, &event->right));
        }
        json_object_set_new(object, "holds", json_boolean(event->holds));
    }
    return object;
}

static void fragment(void *user, const history *h, uint64_t index)
{
    json_writer *w = user;
    json_t *events = json_array();
    for (int i = 0; i < h->event_count; i++)
        json_array_append_new(events, event_object(h, &h->events[i]));
    fputs(w->fragments ? ",\n    " : "\n    ", w->out);
    w->fragments = true;
    put(w, json_pack("{s:o, s:o}", "number", index == UINT64_MAX ? json_null() : count(index + 1), "events", events));
}

static void pass_end(void *user, const history *h, const step *step)
{
    json_writer *w = user;
    (void)step;
    fputs("],\n   \"planes\": ", w->out);
    json_t *planes = json_array();
    for (int p = 0; p < h->program->plane_count; p++)
        json_array_append_new(planes, plane_change(h, p));
    put(w, planes);
    fputc('}', w->out);
}

static void condition(void *user, const history *h, const step *step, const condition_result *result)
{
    put_step(user, json_pack("{s:s, s:i, s:o, s:s, s:o, s:o, s:b}", "step", step->kind == STEP_WHILE ? "while" : "if",
                             "line", step->line, "iteration", iterations(h), "query",
                             h->program->queries[step->query].name, "count_here", count(h->queries[step->query]),
                             "count", count(result->count), "holds", result->holds));
}

static void end(void *user, const history *h)
{
    json_writer *w = user;
    float rgb[3];
    uint32_t words[3];
    value_output(h, rgb);
    memcpy(words, rgb, sizeof words);
    fputs("],\n \"planes\": ", w->out);
    json_t *planes = json_array();
    for (int p = 0; p < h->program->plane_count; p++) {
        const named_value value = value_of_plane(h, p, h->planes[p]);
        json_array_append_new(planes, json_pack("{s:s, s:s, s:o}", "plane", value.name, "format",
                                                format_table[value.format].name, "value", value_object(h, &value)));
    }
    put(w, planes);
    fputs(",\n \"rgb\": ", w->out);
    put(w, floats(words, 3));
    fputs("}\n", w->out);
}

sink history_json_sink(json_writer *writer)
{
    return (sink){writer, begin, NULL, NULL, transfer, pass, fragment, pass_end, condition, end};
}
