// What the image module offers: the functions of functions.def, found by name after dlopen.
//
// OpenImageIO brings hundreds of shared libraries and a quarter of a second of start-up, so it lives in a
// module that is opened when the first image file is touched; the command itself does not link to it.
// To offer more: a row in functions.def and its definition in a .cpp of this folder.
#ifndef ROPSIM_MODULE_IMAGES_H
#define ROPSIM_MODULE_IMAGES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#include "deep_image.h"

// Each returns 0, or not 0 with the reason in why[0..why_size).
#define MODULE_FUNCTION(name, parameters) int ropsim_module_##name parameters;
#include "functions.def"
#undef MODULE_FUNCTION

// The same as pointers, as image_module fills them.
typedef struct image_functions {
#define MODULE_FUNCTION(name, parameters) int(*name) parameters;
#include "functions.def"
#undef MODULE_FUNCTION
} image_functions;

#ifdef __cplusplus
}
#endif
#endif
