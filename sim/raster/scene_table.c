// The rows of scenes.def, and the help text made of them.
#include "scene_table.h"

#include <stdio.h>
#include <string.h>

const scene_row scene_table[SCENE_COUNT] = {
#define SCENE(name, summary) {#name, summary, scene_##name},
#define SCENE_NUMBER(scene, key, whole, initial, low, high, meaning)
#define SCENE_WORD(scene, key, words, initial, low, high, meaning)
#include "scenes.def"
#undef SCENE
#undef SCENE_NUMBER
#undef SCENE_WORD
};

const scene_key_row scene_key_table[SCENE_KEY_COUNT] = {
#define SCENE(name, summary)
#define SCENE_NUMBER(scene, key, whole, initial, low, high, meaning) \
    {#scene, #key, whole, NULL, initial, low, high, meaning},
#define SCENE_WORD(scene, key, words, initial, low, high, meaning) \
    {#scene, #key, true, words, initial, low, high, meaning},
#include "scenes.def"
#undef SCENE
#undef SCENE_NUMBER
#undef SCENE_WORD
};

static void print_key(const scene_key_row *row, FILE *out)
{
    if (row->words)
        fprintf(out, "  %s=%s   (default %.*s; a number after ':' is %.10g to %.10g)  %s\n", row->name, row->words,
                (int)strcspn(row->words, " "), row->words, row->low, row->high, row->meaning);
    else
        fprintf(out, "  %s=%s %.10g to %.10g   (default %.10g)  %s\n", row->name, row->whole ? "integer" : "number",
                row->low, row->high, row->initial, row->meaning);
}

void scene_print_help(const char *scene, const char *key, FILE *out)
{
    for (int i = 0; i < SCENE_COUNT; i++) {
        if (scene && strcmp(scene, scene_table[i].name) != 0)
            continue;
        if (!scene)
            fprintf(out, "scene:%s  %s\n", scene_table[i].name, scene_table[i].summary);
        for (int k = 0; k < SCENE_KEY_COUNT; k++) {
            const scene_key_row *row = &scene_key_table[k];
            if (strcmp(row->scene, scene_table[i].name) == 0 && (!key || strcmp(row->name, key) == 0))
                print_key(row, out);
        }
    }
}

void record_print_scenes(FILE *out)
{
    scene_print_help(NULL, NULL, out);
}
