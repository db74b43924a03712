// A blend state, a source and a destination colour in, the blended colour out: the scalar twin of execute.c's blend.
#include "float_bits.h"
#include "isa.h"

#include <math.h>

static float weight(blend_factor factor, const float s[4], const float t[4], int c)
{
    switch (factor) {
    case FACTOR_zero: return 0.0f;
    case FACTOR_one: return 1.0f;
    case FACTOR_src_color: return s[c];
    case FACTOR_one_minus_src_color: return 1.0f - s[c];
    case FACTOR_dst_color: return t[c];
    case FACTOR_one_minus_dst_color: return 1.0f - t[c];
    case FACTOR_src_alpha: return s[3];
    case FACTOR_one_minus_src_alpha: return 1.0f - s[3];
    case FACTOR_dst_alpha: return t[3];
    case FACTOR_one_minus_dst_alpha: return 1.0f - t[3];
    case BLEND_FACTOR_COUNT: break;
    }
    return 0.0f;
}

// D3D11.3 17.6: a weight of zero still multiplies, so a NaN comes through; min and max drop a NaN.
static float blend_component(blend_equation equation, blend_factor source, blend_factor destination, const float s[4],
                             const float t[4], int c)
{
    const float f = weight(source, s, t, c), g = weight(destination, s, t, c);
    switch (equation) {
    case EQUATION_add: return float_canonical(s[c] * f + t[c] * g);
    case EQUATION_subtract: return float_canonical(s[c] * f - t[c] * g);
    case EQUATION_reverse_subtract: return float_canonical(t[c] * g - s[c] * f);
    case EQUATION_min: return s[c] < t[c] || isnan(t[c]) ? s[c] : t[c];
    case EQUATION_max: return s[c] > t[c] || isnan(t[c]) ? s[c] : t[c];
    case BLEND_EQUATION_COUNT: break;
    }
    return 0.0f;
}

void blend_color(const blend_decl *state, const float source[4], const float destination[4], float blended[4])
{
    for (int c = 0; c < 3; c++)
        blended[c] = blend_component(state->rgb.equation, state->rgb.source, state->rgb.destination, source, destination, c);
    blended[3] = blend_component(state->alpha.equation, state->alpha.source, state->alpha.destination, source, destination, 3);
}
