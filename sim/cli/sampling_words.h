// The options --sample-every, --sample-window and --seed, which several commands have: rows for their tables, one reader.
#ifndef ROPSIM_SAMPLING_WORDS_H
#define ROPSIM_SAMPLING_WORDS_H

#include "../levels.h"
#include "command.h"

#define SAMPLE_EVERY_ROW {"sample-every", 0, "N", "sampled: measure one stamp in N; default 16"}
#define SAMPLE_WINDOW_ROW {"sample-window", 0, "STAMPS", "sampled: length of a window; default 512"}
#define SEED_ROW {"seed", 0, "N", "sampled: draws the places of windows; default 1"}

typedef struct sampling_words {
    uint64_t every, window, seed;
    bool given;  // any of them was
} sampling_words;

sampling_words sampling_words_default(void);
// Takes the value of the option of that name; false after saying what is wrong with it.
bool sampling_words_take(const char *option, const char *value, sampling_words *words);
sampling sampling_words_get(const sampling_words *words);

#endif
