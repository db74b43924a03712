// A sweep file as words with their places, checked for form alone; sweep_plan.c finds what the words name.
#ifndef ROPSIM_SWEEP_FILE_H
#define ROPSIM_SWEEP_FILE_H

#include "../sweeps.h"

typedef enum sweep_key {
#define SWEEP_KEY(key, kind, required, what) KEY_##key,
#include "sweep_keys.def"
#undef SWEEP_KEY
    SWEEP_KEY_COUNT
} sweep_key;

typedef struct sweep_word {
    char *text;
    size_t line, column;  // from 1
} sweep_word;

typedef struct sweep_list {
    sweep_word *words;
    int count;
} sweep_list;

enum { SWEEP_SETTINGS_MAX = 64, SWEEP_VALUES_MAX = 1024 };

// One machine key and what it is set to, ranges written out; every value is one that the key takes.
typedef struct sweep_setting {
    sweep_word key;
    sweep_list values;
} sweep_setting;

// A level of detail of a sweep; of `sampled` there may be several.
enum { SWEEP_LEVELS_MAX = 64 };
typedef struct sweep_level {
    detail_level level;
    sampling sampling;     // of the level sampled
    char name[NAME_SIZE];  // its one name in databases and tables
} sweep_level;

typedef struct sweep_file {
    char *path;
    sweep_list lists[SWEEP_KEY_COUNT];  // of a WORD or NUMBER: one word; empty where an optional key is missing
    sweep_setting settings[SWEEP_SETTINGS_MAX];
    int setting_count;
    sweep_level details[SWEEP_LEVELS_MAX];
    int detail_count;
    int threads;
    uint64_t max_iterations;
} sweep_file;

// Every error is said as file:line:column. Free with sweep_file_free, also after a failure.
status sweep_file_read(const char *path, const report *report, sweep_file *file);
void sweep_file_free(sweep_file *file);

// A report that puts the place of a word before what is said of it.
typedef struct sweep_place {
    const report *to;
    const char *path;
    const sweep_word *word;
    report report;
} sweep_place;
void sweep_place_start(sweep_place *place, const report *report, const char *path, const sweep_word *word);

// LOW..HIGH, LOW..HIGH+STEP and LOW..HIGH*FACTOR (sweep_range.c).
typedef struct sweep_range {
    int64_t low, high, by;
    bool by_factor;
} sweep_range;
// Whether a word is meant as a range. If so, `why` is empty, or says what is wrong with it.
enum { SWEEP_WHY_SIZE = 1024 };
bool sweep_range_read(const char *text, sweep_range *range, char why[SWEEP_WHY_SIZE]);
int64_t sweep_range_next(const sweep_range *range, int64_t number);

// A word of the key `detail` (sweep_level.c). False: `why` says what may stand there.
bool sweep_read_level(const char *word, sweep_level *level, char why[SWEEP_WHY_SIZE]);

// Appends a copy of a word; false: out of memory.
bool sweep_list_add(sweep_list *list, const char *text, size_t line, size_t column);
void sweep_list_free(sweep_list *list);

#endif
