// Scenes to a trace: every draw's triangles through order, shading, projection, clipping and the
// rasterizer, straight into the writer. Memory holds the geometry and one buffer of fragments.
#include "record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void record_defaults(record_options *options)
{
    *options = (record_options){.width = 512, .height = 512, .samples = 1, .alpha = 0.5, .background = {0, 0, 0, 0}};
    options->camera = (camera){.fov_degrees = 30};
}

static bool finite_camera(const camera *camera)
{
    bool finite = isfinite(camera->fov_degrees) && isfinite(camera->ortho_height) && isfinite(camera->near) &&
                  isfinite(camera->far);
    for (int i = 0; i < 3; i++)
        finite = finite && isfinite(camera->eye[i]) && isfinite(camera->target[i]) && isfinite(camera->up[i]);
    return finite;
}

static status check_options(const record_options *options, const report *report)
{
    uint32_t samples = options->samples;
    if (options->width < 1 || options->width > TRACE_SIZE_MAX || options->height < 1 ||
        options->height > TRACE_SIZE_MAX)
        return report_error(report, STATUS_USAGE, "size %ux%u: each side must be 1 to %d pixels", options->width,
                            options->height, TRACE_SIZE_MAX);
    if (samples < 1 || samples > TRACE_SAMPLES_MAX || (samples & (samples - 1)))
        return report_error(report, STATUS_USAGE, "samples %u: must be 1, 2, 4, 8 or 16", samples);
    if (!(options->alpha >= 0 && options->alpha <= 1))
        return report_error(report, STATUS_USAGE, "alpha %.9g: must be 0 to 1", options->alpha);
    if (options->order == ORDER_BUCKET && (options->order_parameter < 1 || options->order_parameter > UINT32_MAX))
        return report_error(report, STATUS_USAGE, "order bucket: the number of buckets must be 1 to %u", UINT32_MAX);
    if (!finite_camera(&options->camera))
        return report_error(report, STATUS_USAGE, "camera: every number must be finite");
    return STATUS_OK;
}

static status raster_model_triangle(const model *model, const view *view, double alpha, uint32_t triangle,
                                    uint32_t primitive, rasterizer *rasterizer)
{
    clip_vertex corners[3], polygon[CLIP_VERTEX_MAX];
    for (int i = 0; i < 3; i++) {
        view_project(view, model->mesh->positions[model->mesh->triangles[triangle][i]], &corners[i]);
        shade_corner(model, view, alpha, triangle, i, corners[i].rgba);
    }
    int count = clip_triangle(view, corners, polygon);
    screen_vertex fan[3];
    for (int i = 0; i < count; i++) {
        snap_vertex(view, &polygon[i], &fan[i < 2 ? i : 2]);
        if (i < 2)
            continue;
        status result = raster_triangle(rasterizer, fan, primitive);
        if (result)
            return result;
        fan[1] = fan[2];
    }
    return STATUS_OK;
}

status record_model(const model *model, const view *view, const record_options *options, uint32_t first_primitive,
                    rasterizer *rasterizer, const report *report)
{
    enum { PROGRESS_TRIANGLES = 4096 };
    uint32_t count = model->mesh->triangle_count;
    uint32_t *order = malloc((count ? count : 1) * sizeof *order);
    if (!order)
        return report_error(report, STATUS_IO, "%s: out of memory", model->name);
    status result = triangle_order_fill(model, view, options->order, options->order_parameter, report, order);
    for (uint32_t i = 0; i < count && !result; i++) {
        if (i % PROGRESS_TRIANGLES == 0)
            report_progress(report, model->name, i, count);
        result = raster_model_triangle(model, view, options->alpha, order[i], first_primitive + order[i], rasterizer);
    }
    free(order);
    if (!result)
        result = rasterizer_flush(rasterizer);
    report_progress(report, model->name, count, count);
    return result;
}

status record_prepare(const char *const *scenes, int scene_count, const record_options *options, const report *report,
                      model_list *models, view *view)
{
    *models = (model_list){0};
    status result = check_options(options, report);
    if (!result && scene_count < 1)
        result = report_error(report, STATUS_USAGE, "nothing to record: give a mesh file or scene:NAME");
    for (int i = 0; i < scene_count && !result; i++)
        result = scene_add(scenes[i], report, models);
    uint64_t triangles = 0;
    for (uint32_t i = 0; i < models->count; i++)
        triangles += models->models[i].mesh->triangle_count;
    if (!result && (models->count > TRACE_DRAWS_MAX || triangles > UINT32_MAX))
        result =
            report_error(report, STATUS_REFUSED, "more than %d draws or 2^32 triangles in one trace", TRACE_DRAWS_MAX);
    if (!result)
        result = view_fit(&options->camera, models, options->width, options->height, report, view);
    if (result)
        model_list_clear(models);
    return result;
}

void record_trace_info(const record_options *options, trace_info *info)
{
    *info = (trace_info){.width = options->width,
                         .height = options->height,
                         .samples = options->samples,
                         .reversed_depth = options->camera.reverse_z,
                         .depth_bits = 64};
    memcpy(info->background, options->background, sizeof info->background);
    trace_standard_positions(info);
}

static status append(void *user, const fragments *run)
{
    return trace_append(user, run);
}

static status write_draws(const model_list *models, const view *view, const record_options *options,
                          const trace_info *info, trace_writer *writer, const report *report)
{
    rasterizer *rasterizer = rasterizer_create(info, (fragment_sink){append, writer});
    if (!rasterizer)
        return report_error(report, STATUS_IO, "out of memory");
    status result = STATUS_OK;
    uint32_t primitive = 0;
    for (uint32_t i = 0; i < models->count && !result; i++) {
        const model *model = &models->models[i];
        result = trace_begin_draw(writer, model->name, model->class);
        if (!result)
            result = record_model(model, view, options, primitive, rasterizer, report);
        if (!result)
            result = trace_end_draw(writer, model->mesh->triangle_count, model->mesh->vertex_count);
        primitive += model->mesh->triangle_count;
    }
    rasterizer_destroy(rasterizer);
    return result;
}

status record_scenes(const char *const *scenes, int scene_count, const record_options *options, const char *path,
                     const report *report)
{
    model_list models;
    view view;
    status result = record_prepare(scenes, scene_count, options, report, &models, &view);
    if (result)
        return result;
    trace_info info;
    record_trace_info(options, &info);
    trace_writer *writer;
    result = trace_create(path, &info, report, &writer);
    if (!result) {
        result = write_draws(&models, &view, options, &info, writer, report);
        char hash[33];
        if (result)
            trace_abandon(writer);
        else
            result = trace_finish(writer, hash);
    }
    model_list_clear(&models);
    return result;
}
