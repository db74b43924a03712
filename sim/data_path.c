// Where shipped files lie: programs and machines, of an installation or of the source tree.
//
// Looked up in this order, so that a built command works in place, when installed, and when told:
//   $ROPSIM_DATA/FOLDER, (the command's folder)/../share/ropsim/FOLDER, the source tree that it was built from.
#include "sim.h"

#include <dirent.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

// The folder of the running command, without a slash at its end.
static bool command_folder(char *path, size_t size)
{
    ssize_t length = readlink("/proc/self/exe", path, size - 1);
    if (length <= 0 || (size_t)length >= size - 1)
        return false;
    path[length] = 0;
    char *slash = strrchr(path, '/');
    if (slash)
        *slash = 0;
    return slash != NULL;
}

static bool exists(char *path, size_t size, const char *root, const char *folder, const char *name)
{
    int length = snprintf(path, size, "%s/%s/%s", root, folder, name);
    return length > 0 && (size_t)length < size && access(path, R_OK) == 0;
}

status data_path(const char *folder, const char *name, char *path, size_t size)
{
    char command[PATH_SIZE - 32], installed[PATH_SIZE];
    const char *told = getenv("ROPSIM_DATA");
    if (told && exists(path, size, told, folder, name))
        return STATUS_OK;
    if (command_folder(command, sizeof command)) {
        snprintf(installed, sizeof installed, "%s/../share/ropsim", command);
        if (exists(path, size, installed, folder, name))
            return STATUS_OK;
    }
    if (exists(path, size, ROPSIM_SOURCE_FOLDER, folder, name) ||
        exists(path, size, ROPSIM_SOURCE_FOLDER "/sim", folder, name))
        return STATUS_OK;
    if (size > 0)
        path[0] = 0;
    return STATUS_IO;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(a, b);
}

int data_names(const char *folder, const char *ending, char (*names)[NAME_SIZE], int max)
{
    char path[PATH_SIZE];
    int count = 0;
    if (data_path(folder, "", path, sizeof path) != STATUS_OK)
        return 0;
    DIR *open_folder = opendir(path);
    if (!open_folder)
        return 0;
    for (const struct dirent *entry; count < max && (entry = readdir(open_folder));) {
        size_t length = strlen(entry->d_name), tail = strlen(ending);
        if (length <= tail || length - tail >= NAME_SIZE || strcmp(entry->d_name + length - tail, ending) != 0)
            continue;
        memcpy(names[count], entry->d_name, length - tail);
        names[count++][length - tail] = 0;
    }
    closedir(open_folder);
    qsort(names, (size_t)count, sizeof *names, by_name);
    return count;
}
