// The twin's result and the replay's in, the first difference out.
#include "twin.h"

#include <math.h>
#include <string.h>

static bool differ(char difference[256], const char *what, const char *of, uint64_t at, uint64_t run, uint64_t twin)
{
    snprintf(difference, 256, "%s%s%s at %llu: the replay has %llu (0x%llx), the twin %llu (0x%llx)", what,
             *of ? " of " : "", of, (unsigned long long)at, (unsigned long long)run, (unsigned long long)run,
             (unsigned long long)twin, (unsigned long long)twin);
    return false;
}

#define SAME(FIELD) \
    if (run->FIELD != twin->FIELD) \
    return differ(difference, #FIELD, "", 0, run->FIELD, twin->FIELD)

static bool same_counts(const twin_result *twin, const run_result *run, char difference[256])
{
    SAME(geometry_passes);
    SAME(fullscreen_passes);
    SAME(iterations);
    SAME(iteration_limit_reached);
    SAME(fragments_replayed);
    SAME(fragments_composited);
    SAME(deepest_sample);
    SAME(list_kept);
    SAME(list_lost);
    for (int c = 0; c < CLASS_COUNT; c++)
        if (run->passes_by_class[c] != twin->passes_by_class[c])
            return differ(difference, "passes_by_class", draw_class_names[c], 0, run->passes_by_class[c],
                          twin->passes_by_class[c]);
    return true;
}

#define SAME_BYTES(FIELD) \
    if (r->FIELD != t->FIELD) \
    return differ(difference, #FIELD, r->name, 0, r->FIELD, t->FIELD)

static bool same_plane(const twin_plane *t, const plane_result *r, const uint32_t *values, uint64_t sample_count,
                       char difference[256])
{
    SAME_BYTES(bytes_read);
    SAME_BYTES(bytes_written);
    SAME_BYTES(bytes_cleared);
    SAME_BYTES(texture_bytes_read);
    for (uint64_t i = 0; i < sample_count * t->components; i++)
        if (values[i] != t->values[i])
            return differ(difference, "value", r->name, i, values[i], t->values[i]);
    return true;
}

// Bit by bit, but that one NaN is as good as another.
static bool same_floats(const char *what, const float *twin, const float *run, uint64_t count, char difference[256])
{
    for (uint64_t i = 0; i < count; i++) {
        uint32_t a, b;
        memcpy(&a, &run[i], sizeof a);
        memcpy(&b, &twin[i], sizeof b);
        if (a != b && !(isnan(run[i]) && isnan(twin[i])))
            return differ(difference, what, "", i, a, b);
    }
    return true;
}

// Sums in double differ by the order of their terms.
static bool near(double a, double b)
{
    return a == b || fabs(a - b) <= 1e-12 + 1e-9 * fabs(b);
}

static bool same_error(const twin_result *twin, const error_result *error, char difference[256])
{
    const double psnr = twin->rmse > 0.0 ? 20.0 * log10(1.0 / twin->rmse) : INFINITY;
    const bool same_psnr = near(error->psnr_db, psnr) || (twin->rmse < 1e-9 && error->rmse < 1e-9);
    if (near(error->max_abs, twin->max_abs) && near(error->rmse, twin->rmse) && same_psnr &&
        error->exact == (twin->max_abs <= 1e-5) && error->samples_wrong == twin->samples_wrong)
        return true;
    snprintf(difference, 256, "error: the replay has %g, %g, %llu samples; the twin %g, %g, %llu", error->max_abs,
             error->rmse, (unsigned long long)error->samples_wrong, twin->max_abs, twin->rmse,
             (unsigned long long)twin->samples_wrong);
    return false;
}

bool twin_compare(const program *program, const twin_result *twin, const run_result *run, char difference[256])
{
    const uint64_t pixels = (uint64_t)run->width * run->height, samples = pixels * run->samples;
    if (!same_counts(twin, run, difference))
        return false;
    for (int i = 0; i < program->plane_count; i++)
        if (!same_plane(&twin->planes[i], &run->planes[i], run->plane_values[i], samples, difference))
            return false;
    return same_floats("sample", twin->sample_rgb, run->sample_rgb, samples * 3, difference) &&
           same_floats("pixel", twin->image, run->image, pixels * 3, difference) &&
           (!run->error_known || same_error(twin, &run->error, difference));
}
