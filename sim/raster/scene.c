// "[class:]FILE" and "[class:]scene:NAME[,key=value...]" to draws. What a scene accepts is scenes.def.
#include "scene_table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool same_text(const char *text, size_t length, const char *word)
{
    return strlen(word) == length && memcmp(text, word, length) == 0;
}

// Says `message` with what would be accepted below it.
static status refuse(const scene_row *scene, const char *key, const char *message, size_t length, const char *text,
                     const report *report)
{
    char *help = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&help, &size);
    if (out) {
        scene_print_help(scene ? scene->name : NULL, key, out);
        fclose(out);
    }
    status result = report_error(report, STATUS_USAGE, "'%.*s' %s%s; accepted:\n%s", (int)length, text, message,
                                 scene ? scene->name : "", help ? help : "");
    free(help);
    return result;
}

// A decimal number of all `length` characters, in the key's range.
static bool parse_number(const scene_key_row *row, const char *text, size_t length, double *number)
{
    char copy[64], *end;
    if (length == 0 || length >= sizeof copy || !strchr("+-.0123456789", text[0]))
        return false;
    memcpy(copy, text, length);
    copy[length] = 0;
    *number = strtod(copy, &end);
    return !*end && *number >= row->low && *number <= row->high && (!row->whole || *number == floor(*number));
}

// One of the key's words; a word that ends in ":" is followed by a number.
static bool parse_word(const scene_key_row *row, const char *text, size_t length, int *index, double *number)
{
    const char *word = row->words;
    for (int i = 0; *word; i++) {
        size_t size = strcspn(word, " ");
        bool takes_number = word[size - 1] == ':';
        *index = i;
        if (takes_number ? length > size && memcmp(text, word, size) == 0
                         : length == size && memcmp(text, word, size) == 0)
            return !takes_number || parse_number(row, text + size, length - size, number);
        word += size + strspn(word + size, " ");
    }
    return false;
}

static status set_key(const scene_row *scene, const char *text, size_t length, bool *given, const report *report,
                      scene_request *request)
{
    const char *equals = memchr(text, '=', length);
    size_t key_length = equals ? (size_t)(equals - text) : length;
    int key = 0;
    while (key < SCENE_KEY_COUNT && (strcmp(scene_key_table[key].scene, scene->name) != 0 ||
                                     !same_text(text, key_length, scene_key_table[key].name)))
        key++;
    if (key == SCENE_KEY_COUNT)
        return refuse(scene, NULL, "is no key of scene:", key_length, text, report);
    if (given[key])
        return report_error(report, STATUS_USAGE, "scene:%s: %s is given twice", scene->name,
                            scene_key_table[key].name);
    given[key] = true;
    const char *value = equals ? equals + 1 : text + length;
    size_t value_length = length - (size_t)(value - text);
    const scene_key_row *row = &scene_key_table[key];
    bool good = row->words
                    ? parse_word(row, value, value_length, &request->values[key].word, &request->values[key].number)
                    : parse_number(row, value, value_length, &request->values[key].number);
    return good ? STATUS_OK : refuse(scene, row->name, "is not what this key takes in scene:", length, text, report);
}

static status add_built_in(const char *text, const draw_class *class, const report *report, model_list *list)
{
    size_t length = strcspn(text, ",");
    int index = 0;
    while (index < SCENE_COUNT && !same_text(text, length, scene_table[index].name))
        index++;
    if (index == SCENE_COUNT)
        return refuse(NULL, NULL, "is no scene", length, text, report);
    const scene_row *scene = &scene_table[index];
    scene_request request = {.has_class = class != NULL, .class = class ? *class : CLASS_TRANSPARENT};
    bool given[SCENE_KEY_COUNT] = {false};
    for (int key = 0; key < SCENE_KEY_COUNT; key++) {
        request.values[key].number = scene_key_table[key].initial;
        request.values[key].word = (int)scene_key_table[key].initial;
    }
    for (text += length; *text; text += length) {
        length = strcspn(++text, ",");
        status result = set_key(scene, text, length, given, report, &request);
        if (result)
            return result;
    }
    return scene->build(&request, report, list);
}

status scene_add(const char *text, const report *report, model_list *list)
{
    draw_class given = CLASS_TRANSPARENT;
    const draw_class *class = NULL;
    for (int i = 0; i < CLASS_COUNT; i++) {
        size_t length = strlen(draw_class_names[i]);
        if (strncmp(text, draw_class_names[i], length) == 0 && text[length] == ':') {
            given = (draw_class)i;
            class = &given;
            text += length + 1;
            break;
        }
    }
    if (strncmp(text, "scene:", 6) == 0)
        return add_built_in(text + 6, class, report, list);
    mesh *mesh;
    status result = mesh_load(text, report, &mesh);
    if (result)
        return result;
    const char *slash = strrchr(text, '/');
    return model_add(list, slash ? slash + 1 : text, given, mesh, report, NULL);
}
