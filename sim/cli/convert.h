// What `ropsim convert` is made of: one pair of forms a file.
#ifndef ROPSIM_CONVERT_H
#define ROPSIM_CONVERT_H

#include "command.h"

// Each writes `path` aside and renames it; what the target cannot hold is said as a warning.
status convert_trace_to_trace(trace *trace, const char *path);
status convert_trace_to_csv(trace *trace, const char *path);
status convert_trace_to_deep(trace *trace, const char *path);   // deep EXR, convert_deep.c
status convert_deep_to_trace(const char *from, const char *path);

#endif
