// Portable float maps: the simplest float image there is.
#ifndef ROPSIM_PFM_H
#define ROPSIM_PFM_H

#include "../sim.h"

// Writes RGB rows from the top; false on a failed write (errno tells).
bool pfm_write(FILE *file, uint32_t width, uint32_t height, const float *rgb);
// Reads one; NULL, or why it is refused. *rgb is freed with free().
const char *pfm_read(FILE *file, uint64_t pixels_max, uint32_t *width, uint32_t *height, float **rgb);

#endif
