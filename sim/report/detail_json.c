// The result of the levels traffic and cycle as JSON: the object of the function level, then bytes, times and
// statistics, in total and by pass, draw and iteration.
#include "result_json.h"

static json_t *statistics_object(const statistics *statistics, detail_level level)
{
    json_t *object = json_object();
    for (int i = 0; i < STATISTIC_COUNT; i++) {
        if (statistic_rows[i].level <= level)
            json_object_set_new(object, statistic_rows[i].name, json_count(statistic_value(statistics, i)));
    }
    return object;
}

static json_t *derived_object(const statistics *statistics, const detail_result *detail)
{
    json_t *object = json_object();
    for (int i = 0; i < DERIVED_COUNT; i++) {
        if (derived_rows[i].level <= detail->level)
            json_object_set_new(object, derived_rows[i].name,
                                json_number(derived_value(i, statistics, &detail->machine)));
    }
    return object;
}

static void add_statistics(json_t *object, const statistics *statistics, const detail_result *detail)
{
    json_object_set_new(object, "statistics", statistics_object(statistics, detail->level));
    json_object_set_new(object, "derived", derived_object(statistics, detail));
}

static json_t *memory_object(const detail_result *detail)
{
    json_t *planes = json_array();
    for (int i = 0; i < detail->plane_count; i++)
        json_array_append_new(planes, json_pack("{s:s, s:o, s:o}", "name", detail->plane_names[i], "bytes_read",
                                                json_count(detail->planes[i].read), "bytes_written",
                                                json_count(detail->planes[i].written)));
    return json_pack("{s:o, s:o, s:o}", "bytes_read", json_count(detail->total.memory_bytes_read), "bytes_written",
                     json_count(detail->total.memory_bytes_written), "planes", planes);
}

static json_t *occupancy_object(const detail_result *detail)
{
    json_t *object = json_object();
    for (int i = 0; i < ACCESS_UNITS; i++)
        json_object_set_new(object, access_unit_names[i],
                            json_pack("{s:o, s:o, s:o}", "least", json_count(detail->occupancy[i].least), "most",
                                      json_count(detail->occupancy[i].most), "sets",
                                      json_count(detail->occupancy[i].sets)));
    return object;
}

static void add_cycles(json_t *object, const detail_result *detail)
{
    json_object_set_new(object, "cycles", json_count(detail->cycles));
    json_object_set_new(object, "drained_cycles", json_count(detail->drained_cycles));
    json_object_set_new(object, "seconds_at_clock",
                        json_number((double)detail->drained_cycles / (1e6 * (double)detail->machine.core_mhz)));
    json_object_set_new(object, "bound_cycles", json_count(detail->bound_cycles));
}

// How a run was sampled, and what its statistics may be off by.
static void add_sampling(json_t *object, const detail_result *detail)
{
    const sampling *sampling = &detail->sampling;
    json_t *intervals = json_object();
    json_object_set_new(object, "sampling",
                        json_pack("{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "seed", json_count(sampling->seed), "head",
                                  json_count(sampling->head), "warm", json_count(sampling->warm), "lead", json_count(sampling->lead), "window",
                                  json_count(sampling->window), "period", json_count(sampling->period), "lead_and_window",
                                  json_count(sampling->lead_and_window), "windows", json_count(detail->windows), "stamps", json_count(detail->stamps), "stamps_measured",
                                  json_count(detail->stamps_measured)));
    for (int i = 0; i < STATISTIC_COUNT; i++)
        json_object_set_new(intervals, statistic_rows[i].name, json_number(detail->half_widths[i]));
    json_object_set_new(intervals, "memory_bytes", json_number(detail->memory_half_width));
    json_object_set_new(object, "half_widths", intervals);
}

// Of a draw: whether a test may come before the shader, or why not.
static json_t *test_string(bool machine_has, bool allowed, const char *forbidden)
{
    if (forbidden)
        return json_sprintf("forbidden: %s", forbidden);
    return !allowed ? json_null() : json_string(machine_has ? "on" : "allowed, but the machine has none");
}

static json_t *pass_object(const pass_record *pass, const detail_result *detail)
{
    const pass_info *info = &pass->info;
    json_t *object =
        json_pack("{s:o, s:s, s:s, s:o}", "number", json_count(info->number), "kind", pass_kind_names[info->kind],
                  "name", info->name, "iteration", json_count(info->iteration));
    json_object_set_new(object, "hierarchical_depth",
                        test_string(detail->machine.hierarchical_depth, info->hierarchical, info->hierarchical_forbidden));
    json_object_set_new(object, "early_depth", test_string(detail->machine.early_depth, info->early, info->early_forbidden));
    if (detail->level >= DETAIL_CYCLE) {
        json_t *bounds = json_object();
        for (int i = 0; i < RESOURCE_COUNT; i++)
            json_object_set_new(bounds, clock_resource_names[i], json_count(pass->bounds[i]));
        json_object_set_new(object, "start", json_count(pass->start));
        json_object_set_new(object, "last_fragment", json_count(pass->last_fragment));
        json_object_set_new(object, "drained", json_count(pass->drained));
        json_object_set_new(object, "bound_by", json_string(clock_resource_names[pass->bound_by]));
        json_object_set_new(object, "bounds", bounds);
    }
    add_statistics(object, &pass->statistics, detail);
    return object;
}

// Regions that have an index alone: draws and iterations.
static json_t *regions_array(const statistics *regions, uint64_t count, const detail_result *detail)
{
    json_t *array = json_array();
    for (uint64_t i = 0; i < count; i++) {
        json_t *object = json_pack("{s:o}", "index", json_count(i));
        add_statistics(object, &regions[i], detail);
        json_array_append_new(array, object);
    }
    return array;
}

status detail_write_json(const run_result *function, const detail_result *detail, const char *trace_path,
                         const char *path, const report *report)
{
    json_t *object = result_object(function, &detail->machine, trace_path, detail->level);
    if (!object)
        return result_save(NULL, path, report);
    json_object_set_new(object, "memory", memory_object(detail));
    if (detail->level >= DETAIL_CYCLE)
        add_cycles(object, detail);
    if (detail->level == DETAIL_SAMPLED)
        add_sampling(object, detail);
    json_object_set_new(object, "occupancy", occupancy_object(detail));
    add_statistics(object, &detail->total, detail);
    json_t *passes = json_array();
    for (uint64_t i = 0; i < detail->pass_count; i++)
        json_array_append_new(passes, pass_object(&detail->passes[i], detail));
    json_object_set_new(object, "passes", passes);
    json_object_set_new(object, "draws", regions_array(detail->draws, detail->draw_count, detail));
    json_object_set_new(object, "by_iteration", regions_array(detail->iterations, detail->iteration_count, detail));
    result_add_times(object, function);
    json_object_set_new(object, "detail_wall_seconds", json_number(detail->wall_seconds));
    return result_save(object, path, report);
}
