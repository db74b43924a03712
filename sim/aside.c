// A result file that is either whole or not there: written under another name, renamed when it is done.
#include "sim.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct aside {
    FILE *file;
    char *path, *temporary;
    const report *report;
};

status aside_create(const char *path, const report *report, aside **aside)
{
    enum { EXTRA = 32 };
    size_t size = strlen(path) + EXTRA;
    *aside = NULL;
    struct stat existing;
    // The rename would put a file in a device's place; a folder defends itself.
    if (stat(path, &existing) == 0 && !S_ISREG(existing.st_mode) && !S_ISDIR(existing.st_mode))
        return report_error(report, STATUS_IO, "%s: is not a regular file and is not replaced", path);
    struct aside *new = calloc(1, sizeof *new);
    char *temporary = malloc(size), *copy = strdup(path);
    if (!new || !temporary || !copy) {
        free(new);
        free(temporary);
        free(copy);
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    }
    // The process's number keeps two runs apart that write the same result.
    snprintf(temporary, size, "%s.part-%ld", path, (long)getpid());
    *new = (struct aside){.path = copy, .temporary = temporary, .report = report};
    *aside = new;
    return STATUS_OK;
}

status aside_open(const char *path, const report *report, aside **aside, FILE **file)
{
    *file = NULL;
    status result = aside_create(path, report, aside);
    if (result != STATUS_OK)
        return result;
    *file = (*aside)->file = fopen((*aside)->temporary, "wb");
    if (*file)
        return STATUS_OK;
    result = report_error(report, STATUS_IO, "%s: cannot be written: %s", path, strerror(errno));
    aside_discard(*aside);
    *aside = NULL;
    return result;
}

const char *aside_path(const aside *aside)
{
    return aside->temporary;
}

static void aside_free(aside *aside)
{
    free(aside->path);
    free(aside->temporary);
    free(aside);
}

void aside_discard(aside *aside)
{
    if (!aside)
        return;
    if (aside->file)
        fclose(aside->file);
    unlink(aside->temporary);
    aside_free(aside);
}

status aside_finish(aside *aside)
{
    bool written = true;
    if (aside->file) {
        written = !ferror(aside->file);
        written = fclose(aside->file) == 0 && written;
        aside->file = NULL;
    }
    if (written && rename(aside->temporary, aside->path) == 0) {
        aside_free(aside);
        return STATUS_OK;
    }
    status result = report_error(aside->report, STATUS_IO, "%s: cannot be written: %s", aside->path, strerror(errno));
    aside_discard(aside);
    return result;
}
