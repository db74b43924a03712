// The image module's functions, by name.
//
// It is never closed: OpenImageIO's own threads and plug-ins would not survive that.
#include "image_module.h"

#include <dlfcn.h>
#include <string.h>

enum { WHY_SIZE = 4096 };

status image_module(const report *report, image_functions *functions)
{
    char why[WHY_SIZE];
    void *module = module_open("ropsim_images.so", why, sizeof why);
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
