// What an ordering took and whom it could not take, as one JSON object; docs/order.md lists the keys.
#include "order.h"

#include <jansson.h>

static json_t *count(uint64_t value)
{
    return json_integer((json_int_t)value);
}

static json_t *counts_object(order_counts counts)
{
    return json_pack("{s:o, s:o}", "bytes_read", count(counts.bytes_read), "samples_scanned",
                     count(counts.samples_scanned));
}

// The primitives of one place: numbers, or [draw, number] where numbers are not unique.
static json_t *place_array(const order_result *result, order_place place)
{
    json_t *array = json_array();
    uint64_t at = 0;
    for (order_place before = PLACE_LAYER; before < place; before++)
        at += result->place_counts[before];
    for (uint64_t i = at; i < at + result->place_counts[place]; i++) {
        const order_primitive *p = &result->primitives[i];
        json_array_append_new(array, result->several_draws ? json_pack("[o, o]", count(p->draw), count(p->primitive))
                                                           : count(p->primitive));
    }
    return array;
}

static json_t *layer_sizes(const order_result *result)
{
    json_t *array = json_array();
    for (uint64_t i = 0, first = 0; i < result->place_counts[PLACE_LAYER]; i++) {
        const bool last = i + 1 == result->place_counts[PLACE_LAYER] ||
                          result->primitives[i + 1].layer != result->primitives[i].layer;
        if (!last)
            continue;
        json_array_append_new(array, count(i + 1 - first));
        first = i + 1;
    }
    return array;
}

static json_t *result_object(const order_result *result, const char *trace_path)
{
    json_t *object =
        json_pack("{s:s, s:s, s:s, s:s, s:s}", "version", ROPSIM_VERSION, "trace", trace_path, "trace_hash",
                  result->trace_hash, "machine", result->machine, "machine_hash", result->machine_hash);
    if (!object)  // a name that is not UTF-8, or no memory
        return NULL;
    json_object_set_new(object, "rule", json_string(result->printed ? "printed" : "exact"));
    json_object_set_new(object, "width", count(result->width));
    json_object_set_new(object, "height", count(result->height));
    json_object_set_new(object, "samples", count(result->samples));
    json_object_set_new(object, "primitives", count(result->primitive_count));
    json_object_set_new(object, "ordered", count(result->place_counts[PLACE_LAYER]));
    json_object_set_new(object, "layers", count(result->layer_count));
    json_object_set_new(object, "layer_sizes", layer_sizes(result));
    json_object_set_new(object, "passes",
                        json_pack("{s:o, s:o, s:o}", "item", count(result->item_passes), "complexity",
                                  count(result->complexity_passes), "complexity_most_in_a_layer",
                                  count(result->complexity_passes_most)));
    json_object_set_new(
        object, "fragments",
        json_pack("{s:o, s:o}", "in_order", count(result->fragments), "replayed", count(result->fragments_replayed)));
    json_object_set_new(object, "block_pixels", count(result->block_pixels));
    json_object_set_new(object, "whole", counts_object(result->whole));
    json_object_set_new(object, "blocks", counts_object(result->blocks));
    json_object_set_new(
        object, "check",
        json_pack("{s:o, s:o}", "pairs", count(result->pairs), "pairs_wrong", count(result->pairs_wrong)));
    json_object_set_new(object, "several_draws", json_boolean(result->several_draws));
    json_object_set_new(object, "cyclic", place_array(result, PLACE_CYCLE));
    json_object_set_new(object, "behind_cycles", place_array(result, PLACE_BEHIND));
    json_object_set_new(object, "without_fragment", place_array(result, PLACE_NOWHERE));
    json_object_set_new(object, "without_fragment_unnamed", count(result->nowhere_unnamed));
    json_object_set_new(object, "wall_seconds", json_real(result->wall_seconds));
    return object;
}

status order_write_json(const order_result *result, const char *trace_path, const char *path, const report *report)
{
    json_t *object = result_object(result, trace_path);
    if (!object)
        return report_error(report, STATUS_REFUSED, "%s: the trace's name is not UTF-8, and JSON holds nothing else",
                            path);
    aside *aside = NULL;
    FILE *file = NULL;
    status status = aside_open(path, report, &aside, &file);
    if (status == STATUS_OK) {
        const bool dumped = json_dumpf(object, file, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) == 0;
        putc('\n', file);
        status = aside_finish(aside);  // also notices what could not be written
        if (status == STATUS_OK && !dumped)
            status = report_error(report, STATUS_IO, "%s: out of memory", path);
    }
    json_decref(object);
    return status;
}
