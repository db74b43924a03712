// Deep images: for each pixel a list of samples with depth, as EXR files hold them.
//
// A deep image is in memory as a whole: 28 bytes a sample (24 without numbers), as the library behind it wants it so.
#ifndef ROPSIM_DEEP_H
#define ROPSIM_DEEP_H

#include "../sim.h"
#include "module/deep_image.h"

enum { DEEP_COUNT_MAX = 1 << 28 };

// Channels R, G, B, A, Z as floats, and id and sample as 32-bit integers where given. Written aside and renamed.
status deep_write(const char *path, const deep_image *image, const report *report);
// Finds the same channels by name; Z must be there. More than DEEP_COUNT_MAX samples are refused. Free with
// deep_destroy.
status deep_read(const char *path, const report *report, deep_image *image);
void deep_destroy(deep_image *image);  // frees the arrays

#endif
