// Paths in, test files out: a file as it is, a folder with all *.rtest below it, sorted by name.
#include "rtest.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum { FOLDERS_DEEP_MAX = 32 };

typedef struct finder {
    char ***files;
    int *count;
    const report *report;
} finder;

static status add(const finder *f, char *path)
{
    char **file = path ? rtest_add(f->files, f->count, sizeof *file) : NULL;
    if (!file) {
        free(path);
        return report_error(f->report, STATUS_IO, "out of memory");
    }
    *file = path;
    return STATUS_OK;
}

static bool is_test(const char *name)
{
    const char *ending = strrchr(name, '.');
    return ending && strcmp(ending, ".rtest") == 0;
}

static char *join(const char *folder, const char *name)
{
    char *path = NULL;
    const size_t length = strlen(folder);
    const bool slash = length > 0 && folder[length - 1] == '/';
    const size_t size = length + strlen(name) + 2;
    path = malloc(size);
    if (path)
        snprintf(path, size, "%s%s%s", folder, slash ? "" : "/", name);
    return path;
}

static status search(const finder *f, const char *folder, int deep)
{
    struct dirent **entries = NULL;
    const int count = scandir(folder, &entries, NULL, alphasort);
    if (count < 0)
        return report_error(f->report, STATUS_IO, "%s: cannot be searched: %s", folder, strerror(errno));
    status status = STATUS_OK;
    for (int i = 0; i < count; i++) {
        struct stat about;
        char *path = entries[i]->d_name[0] == '.' ? NULL : join(folder, entries[i]->d_name);
        const bool there = path && status == STATUS_OK && stat(path, &about) == 0;
        if (there && S_ISDIR(about.st_mode) && deep < FOLDERS_DEEP_MAX)
            status = search(f, path, deep + 1);
        if (there && S_ISREG(about.st_mode) && is_test(path)) {
            status = add(f, path);
            path = NULL;
        }
        free(path);
        free(entries[i]);
    }
    free(entries);
    return status;
}

status rtest_find(const char *const *paths, int path_count, const report *report, char ***files, int *file_count)
{
    const finder f = {files, file_count, report};
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < path_count; i++) {
        struct stat about;
        const int before = *file_count;
        if (stat(paths[i], &about) != 0)
            status = report_error(report, STATUS_IO, "%s: cannot be opened: %s", paths[i], strerror(errno));
        else if (S_ISDIR(about.st_mode))
            status = search(&f, paths[i], 0);
        else
            status = add(&f, strdup(paths[i]));
        if (status == STATUS_OK && *file_count == before)
            status = report_error(report, STATUS_REFUSED, "%s: holds no file that ends in .rtest", paths[i]);
    }
    return status;
}
