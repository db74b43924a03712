// A second truth: Embree casts a ray through a sample of the recorder's camera and collects every hit.
//
// Hits come unsorted, coplanar duplicates among them (a filter stores each hit and rejects it, so the ray goes
// on). There is no fill rule and no snapping, so near an edge a rasterizer may differ.
#ifndef ROPSIM_TEST_RAYCAST_H
#define ROPSIM_TEST_RAYCAST_H

#include "../../sim/raster/raster.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#if defined(__SSE__)
#include <pmmintrin.h>
#endif

enum { RAY_HITS_MAX = 4096 };

typedef struct ray_hit {
    uint32_t primitive;
    double distance;  // along the ray, in units of its direction
} ray_hit;

typedef struct raycaster {
    RTCDevice device;
    RTCScene scene;
} raycaster;

typedef struct ray_context {
    struct RTCIntersectContext context;  // first: the filter gets it
    ray_hit hits[RAY_HITS_MAX];
    uint32_t count;
    bool overflow;
} ray_context;

static inline void raycaster_store(const struct RTCFilterFunctionNArguments *arguments)
{
    ray_context *context = (ray_context *)(void *)arguments->context;
    if (arguments->N != 1 || arguments->valid[0] != -1)
        return;
    const struct RTCRay *ray = (const struct RTCRay *)(const void *)arguments->ray;
    const struct RTCHit *hit = (const struct RTCHit *)(const void *)arguments->hit;
    arguments->valid[0] = 0;  // go on
    for (uint32_t i = 0; i < context->count; i++)
        if (context->hits[i].primitive == hit->primID)
            return;  // some builds report a primitive twice
    context->overflow = context->overflow || context->count == RAY_HITS_MAX;
    if (!context->overflow)
        context->hits[context->count++] = (ray_hit){hit->primID, (double)ray->tfar};
}

// Takes the mesh's triangles in file order. False if Embree does not start.
static inline bool raycaster_start(raycaster *caster, const mesh *mesh)
{
#if defined(__SSE__)
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
#endif
    // Results differ between vector units; pin one where the processor has it.
    caster->scene = NULL;
    caster->device = rtcNewDevice("threads=1,isa=avx2");
    if (caster->device && rtcGetDeviceError(NULL) != RTC_ERROR_NONE) {
        rtcReleaseDevice(caster->device);
        caster->device = NULL;
    }
    if (!caster->device)
        caster->device = rtcNewDevice("threads=1");
    if (!caster->device)
        return false;
    caster->scene = rtcNewScene(caster->device);
    rtcSetSceneFlags(caster->scene, RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
    RTCGeometry geometry = rtcNewGeometry(caster->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                             mesh->vertex_count);
    void *triangles = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(uint32_t), mesh->triangle_count);
    if (!vertices || !triangles)
        return false;
    memcpy(vertices, mesh->positions, mesh->vertex_count * sizeof *mesh->positions);
    memcpy(triangles, mesh->triangles, mesh->triangle_count * sizeof *mesh->triangles);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(caster->scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(caster->scene);
    return rtcGetDeviceError(caster->device) == RTC_ERROR_NONE;
}

static inline void raycaster_stop(raycaster *caster)
{
    rtcReleaseScene(caster->scene);
    rtcReleaseDevice(caster->device);
}

// The ray through a point of the image, in pixels from its top left corner: from the eye (perspective) or the eye's
// plane (ortho), direction such that a hit at t is at distance t along the view.
static inline void raycaster_ray(const view *view, double x, double y, double origin[3], double direction[3])
{
    double across = (2 * x / view->width - 1) / view->scale[0], up = (1 - 2 * y / view->height) / view->scale[1];
    for (int i = 0; i < 3; i++) {
        double offset = view->right[i] * across + view->up[i] * up;
        origin[i] = view->eye[i] + (view->ortho ? offset : 0);
        direction[i] = view->forward[i] + (view->ortho ? 0 : offset);
    }
}

// All hits between near and far, unsorted, in context->hits.
static inline void raycaster_cast(raycaster *caster, const view *view, double x, double y, ray_context *context)
{
    double origin[3], direction[3];
    raycaster_ray(view, x, y, origin, direction);
    rtcInitIntersectContext(&context->context);
    context->context.filter = raycaster_store;
    context->count = 0;
    context->overflow = false;
    struct RTCRay ray = {.org_x = (float)origin[0],
                         .org_y = (float)origin[1],
                         .org_z = (float)origin[2],
                         .dir_x = (float)direction[0],
                         .dir_y = (float)direction[1],
                         .dir_z = (float)direction[2],
                         .tnear = (float)view->near,
                         .tfar = (float)view->far,
                         .mask = UINT32_MAX};
    rtcOccluded1(caster->scene, &context->context, &ray);
}

#endif
