// The schedule, step by step over the whole image.
#include "twin.h"

#include <stdlib.h>
#include <string.h>

static void start(twin *twin)
{
    for (int i = 0; i < twin->program->plane_count; i++) {
        const plane_decl *decl = &twin->program->planes[i];
        twin_plane *plane = &twin->result->planes[i];
        twin->formats[i] = plane_format(decl, twin->limits);
        twin->largest[i] = (uint32_t)((1ull << plane_bits(decl, twin->limits) % 64) - 1);
        plane->components = format_table[twin->formats[i]].class == FORMAT_CLASS_COLOR ? 4 : 1;
        plane->values = calloc(twin->sample_count * plane->components, sizeof *plane->values);
    }
    twin->result->plane_count = twin->program->plane_count;
}

static uint64_t image_bytes(const twin *twin, int plane)
{
    return twin->sample_count * (uint64_t)format_table[twin->formats[plane]].bits / 8;
}

static void clear(twin *twin, const step *step)
{
    twin_plane *plane = &twin->result->planes[step->plane];
    const format format = twin->formats[step->plane];
    uint32_t value[4] = {twin_value(twin, &step->value) & twin->largest[step->plane]};
    if (step->value.kind == VALUE_BATCH_NEAR)
        value[0] = twin->batches.near_code[twin->batches.current];
    if (step->value.kind == VALUE_BATCH_FAR)
        value[0] = twin->batches.far_code[twin->batches.current];
    if (step->value.kind == VALUE_FAR && step->value.format < 0 && format_table[format].class == FORMAT_CLASS_DEPTH)
        value[0] = twin_far(format);  // plain `far` is the plane's own farthest code
    const float *rgba = step->value.kind == VALUE_BACKGROUND ? twin->image->background : step->value.rgba;
    for (uint32_t c = 0; plane->components == 4 && c < 4; c++) {
        memcpy(&value[c], &rgba[c], sizeof value[c]);
        value[c] = twin_round(format, value[c]);
    }
    for (uint64_t i = 0; i < twin->sample_count * plane->components; i++)
        plane->values[i] = value[i % plane->components];
    plane->bytes_cleared += image_bytes(twin, step->plane);
}

static void copy(twin *twin, const step *step)
{
    twin_plane *to = &twin->result->planes[step->plane], *from = &twin->result->planes[step->source];
    memmove(to->values, from->values, twin->sample_count * to->components * sizeof *to->values);
    from->bytes_read += image_bytes(twin, step->source);
    to->bytes_written += image_bytes(twin, step->plane);
}

static void swap(twin *twin, const step *step)
{
    uint32_t *values = twin->result->planes[step->plane].values;
    twin->result->planes[step->plane].values = twin->result->planes[step->source].values;
    twin->result->planes[step->source].values = values;
}

static bool has_draw(const twin_image *image, draw_class class)
{
    for (uint32_t i = 0; i < image->draw_count; i++)
        if (image->classes[i] == class)
            return true;
    return false;
}

// A pass over both classes counts in each that the trace has, and as transparent if it has none.
static void count_pass(twin *twin, uint8_t classes)
{
    twin_result *result = twin->result;
    if (classes == DRAW_OPAQUE) {
        result->passes_by_class[CLASS_OPAQUE]++;
        return;
    }
    bool counted[CLASS_COUNT] = {[CLASS_TRANSPARENT] = classes & DRAW_UNSORTED, [CLASS_SORTED] = classes & DRAW_SORTED};
    if (classes == DRAW_TRANSPARENT || classes == DRAW_BATCH) {
        counted[CLASS_SORTED] = has_draw(twin->image, CLASS_SORTED);
        counted[CLASS_TRANSPARENT] = has_draw(twin->image, CLASS_TRANSPARENT) || !counted[CLASS_SORTED];
    }
    result->geometry_passes++;
    for (int c = 0; c < CLASS_COUNT; c++)
        result->passes_by_class[c] += counted[c];
}

static void run_kernel(twin *twin, const step *step, uint64_t sample, const twin_fragment *fragment)
{
    const kernel_decl *kernel = &twin->program->kernels[step->kernel];
    if (kernel->is_pass)
        twin_pass(twin, &kernel->pass, sample, fragment);
    else
        twin_kernel(twin, kernel, sample, fragment);
}

static void draw(twin *twin, const step *step)
{
    count_pass(twin, step->classes);
    for (uint32_t i = 0; i < twin->image->fragment_count; i++) {
        const twin_fragment *fragment = &twin->image->fragments[i];
        const uint64_t sample = twin_sample(twin->image, fragment);
        const bool drawn = step->classes == DRAW_BATCH ? twin->batches.drawn[twin->batches.current][fragment->draw]
                                                       : step->classes >> twin->image->classes[fragment->draw] & 1;
        if (!drawn)
            continue;
        twin->result->fragments_replayed += step->classes != DRAW_OPAQUE;
        run_kernel(twin, step, sample, fragment);
    }
}

