// The words of the sampling options in, a sampling out: what no word says is as by default.
#include "sampling_words.h"

#include <string.h>

sampling_words sampling_words_default(void)
{
    const sampling s = sampling_default();
    return (sampling_words){.every = s.period / s.window, .window = s.window, .seed = s.seed};
}

bool sampling_words_take(const char *option, const char *value, sampling_words *words)
{
    words->given = true;
    if (strcmp(option, "sample-every") == 0)
        return command_uint(option, value, SAMPLE_EVERY_LEAST, SAMPLE_EVERY_MOST, &words->every);
    if (strcmp(option, "sample-window") == 0)
        return command_uint(option, value, SAMPLE_WINDOW_LEAST, SAMPLE_WINDOW_MOST, &words->window);
    return command_uint(option, value, 0, UINT64_MAX, &words->seed);
}

sampling sampling_words_get(const sampling_words *words)
{
    return sampling_of(words->every, words->window, words->seed);
}
