// PLY: the header is parsed and every element walked, so that counts are true to the last list.
#include "mesh_check.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ELEMENTS_MAX = 16, PROPERTIES_MAX = 64, WORDS_MAX = 5 };

typedef enum ply_form { PLY_ASCII, PLY_LITTLE, PLY_BIG } ply_form;

typedef struct property {
    int bytes;        // of a value, in binary
    int count_bytes;  // of a list's length; 0: no list
    bool count_signed;
} property;

typedef struct element {
    bool is_vertex, is_face;
    bool has_corners;  // a list of vertex numbers
    int coordinates;   // how many of x, y, z
    uint64_t count;
    property properties[PROPERTIES_MAX];
    int property_count;
} element;

typedef struct ply {
    const mesh_bytes *file;
    ply_form form;
    bool has_form;
    element elements[ELEMENTS_MAX];
    int element_count;
    size_t at;  // next byte
} ply;

typedef struct word {
    const char *text;
    size_t size;
} word;

static bool is_word(word word, const char *text)
{
    return word.size == strlen(text) && memcmp(word.text, text, word.size) == 0;
}

// The words of the line at `at`, which moves behind it. -1 at the end of the file and where it is no text; more
// words than asked for are counted, not kept.
static int next_line(ply *ply, word words[WORDS_MAX])
{
    const char *text = (const char *)ply->file->data, *end = text + ply->file->size, *at = text + ply->at;
    const char *line_end = at < end ? memchr(at, '\n', (size_t)(end - at)) : NULL;
    if (!line_end)
        return -1;
    ply->at = (size_t)(line_end + 1 - text);
    int count = 0;
    for (const char *c = at; c < line_end; c++)
        if (iscntrl((unsigned char)*c) && !isspace((unsigned char)*c))
            return -1;
    while (at < line_end) {
        while (at < line_end && isspace((unsigned char)*at))
            at++;
        const char *start = at;
        while (at < line_end && !isspace((unsigned char)*at))
            at++;
        if (at > start && count++ < WORDS_MAX)
            words[count - 1] = (word){start, (size_t)(at - start)};
    }
    return count;
}

// Bytes of a type; 0 if it is none. Floats are negative.
static int type_bytes(word type, bool *is_signed)
{
    static const struct {
        const char *name;
        int bytes;
        bool is_signed;
    } types[] = {
        {"char", 1, true},   {"int8", 1, true},     {"uchar", 1, false},  {"uint8", 1, false},
        {"short", 2, true},  {"int16", 2, true},    {"ushort", 2, false}, {"uint16", 2, false},
        {"int", 4, true},    {"int32", 4, true},    {"uint", 4, false},   {"uint32", 4, false},
        {"float", -4, true}, {"float32", -4, true}, {"double", -8, true}, {"float64", -8, true},
    };
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (is_word(type, types[i].name)) {
            *is_signed = types[i].is_signed;
            return types[i].bytes;
        }
    }
    return 0;
}

static status refuse(const ply *ply, const char *reason)
{
    return report_error(ply->file->report, STATUS_REFUSED, "%s: byte %zu: %s", ply->file->path, ply->at, reason);
}

static status add_element(ply *ply, const word words[WORDS_MAX], int count)
{
    if (count != 3 || words[2].size > 10 || ply->element_count == ELEMENTS_MAX)
        return refuse(ply, "this is not `element NAME COUNT`, or one element too many");
    element *element = &ply->elements[ply->element_count++];
    for (size_t i = 0; i < words[2].size; i++) {
        if (!isdigit((unsigned char)words[2].text[i]))
            return refuse(ply, "this count is not a number");
        element->count = element->count * 10 + (uint64_t)(words[2].text[i] - '0');
    }
    if (element->count > ply->file->size)
        return refuse(ply, "more elements are announced than the file has bytes");
    element->is_vertex = is_word(words[1], "vertex");
    element->is_face = is_word(words[1], "face");
    return STATUS_OK;
}

static status add_property(ply *ply, const word words[WORDS_MAX], int count)
{
    element *element = ply->element_count ? &ply->elements[ply->element_count - 1] : NULL;
    bool list = count == 5 && is_word(words[1], "list");
    if (!element || element->property_count == PROPERTIES_MAX || (count != 3 && !list))
        return refuse(ply, "this is not `property TYPE NAME` of an element, or one property too many");
    property *property = &element->properties[element->property_count++];
    bool is_signed = false;
    int bytes = type_bytes(words[list ? 3 : 1], &is_signed);
    property->bytes = abs(bytes);
    if (list)
        property->count_bytes = type_bytes(words[2], &property->count_signed);
    if (!bytes || (list && property->count_bytes <= 0))
        return refuse(ply, "a type that PLY has not, or a list with a length that is no integer");
    word name = words[list ? 4 : 2];
    if (list)
        element->has_corners =
            element->has_corners || (bytes > 0 && (is_word(name, "vertex_indices") || is_word(name, "vertex_index")));
    else
        element->coordinates += is_word(name, "x") || is_word(name, "y") || is_word(name, "z");
    return STATUS_OK;
}

