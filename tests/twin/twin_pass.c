// One fragment through declared fixed-function state: shader, clip, stencil test, depth test, stencil update, depth
// write, targets, query. A plane is read where the state needs its value, by fragments that got so far; the clip's maps
// are read by all.
#include "twin.h"

#include <string.h>

static bool holds(compare_function function, double x, double y)
{
    switch (function) {
    case COMPARE_never: return false;
    case COMPARE_less: return x < y;
    case COMPARE_equal: return x == y;
    case COMPARE_lequal: return x <= y;
    case COMPARE_greater: return x > y;
    case COMPARE_notequal: return x != y;
    case COMPARE_gequal: return x >= y;
    case COMPARE_always: return true;
    case COMPARE_FUNCTION_COUNT: break;
    }
    return false;
}

static bool needs_value(compare_function function)
{
    return function != COMPARE_never && function != COMPARE_always;
}

static bool clip_keeps(twin *twin, const clip_decl *clip, uint64_t sample, const twin_fragment *fragment)
{
    static const compare_function functions[] = {[BOUND_less] = COMPARE_less,
                                                 [BOUND_lequal] = COMPARE_lequal,
                                                 [BOUND_equal] = COMPARE_equal,
                                                 [BOUND_gequal] = COMPARE_gequal,
                                                 [BOUND_greater] = COMPARE_greater};
    const format format = twin->formats[clip->plane[0]];
    const bool reversed = twin->image->reversed_depth;
    uint32_t bound = UINT32_MAX;
    for (int i = 0; i < clip->plane_count; i++) {
        uint32_t code[4];
        twin_load(twin, clip->plane[i], sample, TWIN_TEXTURE, code);
        bound = code[0] < bound ? code[0] : bound;
    }
    double x = twin_depth_code(format, fragment->depth, reversed), y = bound;
    if (twin->limits->clip_interpolated) {
        // The depth that the shader has is a float, whatever the plane's format is.
        x = (double)twin_code_depth(FORMAT_z32f, twin_depth_code(FORMAT_z32f, fragment->depth, reversed), reversed);
        y = (double)twin_code_depth(format, bound, reversed);
    }
    return holds(functions[clip->function], x, y);
}

static bool operation_needs_value(stencil_operation operation)
{
    return operation != STENCIL_keep && operation != STENCIL_zero && operation != STENCIL_replace;
}

static uint32_t operated(stencil_operation operation, uint32_t stored, uint32_t reference, uint32_t largest)
{
    switch (operation) {
    case STENCIL_keep: return stored;
    case STENCIL_zero: return 0;
    case STENCIL_replace: return reference;
    case STENCIL_incr: return stored == largest ? largest : stored + 1;
    case STENCIL_decr: return stored == 0 ? 0 : stored - 1;
    case STENCIL_invert: return ~stored & largest;
    case STENCIL_incr_wrap: return stored == largest ? 0 : stored + 1;
    case STENCIL_decr_wrap: return stored == 0 ? largest : stored - 1;
    case STENCIL_OPERATION_COUNT: break;
    }
    return 0;
}

static uint32_t read_stencil(twin *twin, const pass_decl *pass, uint64_t sample)
{
    uint32_t stored[4] = {0};
    if (needs_value(pass->stencil_function) || operation_needs_value(pass->stencil_fail) ||
        operation_needs_value(pass->stencil_depth_fail) || operation_needs_value(pass->stencil_pass) ||
        pass->stencil_write_mask != 255)
        twin_load(twin, pass->stencil_plane, sample, TWIN_READ, stored);
    return stored[0];
}

static bool stencil_passes(const pass_decl *pass, uint32_t stored)
{
    return holds(pass->stencil_function, pass->stencil_reference & pass->stencil_mask, stored & pass->stencil_mask);
}

static bool depth_passes(twin *twin, const pass_decl *pass, uint64_t sample, uint32_t code)
{
    uint32_t stored[4] = {0};
    if (pass->depth_plane < 0)
        return true;
    if (needs_value(pass->depth_function))
        twin_load(twin, pass->depth_plane, sample, TWIN_READ, stored);
    return holds(pass->depth_function, code, stored[0]);
}

static void update_stencil(twin *twin, const pass_decl *pass, uint64_t sample, stencil_operation operation,
                           uint32_t stored)
{
    if (operation == STENCIL_keep)
        return;
    const uint32_t value = operated(operation, stored, pass->stencil_reference, twin->largest[pass->stencil_plane]);
    const uint32_t mask = pass->stencil_write_mask;
    twin_store(twin, pass->stencil_plane, sample, &(uint32_t){(value & mask) | (stored & ~mask)});
}

static void write_targets(twin *twin, const pass_decl *pass, uint64_t sample, const twin_fragment *fragment,
                          uint32_t shaded[COLOR_COUNT][4])
{
    for (int i = 0; i < pass->target_count; i++) {
        uint32_t source[4], stored[4];
        if (pass->targets[i].source >= SOURCE_FRAGMENT_COLOR)
            twin_color(fragment, pass->targets[i].source, source);
        else
            memcpy(source, shaded[pass->targets[i].source - SOURCE_COLOR], sizeof source);
        if (pass->targets[i].blend >= 0) {
            twin_load(twin, pass->targets[i].plane, sample, TWIN_READ, stored);
            twin_blend(twin, pass->targets[i].blend, source, stored, source);
        }
        twin_store(twin, pass->targets[i].plane, sample, source);
    }
}

void twin_pass(twin *twin, const pass_decl *pass, uint64_t sample, const twin_fragment *fragment)
{
    uint32_t shaded[COLOR_COUNT][4];
    bool alive = pass->shader < 0 || twin_shader(twin, pass, sample, fragment, shaded);
    for (int i = 0; i < pass->clip_count; i++)
        alive = clip_keeps(twin, &pass->clips[i], sample, fragment) && alive;
    if (!alive)
        return;
    const bool has_stencil = pass->stencil_plane >= 0;
    const uint32_t stencil = has_stencil ? read_stencil(twin, pass, sample) : 0;
    if (has_stencil && !stencil_passes(pass, stencil)) {
        update_stencil(twin, pass, sample, pass->stencil_fail, stencil);
        return;
    }
    const uint32_t code = pass->depth_plane < 0 ? 0
                                                : twin_depth_code(twin->formats[pass->depth_plane], fragment->depth,
                                                                  twin->image->reversed_depth);
    if (!depth_passes(twin, pass, sample, code)) {
        if (has_stencil)
            update_stencil(twin, pass, sample, pass->stencil_depth_fail, stencil);
        return;
    }
    if (has_stencil)
        update_stencil(twin, pass, sample, pass->stencil_pass, stencil);
    if (pass->depth_plane >= 0 && pass->depth_write)
        twin_store(twin, pass->depth_plane, sample, &code);
    write_targets(twin, pass, sample, fragment, shaded);
    if (pass->query >= 0)
        twin->queries[pass->query]++;
}
