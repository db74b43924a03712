// A report that keeps what was said, for tests that check messages.
#ifndef ROPSIM_TEST_MESSAGES_H
#define ROPSIM_TEST_MESSAGES_H

#include "../../sim/sim.h"

#include <string.h>

typedef struct messages {
    char text[16384];
    int count;
    report report;
} messages;

static inline void messages_keep(void *user, severity severity, const char *text)
{
    messages *kept = user;
    size_t length = strlen(kept->text);
    (void)severity;
    kept->count++;
    snprintf(kept->text + length, sizeof kept->text - length, "%s\n", text);
}

static inline void messages_start(messages *kept)
{
    kept->count = 0;
    kept->text[0] = 0;
    kept->report = (report){.say = messages_keep, .user = kept};
}

#endif
