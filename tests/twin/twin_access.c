// What kernels and passes share: a sample's plane values with their bytes, colours, blending.
#include "twin.h"

#include <math.h>
#include <string.h>

static uint64_t plane_bytes(const twin *twin, int plane)
{
    return (uint64_t)format_table[twin->formats[plane]].bits / 8;
}

void twin_load(twin *twin, int plane, uint64_t sample, twin_access access, uint32_t *value)
{
    twin_plane *p = &twin->result->planes[plane];
    memcpy(value, p->values + sample * p->components, p->components * sizeof *value);
    *(access == TWIN_READ ? &p->bytes_read : &p->texture_bytes_read) += plane_bytes(twin, plane);
}

void twin_store(twin *twin, int plane, uint64_t sample, const uint32_t *value)
{
    twin_plane *p = &twin->result->planes[plane];
    for (uint32_t c = 0; c < p->components; c++)
        p->values[sample * p->components + c] =
            p->components == 4 ? twin_round(twin->formats[plane], value[c]) : value[c] & twin->largest[plane];
    p->bytes_written += plane_bytes(twin, plane);
}

void twin_color(const twin_fragment *fragment, int source, uint32_t rgba[4])
{
    memcpy(rgba, fragment->rgba, 4 * sizeof *rgba);
    for (int c = 0; source == SOURCE_FRAGMENT_PREMUL && c < 3; c++)
        rgba[c] = twin_bits(fragment->rgba[c] * fragment->rgba[3]);
}

static float factor(blend_factor factor, const uint32_t s[4], const uint32_t d[4], int c)
{
    switch (factor) {
    case FACTOR_zero: return 0.0f;
    case FACTOR_one: return 1.0f;
    case FACTOR_src_color: return twin_float(s[c]);
    case FACTOR_one_minus_src_color: return 1.0f - twin_float(s[c]);
    case FACTOR_dst_color: return twin_float(d[c]);
    case FACTOR_one_minus_dst_color: return 1.0f - twin_float(d[c]);
    case FACTOR_src_alpha: return twin_float(s[3]);
    case FACTOR_one_minus_src_alpha: return 1.0f - twin_float(s[3]);
    case FACTOR_dst_alpha: return twin_float(d[3]);
    case FACTOR_one_minus_dst_alpha: return 1.0f - twin_float(d[3]);
    case BLEND_FACTOR_COUNT: break;
    }
    return NAN;
}

static uint32_t blend_component(blend_equation equation, blend_factor source, blend_factor destination,
                                const uint32_t s[4], const uint32_t d[4], int c)
{
    const float a = twin_float(s[c]), b = twin_float(d[c]);
    const float f = factor(source, s, d, c), g = factor(destination, s, d, c);
    switch (equation) {
    case EQUATION_add: return twin_bits(a * f + b * g);
    case EQUATION_subtract: return twin_bits(a * f - b * g);
    case EQUATION_reverse_subtract: return twin_bits(b * g - a * f);
    case EQUATION_min: return isnan(b) || a < b ? s[c] : d[c];  // a NaN loses
    case EQUATION_max: return isnan(b) || a > b ? s[c] : d[c];
    case BLEND_EQUATION_COUNT: break;
    }
    return 0;
}

void twin_blend(twin *twin, int blend, const uint32_t source[4], const uint32_t destination[4], uint32_t out[4])
{
    const blend_decl *state = &twin->program->blends[blend];
    uint32_t rgba[4];
    for (int c = 0; c < 3; c++)
        rgba[c] =
            blend_component(state->rgb.equation, state->rgb.source, state->rgb.destination, source, destination, c);
    rgba[3] =
        blend_component(state->alpha.equation, state->alpha.source, state->alpha.destination, source, destination, 3);
    memcpy(out, rgba, sizeof rgba);
    twin->result->fragments_composited += state->composites;
}

uint32_t twin_value(const twin *twin, const value *value)
{
    switch (value->kind) {
    case VALUE_UINT:
    case VALUE_FLOAT: return value->bits;
    case VALUE_NEAR: return 0;
    case VALUE_FAR: return twin_far(value->format < 0 ? twin->limits->depth_format : (format)value->format);
    case VALUE_STENCIL_MAX: return (1u << twin->limits->stencil_bits) - 1;
    case VALUE_BATCH_NEAR:
    case VALUE_BATCH_FAR:
    case VALUE_BACKGROUND:
    case VALUE_RGBA: break;
    }
    return 0;
}
