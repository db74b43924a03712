// The object of a run's result in parts, so that results of deeper levels hold the same keys in the same places.
#ifndef ROPSIM_RESULT_JSON_H
#define ROPSIM_RESULT_JSON_H

#include "../levels.h"

#include <jansson.h>

json_t *json_number(double value);   // null where it is not finite
json_t *json_count(uint64_t value);

// All but the times of the run. NULL: the trace's path is not UTF-8, or no memory. The caller's reference.
json_t *result_object(const run_result *result, const machine *machine, const char *trace_path, detail_level level);
void result_add_times(json_t *object, const run_result *result);
// Writes aside and renames; takes the reference, of NULL it says why.
status result_save(json_t *object, const char *path, const report *report);

#endif
