// A program's file in either form.
#ifndef ROPSIM_PROGRAM_FILE_H
#define ROPSIM_PROGRAM_FILE_H

#include "sim.h"

// Reads text, with values for its parameters, or words, told apart by content. Free with program_destroy.
status program_read(const char *path, const parameter *parameters, int parameter_count, const report *report,
                    program **program);

#endif
