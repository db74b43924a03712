// Opens a library of ours that costs too much to be linked: by dlopen, from where the command lies.
#include "sim.h"

#include <dlfcn.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };
static const char *const folders[] = {".", "..", "../lib/ropsim"};

void *module_open(const char *name, char *why, size_t why_size)
{
    char command[PATH_SIZE - 128], path[PATH_SIZE];
    snprintf(why, why_size, "/proc/self/exe cannot be read");
    const ssize_t length = readlink("/proc/self/exe", command, sizeof command - 1);
    if (length <= 0)
        return NULL;
    command[length] = 0;
    char *slash = strrchr(command, '/');
    if (slash)
        *slash = 0;
    snprintf(why, why_size, "%s is not beside %s or in its ../lib/ropsim", name, command);
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        snprintf(path, sizeof path, "%s/%s/%s", command, folders[i], name);
        if (access(path, R_OK) != 0)
            continue;
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
        if (!module)
            snprintf(why, why_size, "%s", dlerror());
        return module;
    }
    return NULL;
}
