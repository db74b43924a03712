// The steps of record_scenes, for those that want the camera and the fragments without a file.
#ifndef ROPSIM_RECORD_H
#define ROPSIM_RECORD_H

#include "raster.h"

// Checks the options, builds every draw and settles the camera. On success free `models` with model_list_clear.
status record_prepare(const char *const *scenes, int scene_count, const record_options *options, const report *report,
                      model_list *models, view *view);
// The header of the trace: size, samples, positions, background, flags.
void record_trace_info(const record_options *options, trace_info *info);
// Rasterizes one draw and flushes. Triangle i is primitive first_primitive + i, whatever the draw order.
status record_model(const model *model, const view *view, const record_options *options, uint32_t first_primitive,
                    rasterizer *rasterizer, const report *report);

#endif
