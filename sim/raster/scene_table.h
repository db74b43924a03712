// scenes.def as data: what scene.c parses by and what help and messages print.
#ifndef ROPSIM_SCENE_TABLE_H
#define ROPSIM_SCENE_TABLE_H

#include "raster.h"

typedef struct scene_row {
    const char *name, *summary;
    status (*build)(const scene_request *request, const report *report, model_list *list);
} scene_row;

typedef struct scene_key_row {
    const char *scene, *name;
    bool whole;
    const char *words;          // NULL: a number
    double initial, low, high;  // initial of a word: its index
    const char *meaning;
} scene_key_row;

enum {
#define SCENE(name, summary) SCENE_##name,
#define SCENE_NUMBER(scene, key, whole, initial, low, high, meaning)
#define SCENE_WORD(scene, key, words, initial, low, high, meaning)
#include "scenes.def"
#undef SCENE
#undef SCENE_NUMBER
#undef SCENE_WORD
    SCENE_COUNT
};

extern const scene_row scene_table[SCENE_COUNT];
extern const scene_key_row scene_key_table[SCENE_KEY_COUNT];

#endif
