// Float results and exact ones in, error figures out. Two NaN are equal; a NaN against a number, or an
// infinity that is not matched, is infinitely wrong.
#include "replay.h"

#include <math.h>

static const double EXACT = 1e-5;  // largest difference that rounding to float may leave

static double difference(double value, double exact)
{
    if (value == exact || (isnan(value) && isnan(exact)))
        return 0.0;
    const double error = fabs(value - exact);
    return isnan(error) ? INFINITY : error;
}

error_sum error_of_tile(uint64_t lanes, float rgb[TILE_LANES][3], double exact[TILE_LANES][3])
{
    error_sum sum = {0};
    for (; lanes; lanes &= lanes - 1) {
        const int lane = __builtin_ctzll(lanes);
        bool wrong = false;
        for (int c = 0; c < 3; c++) {
            const double error = difference((double)rgb[lane][c], exact[lane][c]);
            sum.max_abs = error > sum.max_abs ? error : sum.max_abs;
            sum.squares += error * error;
            wrong |= error > EXACT;
        }
        sum.components += 3;
        sum.wrong += wrong;
    }
    return sum;
}

void error_add(error_sum *sum, error_sum other)
{
    sum->max_abs = other.max_abs > sum->max_abs ? other.max_abs : sum->max_abs;
    sum->squares += other.squares;
    sum->components += other.components;
    sum->wrong += other.wrong;
}

void error_finish(const error_sum *sum, error_result *error)
{
    error->max_abs = sum->max_abs;
    error->rmse = sum->components ? sqrt(sum->squares / (double)sum->components) : 0.0;
    error->psnr_db = error->rmse > 0.0 ? -20.0 * log10(error->rmse) : INFINITY;
    error->samples_wrong = sum->wrong;
    error->exact = sum->max_abs <= EXACT;
}