static status read_header(ply *ply)
{
    word words[WORDS_MAX];
    if (next_line(ply, words) != 1 || !is_word(words[0], "ply"))
        return refuse(ply, "a PLY file begins with a line `ply`");
    for (;;) {
        int count = next_line(ply, words);
        status result = STATUS_OK;
        if (count < 0)
            return refuse(ply, "the header has no end_header, or is not text");
        if (count == 1 && is_word(words[0], "end_header"))
            return STATUS_OK;
        if (count == 0 || is_word(words[0], "comment") || is_word(words[0], "obj_info"))
            continue;
        if (is_word(words[0], "element")) {
            result = add_element(ply, words, count);
        } else if (is_word(words[0], "property")) {
            result = add_property(ply, words, count);
        } else if (count == 3 && is_word(words[0], "format") && is_word(words[2], "1.0")) {
            ply->has_form = true;
            ply->form = is_word(words[1], "ascii")               ? PLY_ASCII
                        : is_word(words[1], "binary_big_endian") ? PLY_BIG
                                                                 : PLY_LITTLE;
            if (ply->form == PLY_LITTLE && !is_word(words[1], "binary_little_endian"))
                return refuse(ply, "a format that is not ascii, binary_little_endian or binary_big_endian");
        } else {
            return refuse(ply, "a header line that PLY has not");
        }
        if (result)
            return result;
    }
}

// A number as text; *value is its integer, or -1 if it is none. False if there is no number.
static bool take_text(ply *ply, int64_t *value)
{
    const unsigned char *data = ply->file->data;
    size_t size = ply->file->size, length = 0;
    char word[64];
    while (ply->at < size && isspace(data[ply->at]))
        ply->at++;
    for (; ply->at < size && !isspace(data[ply->at]) && length < sizeof word - 1; ply->at++)
        word[length++] = (char)data[ply->at];
    word[length] = 0;
    char *rest;
    double number = strtod(word, &rest);
    *value = number >= 0 && number < 0x1p40 && strspn(word, "0123456789") == length ? (int64_t)number : -1;
    return length && !*rest && rest == word + length && isfinite(number);
}

static bool take_bytes(ply *ply, int bytes, bool is_signed, int64_t *value)
{
    if (ply->file->size - ply->at < (size_t)bytes)
        return false;
    uint64_t bits = 0;
    for (int i = 0; i < bytes && bytes <= 4; i++) {
        int place = ply->form == PLY_BIG ? bytes - 1 - i : i;
        bits |= (uint64_t)ply->file->data[ply->at + (size_t)i] << (8 * place);
    }
    ply->at += (size_t)bytes;
    *value = is_signed && bits >> (8 * bytes - 1) ? -1 : (int64_t)bits;
    return true;
}

static bool take_value(ply *ply, int bytes, bool is_signed, int64_t *value)
{
    return ply->form == PLY_ASCII ? take_text(ply, value) : take_bytes(ply, bytes, is_signed, value);
}

static status walk_element(ply *ply, const element *element)
{
    for (uint64_t i = 0; i < element->count; i++) {
        for (int p = 0; p < element->property_count; p++) {
            const property *property = &element->properties[p];
            int64_t count = 1, value;
            if (property->count_bytes && !take_value(ply, property->count_bytes, property->count_signed, &count))
                return refuse(ply, "the file ends early, or a number is none");
            if (count < 0 || (uint64_t)count > ply->file->size - ply->at)
                return refuse(ply, "a list is longer than the rest of the file");
            for (int64_t j = 0; j < count; j++)
                if (!take_value(ply, property->bytes, false, &value))
                    return refuse(ply, "the file ends early, or a number is none");
        }
    }
    return STATUS_OK;
}

status mesh_check_ply(const mesh_bytes *file, mesh_promise *promise)
{
    ply ply = {.file = file};
    status result = read_header(&ply);
    if (result)
        return result;
    promise->vertices = promise->faces = 0;
    for (int i = 0; i < ply.element_count; i++) {
        const element *element = &ply.elements[i];
        if ((element->is_vertex && (promise->vertices || element->coordinates != 3)) ||
            (element->is_face && (promise->faces || !element->has_corners)))
            return refuse(&ply, "vertices need x, y and z, faces a list vertex_indices, and each may come once");
        if (element->is_vertex)
            promise->vertices = element->count;
        if (element->is_face)
            promise->faces = element->count;
    }
    if (!ply.has_form || !promise->vertices || !promise->faces)
        return refuse(&ply, "no format, no vertices or no faces");
    for (int i = 0; i < ply.element_count; i++) {
        result = walk_element(&ply, &ply.elements[i]);
        if (result)
            return result;
    }
    return STATUS_OK;
}
