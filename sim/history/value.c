// Values of planes and operands, with what they are called and how they are shown.
#include "history.h"

#include <stdlib.h>
#include <string.h>

static float as_float(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

event *event_add(history *h, event_kind kind)
{
    event *event = &h->events[h->event_count++];
    memset(event, 0, sizeof *event);
    event->kind = kind;
    event->relation = "";
    return event;
}

named_value value_named(const char *name, format format, uint32_t word)
{
    named_value value = {.format = format, .words = {word}};
    snprintf(value.name, sizeof value.name, "%s", name);
    return value;
}

named_value value_of_plane(const history *h, int plane, const uint32_t words[4])
{
    named_value value = {.format = bound_plane_format(h->bound, plane)};
    snprintf(value.name, sizeof value.name, "%s", h->program->planes[plane].name);
    memcpy(value.words, words, sizeof value.words);
    return value;
}

bool value_same(const named_value *a, const named_value *b)
{
    return memcmp(a->words, b->words, sizeof a->words) == 0;
}

enum { NUMBER_SIZE = 24 };

// The fewest digits that give the same float back.
static const char *shortest(uint32_t bits, char text[NUMBER_SIZE])
{
    const float value = as_float(bits);
    for (int digits = 6; digits <= 9; digits++) {
        snprintf(text, NUMBER_SIZE, "%.*g", digits, (double)value);
        if (strtof(text, NULL) == value)
            break;
    }
    return text;
}

void value_text(const history *h, const named_value *value, char text[VALUE_TEXT_SIZE])
{
    const uint32_t *words = value->words;
    const bool reversed = h->info->reversed_depth;
    char number[NUMBER_SIZE];
    switch (format_table[value->format].class) {
    case FORMAT_CLASS_DEPTH:
        // A float's code is the value itself; of others, and of 1 - z, digits alone do not tell neighbours apart.
        if (value->format == FORMAT_z32f && !reversed)
            snprintf(text, VALUE_TEXT_SIZE, "%s", shortest(words[0], number));
        else
            snprintf(text, VALUE_TEXT_SIZE, "%.6g (%u)", format_code_to_depth(value->format, words[0], reversed),
                     words[0]);
        return;
    case FORMAT_CLASS_UINT: snprintf(text, VALUE_TEXT_SIZE, "%u", words[0]); return;
    case FORMAT_CLASS_FLOAT: snprintf(text, VALUE_TEXT_SIZE, "%s", shortest(words[0], number)); return;
    case FORMAT_CLASS_COLOR:
        snprintf(text, VALUE_TEXT_SIZE, "(%.6g %.6g %.6g %.6g)", (double)as_float(words[0]), (double)as_float(words[1]),
                 (double)as_float(words[2]), (double)as_float(words[3]));
        return;
    }
}

bool value_touched(const history *h, const step *step, int plane)
{
    if (step->kind == STEP_LIST)
        return plane == (h->blending ? step->plane : step->source);
    int count;
    const instruction *code = bound_instructions(h->bound, step->kernel, &count);
    for (int i = 0; i < count; i++) {
        const opcode_row *row = &opcode_table[code[i].op];
        if ((row->d == OPERAND_PLANE && code[i].d == plane) || (row->a == OPERAND_PLANE && code[i].a == plane))
            return true;
    }
    return false;
}

void value_output(const history *h, float rgb[3])
{
    const int front = h->program->output_front, base = h->program->output_base;
    for (int c = 0; c < 3; c++) {
        const float behind = as_float(h->planes[base][c]);
        rgb[c] = front < 0 ? behind : as_float(h->planes[front][c]) + as_float(h->planes[front][3]) * behind;
    }
}

const char *value_classes(int classes)
{
    switch (classes) {
    case DRAW_OPAQUE: return "opaque";
    case DRAW_UNSORTED: return "unsorted";
    case DRAW_SORTED: return "sorted";
    case DRAW_BATCH: return "batch";
    default: return "transparent";
    }
}