static void fullscreen(twin *twin, const step *step)
{
    twin->result->fullscreen_passes++;
    for (uint64_t sample = 0; sample < twin->sample_count; sample++)
        run_kernel(twin, step, sample, NULL);
}

static void run_schedule(twin *twin, uint64_t max_iterations, double occlusion_ratio)
{
    uint64_t iterations[STEP_MAX] = {0};  // of the `repeat` at that step
    for (int s = 0; s < twin->program->step_count; s++) {
        const step *step = &twin->program->steps[s];
        switch (step->kind) {
        case STEP_CLEAR: clear(twin, step); break;
        case STEP_COPY: copy(twin, step); break;
        case STEP_SWAP: swap(twin, step); break;
        case STEP_DRAW: draw(twin, step); break;
        case STEP_FULLSCREEN: fullscreen(twin, step); break;
        case STEP_RESET: twin->queries[step->query] = 0; break;
        case STEP_REPEAT: iterations[s] = 0; break;
        case STEP_WHILE: {
            const bool more = (double)twin->queries[step->query] > occlusion_ratio * (double)twin->sample_count;
            const bool last = ++iterations[step->target] >= max_iterations;
            twin->result->iterations++;
            twin->result->iteration_limit_reached |= more && last;
            if (more && !last)
                s = step->target;
            break;
        }
        case STEP_IF:
            if (twin->queries[step->query] == 0)
                s = step->target;
            break;
        case STEP_LIST:
            count_pass(twin, step->classes);
            twin->result->fullscreen_passes++;
            twin_list(twin, step);
            break;
        case STEP_BATCHES:
            twin_make_batches(twin, step->entries);
            if (twin->batches.count == 0)
                s = step->target;
            break;
        case STEP_END_BATCHES:
            if (++twin->batches.current < twin->batches.count)
                s = step->target;
            break;
        case STEP_END: break;
        }
    }
}

// front.rgb + front.a * base.rgb, then the mean of a pixel's samples.
static void resolve(twin *twin)
{
    const program *program = twin->program;
    twin_result *result = twin->result;
    const uint32_t samples = twin->image->samples;
    result->sample_rgb = malloc(twin->sample_count * 3 * sizeof *result->sample_rgb);
    result->image = calloc(twin->sample_count / samples * 3, sizeof *result->image);
    for (uint64_t i = 0; i < twin->sample_count; i++) {
        const uint32_t *base = result->planes[program->output_base].values + 4 * i;
        const uint32_t *front = program->output_front < 0 ? NULL : result->planes[program->output_front].values + 4 * i;
        for (uint32_t c = 0; c < 3; c++) {
            float value = twin_float(base[c]);
            if (front)
                value = twin_float(front[c]) + twin_float(front[3]) * value;
            result->sample_rgb[3 * i + c] = value;
            result->image[i / samples * 3 + c] += value;
        }
    }
    for (uint64_t i = 0; i < twin->sample_count / samples * 3; i++)
        result->image[i] /= (float)samples;
}

static uint64_t deepest_sample(const twin *twin)
{
    uint64_t deepest = 0, *counts = calloc(twin->sample_count, sizeof *counts);
    for (uint32_t i = 0; i < twin->image->fragment_count; i++) {
        const twin_fragment *fragment = &twin->image->fragments[i];
        uint64_t *count = &counts[twin_sample(twin->image, fragment)];
        *count += twin->image->classes[fragment->draw] != CLASS_OPAQUE;
        deepest = *count > deepest ? *count : deepest;
    }
    free(counts);
    return deepest;
}

void twin_run(const program *program, const rop_limits *limits, const twin_image *image, uint64_t max_iterations,
              double occlusion_ratio, twin_result *result)
{
    memset(result, 0, sizeof *result);
    twin twin = {.program = program, .limits = limits, .image = image, .result = result};
    twin.sample_count = (uint64_t)image->width * image->height * image->samples;
    start(&twin);
    result->deepest_sample = deepest_sample(&twin);
    if (!max_iterations)
        max_iterations = program->max_iterations ? program->max_iterations : 2 * result->deepest_sample + 16;
    run_schedule(&twin, max_iterations, occlusion_ratio < 0 ? program->occlusion_ratio : occlusion_ratio);
    resolve(&twin);
    twin_error(image, result);
}

void twin_free(twin_result *result)
{
    for (int i = 0; i < result->plane_count; i++)
        free(result->planes[i].values);
    free(result->sample_rgb);
    free(result->image);
}
