// Opens the image module (module/images.h) when it is first needed.
#ifndef ROPSIM_IMAGE_MODULE_H
#define ROPSIM_IMAGE_MODULE_H

#include "../sim.h"
#include "module/images.h"

// Fills `functions`; STATUS_IO with the reason if the module is not where the command expects it. Calling it
// again is cheap: the loader keeps what is open.
status image_module(const report *report, image_functions *functions);

#endif
