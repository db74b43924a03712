// Sine, cosine and tangent with the same bits everywhere: Taylor polynomials over an eighth of a turn,
// from + - * and / alone. libm promises no last digit, and a recorded trace must not depend on it.
#include "raster.h"

#include <math.h>

static const double TURN = 6.283185307179586476925286766559;

// |x| <= pi / 4: the first term left out is below 2^-60 of the result.
static double sine_near_zero(double x)
{
    double s = x * x;
    return x * (1 + s * (-1.0 / 6 +
                         s * (1.0 / 120 +
                              s * (-1.0 / 5040 +
                                   s * (1.0 / 362880 + s * (-1.0 / 39916800 +
                                                            s * (1.0 / 6227020800 + s * (-1.0 / 1307674368000))))))));
}

static double cosine_near_zero(double x)
{
    double s = x * x;
    return 1 + s * (-1.0 / 2 +
                    s * (1.0 / 24 +
                         s * (-1.0 / 720 +
                              s * (1.0 / 40320 +
                                   s * (-1.0 / 3628800 + s * (1.0 / 479001600 + s * (-1.0 / 87178291200 +
                                                                                     s * (1.0 / 20922789888000))))))));
}

void angle_sin_cos(double turns, double *sine, double *cosine)
{
    double quarter = floor(turns * 4 + 0.5);
    double x = (turns - quarter * 0.25) * TURN;
    double s = sine_near_zero(x), c = cosine_near_zero(x);
    int quadrant = (int)(quarter - 4 * floor(quarter / 4));
    *sine = quadrant == 0 ? s : quadrant == 1 ? c : quadrant == 2 ? -s : -c;
    *cosine = quadrant == 0 ? c : quadrant == 1 ? -s : quadrant == 2 ? -c : s;
}

double angle_tangent(double turns)
{
    double sine, cosine;
    angle_sin_cos(turns, &sine, &cosine);
    return sine / cosine;
}
