// A run's result as one JSON object, for scripts: keys in a fixed order, doubles with the 17 digits that give
// the same double back. What is infinite (PSNR of an exact image) or not known (no reference) is null.
//
// What the machine says of time stands last, so that two runs of the same input differ in the last lines alone.
#include "result_json.h"

#include <math.h>

json_t *json_number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

json_t *json_count(uint64_t value)
{
    return json_integer((json_int_t)value);
}

static json_t *planes_object(const run_result *result)
{
    json_t *planes = json_array();
    for (int i = 0; i < result->plane_count; i++) {
        const plane_result *plane = &result->planes[i];
        json_array_append_new(planes,
                              json_pack("{s:s, s:s, s:o, s:o, s:o, s:o}", "name", plane->name, "format",
                                        format_table[plane->format].name, "bytes_read", json_count(plane->bytes_read),
                                        "bytes_written", json_count(plane->bytes_written), "bytes_cleared",
                                        json_count(plane->bytes_cleared), "texture_bytes_read",
                                        json_count(plane->texture_bytes_read)));
    }
    return planes;
}

static json_t *list_object(const run_result *result)
{
    return json_pack("{s:o, s:o, s:o, s:o}", "kept", json_count(result->list_kept), "lost",
                     json_count(result->list_lost), "entry_bytes", json_count(result->list_entry_bytes), "bytes",
                     json_count(result->list_kept * result->list_entry_bytes));
}

static json_t *error_object(const run_result *result)
{
    const error_result *error = &result->error;
    if (!result->error_known)
        return json_null();
    return json_pack("{s:b, s:o, s:o, s:o, s:o}", "exact", error->exact, "max_abs", json_number(error->max_abs), "rmse",
                     json_number(error->rmse), "psnr_db", json_number(error->psnr_db), "samples_wrong",
                     json_count(error->samples_wrong));
}

static json_t *machine_object(const machine *machine)
{
    json_t *object = json_object();
    machine_value value;
    for (int i = 0; machine_get_value(machine, i, &value); i++) {
        json_t *json = value.kind == MACHINE_VALUE_INTEGER ? json_integer(value.number)
                       : value.kind == MACHINE_VALUE_BOOL  ? json_boolean(value.number)
                                                           : json_string(value.text);
        json_object_set_new(object, value.key, json);
    }
    return object;
}

json_t *result_object(const run_result *result, const machine *machine, const char *trace_path, detail_level level)
{
    json_t *object =
        json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:s}", "version", ROPSIM_VERSION, "program", result->program, "trace",
                  trace_path, "trace_hash", result->trace_hash, "machine", result->machine, "machine_hash",
                  result->machine_hash, "detail", detail_level_names[level]);
    if (!object)  // a name that is not UTF-8, or no memory
        return NULL;
    json_object_set_new(object, "width", json_count(result->width));
    json_object_set_new(object, "height", json_count(result->height));
    json_object_set_new(object, "samples", json_count(result->samples));
    json_object_set_new(object, "geometry_passes", json_count(result->geometry_passes));
    json_object_set_new(object, "geometry_passes_by_class",
                        json_pack("{s:o, s:o}", "transparent", json_count(result->passes_by_class[CLASS_TRANSPARENT]),
                                  "sorted", json_count(result->passes_by_class[CLASS_SORTED])));
    json_object_set_new(object, "fullscreen_passes", json_count(result->fullscreen_passes));
    json_object_set_new(object, "iterations", json_count(result->iterations));
    json_object_set_new(object, "iteration_limit_reached", json_boolean(result->iteration_limit_reached));
    if (result->has_list)
        json_object_set_new(object, "list", list_object(result));
    json_object_set_new(object, "deepest_sample", json_count(result->deepest_sample));
    json_object_set_new(object, "fragments",
                        json_pack("{s:o, s:o, s:o}", "in_trace", json_count(result->fragments_in_trace), "replayed",
                                  json_count(result->fragments_replayed), "composited",
                                  json_count(result->fragments_composited)));
    json_object_set_new(object, "planes", planes_object(result));
    json_object_set_new(object, "error", error_object(result));
    json_object_set_new(object, "machine_keys", machine_object(machine));
    return object;
}

void result_add_times(json_t *object, const run_result *result)
{
    json_object_set_new(object, "wall_seconds", json_number(result->wall_seconds));
    json_object_set_new(object, "fragments_per_second", json_number(result->fragments_per_second));
}

status result_save(json_t *object, const char *path, const report *report)
{
    if (!object)
        return report_error(report, STATUS_REFUSED, "%s: the trace's name is not UTF-8, and JSON holds nothing else",
                            path);
    aside *aside = NULL;
    FILE *file = NULL;
    status status = aside_open(path, report, &aside, &file);
    if (status == STATUS_OK) {
        json_dumpf(object, file, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
        fputc('\n', file);
        status = aside_finish(aside);  // also notices what could not be written
    }
    json_decref(object);
    return status;
}

status result_write_json(const run_result *result, const machine *machine, const char *trace_path, const char *path,
                         const report *report)
{
    json_t *object = result_object(result, machine, trace_path, DETAIL_FUNCTION);
    if (object)
        result_add_times(object, result);
    return result_save(object, path, report);
}
