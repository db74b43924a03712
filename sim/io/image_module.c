// The image module by dlopen: next to the command, a folder above (test programs lie one deeper in a build
// folder), or in the installation's lib/ropsim.
//
// The module is never closed: OpenImageIO's own threads and plug-ins do not survive it, and the loader counts
// opens, so nothing has to be remembered here.
#include "image_module.h"

#include <dlfcn.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };
static const char module_name[] = "ropsim_images.so";
static const char *const folders[] = {".", "..", "../lib/ropsim"};

static void *open_module(char why[PATH_SIZE])
{
    char command[PATH_SIZE - 64], path[PATH_SIZE];
    snprintf(why, PATH_SIZE, "/proc/self/exe cannot be read");
    ssize_t length = readlink("/proc/self/exe", command, sizeof command - 1);
    if (length <= 0)
        return NULL;
    command[length] = 0;
    char *slash = strrchr(command, '/');
    if (slash)
        *slash = 0;
    snprintf(why, PATH_SIZE, "%s is not beside %s or in its ../lib/ropsim", module_name, command);
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        snprintf(path, sizeof path, "%s/%s/%s", command, folders[i], module_name);
        if (access(path, R_OK) != 0)
            continue;
        void *module = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
        if (!module)
            snprintf(why, PATH_SIZE, "%s", dlerror());
        return module;
    }
    return NULL;
}

status image_module(const report *report, image_functions *functions)
{
    char why[PATH_SIZE];
    void *module = open_module(why);
    if (!module)
        return report_error(report, STATUS_IO, "the image module cannot be opened: %s", why);
    void *symbol;
// POSIX's dlsym hands out functions as void *; copying the bytes is the conversion that ISO C lacks.
#define MODULE_FUNCTION(name, parameters) \
    symbol = dlsym(module, "ropsim_module_" #name); \
    if (!symbol) \
        return report_error(report, STATUS_IO, "the image module is of another version: it has no " #name); \
    memcpy(&functions->name, &symbol, sizeof symbol);
#include "module/functions.def"
#undef MODULE_FUNCTION
    return STATUS_OK;
}
