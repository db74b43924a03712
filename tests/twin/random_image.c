// Random traces: small images that provoke ties, clamping, empty tiles and every order of arrival.
#include "random_input.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <unistd.h>
#include <cmocka.h>

uint64_t dice_next(dice *dice)  // splitmix64
{
    uint64_t z = dice->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

uint32_t dice_below(dice *dice, uint32_t count)
{
    return (uint32_t)(dice_next(dice) >> 32) % count;
}

bool dice_chance(dice *dice, uint32_t percent)
{
    return dice_below(dice, 100) < percent;
}

float dice_unit(dice *dice)
{
    const float special[] = {0.0f, 1.0f, 0.5f};
    return dice_chance(dice, 20) ? special[dice_below(dice, 3)] : (float)dice_below(dice, 1 << 20) / (float)(1 << 20);
}

// How depths of one draw arrive: at random among few or many, or sorted this way or that in blocks.
typedef struct depth_style {
    uint32_t distinct, block;
    bool forward;
} depth_style;

static double random_depth(dice *dice, const depth_style *style, uint32_t rank, bool nonfinite)
{
    static const double special[] = {0.0, 1.0, -0.25, 1.5, -0.0, 1e-9, 0.9999999999};
    if (nonfinite && dice_chance(dice, 4))
        return dice_chance(dice, 50) ? (double)NAN : dice_chance(dice, 50) ? INFINITY : -INFINITY;
    if (dice_chance(dice, 3))
        return special[dice_below(dice, 7)];
    if (style->block) {
        const uint32_t at = rank % style->block, step = style->forward ? at : style->block - 1 - at;
        return (step + 1.0) / (style->block + 2.0);
    }
    return style->distinct ? (dice_below(dice, style->distinct) + 1.0) / (style->distinct + 1.0)
                           : (double)dice_next(dice) * 0x1p-64;
}

static float random_component(dice *dice, bool nonfinite)
{
    const float special[] = {NAN, INFINITY, -INFINITY, 3e38f, 1e-40f, -2.0f, 70000.0f};
    return nonfinite && dice_chance(dice, 8) ? special[dice_below(dice, 7)] : dice_unit(dice);
}

static uint64_t sample_of(const twin_image *image, uint32_t x, uint32_t y, uint32_t sample)
{
    return ((uint64_t)y * image->width + x) * image->samples + sample;
}

// One draw: rounds of fragments over the image, some of its samples in each.
static void random_draw(dice *dice, twin_image *image, uint32_t draw, uint32_t *ranks, uint32_t max)
{
    const depth_style style = {dice_chance(dice, 70) ? 1 + dice_below(dice, 9) : 0,
                               dice_chance(dice, 40) ? 1 + dice_below(dice, 12) : 0, dice_chance(dice, 50)};
    const uint32_t x0 = dice_below(dice, image->width), y0 = dice_below(dice, image->height);
    const uint32_t x1 = x0 + 1 + dice_below(dice, image->width - x0),
                   y1 = y0 + 1 + dice_below(dice, image->height - y0);
    const uint32_t density = 1 + dice_below(dice, 100), rounds = 1 + dice_below(dice, 12);
    const bool unclear = dice_chance(dice, 30);  // alpha 0 and 1 only
    for (uint32_t round = 0; round < rounds; round++) {
        for (uint32_t y = y0; y < y1; y++) {
            for (uint32_t x = x0; x < x1; x++) {
                for (uint32_t s = 0; s < image->samples && image->fragment_count < max; s++) {
                    if (!dice_chance(dice, density))
                        continue;
                    const uint32_t rank = ranks[sample_of(image, x, y, s)]++;
                    twin_fragment *f = &image->fragments[image->fragment_count++];
                    *f = (twin_fragment){
                        .draw = draw, .x = x, .y = y, .sample = s, .primitive = round * 1000 + dice_below(dice, 5)};
                    f->depth = random_depth(dice, &style, rank, image->nonfinite);
                    for (int c = 0; c < 4; c++)
                        f->rgba[c] = random_component(dice, image->nonfinite);
                    if (unclear)
                        f->rgba[3] = dice_chance(dice, 50);
                }
            }
        }
    }
}

void random_image(dice *dice, bool nonfinite, twin_image *image)
{
    enum { FRAGMENT_MAX = 6000 };
    *image = (twin_image){
        .samples = 1u << dice_below(dice, 5), .nonfinite = nonfinite, .reversed_depth = dice_chance(dice, 30)};
    const bool large = dice_chance(dice, 30);
    image->width = 1 + dice_below(dice, large ? 40 : 11);
    image->height = 1 + dice_below(dice, large ? 24 : 9);
    for (int c = 0; c < 4; c++)
        image->background[c] = dice_unit(dice);
    image->fragments = calloc(FRAGMENT_MAX, sizeof *image->fragments);
    uint32_t *ranks = calloc((size_t)image->width * image->height * image->samples, sizeof *ranks);
    assert_non_null(image->fragments);
    assert_non_null(ranks);
    image->draw_count = dice_chance(dice, 5) ? 0 : 1 + dice_below(dice, TWIN_DRAW_MAX);
    const uint32_t max = 200 + dice_below(dice, FRAGMENT_MAX - 200);
    for (uint32_t draw = 0; draw < image->draw_count; draw++) {
        image->classes[draw] = (draw_class)dice_below(dice, CLASS_COUNT);
        if (dice_chance(dice, 90))
            random_draw(dice, image, draw, ranks, max);
    }
    free(ranks);
}

void random_image_free(twin_image *image)
{
    free(image->fragments);
}

static void write_fragments(const twin_image *image, trace_writer *writer)
{
    uint32_t at = 0;
    for (uint32_t draw = 0; draw < image->draw_count; draw++) {
        char name[16];
        snprintf(name, sizeof name, "draw%u", draw);
        assert_int_equal(trace_begin_draw(writer, name, image->classes[draw]), STATUS_OK);
        for (; at < image->fragment_count && image->fragments[at].draw == draw; at++) {
            const twin_fragment *f = &image->fragments[at];
            const uint16_t x = (uint16_t)f->x, y = (uint16_t)f->y;
            const uint8_t sample = (uint8_t)f->sample;
            const fragments run = {.count = 1,
                                   .x = &x,
                                   .y = &y,
                                   .sample = &sample,
                                   .depth = &f->depth,
                                   .primitive = &f->primitive,
                                   .rgba = {&f->rgba[0], &f->rgba[1], &f->rgba[2], &f->rgba[3]}};
            assert_int_equal(trace_append(writer, &run), STATUS_OK);
        }
        assert_int_equal(trace_end_draw(writer, 0, 0), STATUS_OK);
    }
    assert_int_equal(at, image->fragment_count);
}

trace *random_image_open(const twin_image *image)
{
    char folder[] = "/tmp/ropsim-twin-XXXXXX", path[64], hash[33];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/image.ropt", folder);
    trace_info info = {.width = image->width,
                       .height = image->height,
                       .samples = image->samples,
                       .depth_bits = 64,
                       .nonfinite = image->nonfinite,
                       .reversed_depth = image->reversed_depth};
    for (int c = 0; c < 4; c++)
        info.background[c] = image->background[c];
    trace_standard_positions(&info);
    trace_writer *writer;
    trace *trace;
    assert_int_equal(trace_create(path, &info, NULL, &writer), STATUS_OK);
    write_fragments(image, writer);
    assert_int_equal(trace_finish(writer, hash), STATUS_OK);
    assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
    unlink(path);
    rmdir(folder);
    return trace;
}
