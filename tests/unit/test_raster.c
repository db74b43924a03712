// Coverage and depth of triangles in screen space, against hand-computed cases and exact integer arithmetic.
#include "raster_fixture.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>

__extension__ typedef __int128 int128;

static screen_vertex at(int64_t x, int64_t y, double depth)
{
    return (screen_vertex){.x = x, .y = y, .depth = depth, .inverse_w = 1, .rgba = {1, 1, 1, 1}};
}

// One triangle of `kept` from corners in 1/256 pixel.
static void draw(kept *kept, screen_vertex a, screen_vertex b, screen_vertex c, uint32_t primitive)
{
    const screen_vertex corners[3] = {a, b, c};
    assert_int_equal(raster_triangle(kept->rasterizer, corners, primitive), STATUS_OK);
    assert_int_equal(rasterizer_flush(kept->rasterizer), STATUS_OK);
}

// The rows of a 8 x 8 image as digits: how often each pixel is covered.
static void expect_picture(const kept *kept, const char *rows)
{
    char seen[8 * 9 + 1];
    for (int i = 0; i < 72; i++)
        seen[i] = i % 9 == 8 ? '\n' : '0';
    seen[72] = 0;
    for (size_t i = 0; i < kept->count; i++)
        seen[kept->fragments[i].y * 9 + kept->fragments[i].x]++;
    assert_string_equal(seen, rows);
}

// Corners on pixel centres: samples on the left and the top edge are in, on the right, the bottom and the diagonal out.
static void samples_on_top_and_left_edges_are_inside(void **state)
{
    kept kept;
    (void)state;
    kept_start(&kept, 8, 8, 1);
    draw(&kept, at(384, 384, 0), at(1408, 384, 0), at(384, 1408, 0), 0);  // pixels 1 to 5; right angle at the top left
    expect_picture(&kept, "00000000\n01111000\n01110000\n01100000\n01000000\n00000000\n00000000\n00000000\n");
    kept_stop(&kept);

    kept_start(&kept, 8, 8, 1);
    draw(&kept, at(1408, 384, 0), at(1408, 1408, 0), at(384, 1408, 0),
         0);  // its complement: the diagonal is a left edge
    expect_picture(&kept, "00000000\n00000000\n00001000\n00011000\n00111000\n00000000\n00000000\n00000000\n");
    kept_stop(&kept);
}

// Both halves of a square in every winding: each of its pixels once.
static void a_square_of_two_triangles_is_covered_once(void **state)
{
    (void)state;
    for (int winding = 0; winding < 4; winding++) {
        kept kept;
        screen_vertex a = at(384, 384, 0), b = at(1408, 384, 0), c = at(1408, 1408, 0), d = at(384, 1408, 0);
        kept_start(&kept, 8, 8, 1);
        draw(&kept, a, winding & 1 ? d : b, winding & 1 ? b : d, 0);
        draw(&kept, b, winding & 2 ? d : c, winding & 2 ? c : d, 1);
        expect_picture(&kept, "00000000\n01111000\n01111000\n01111000\n01111000\n00000000\n00000000\n00000000\n");
        kept_stop(&kept);
    }
}

// A fan around a point off the grid, corners on a rough ring: every sample inside the ring exactly once.
static void fans_cover_every_sample_once(void **state)
{
    (void)state;
    static const uint32_t sample_counts[] = {1, 2, 4, 8, 16};
    uint64_t random = 7;
    for (int round = 0; round < 60; round++) {
        kept kept;
        enum { SIZE = 48, CORNERS = 13 };
        kept_start(&kept, SIZE, SIZE, sample_counts[round % 5]);
        screen_vertex ring[CORNERS], centre = at(24 * 256 + (int64_t)random_below(&random, 512),
                                                 24 * 256 + (int64_t)random_below(&random, 512), 0.5);
        for (int i = 0; i < CORNERS; i++) {
            double sine, cosine, radius = 256 * (26 + 30 * random_unit(&random));  // parts of it beyond the image
            angle_sin_cos((i + 0.9 * random_unit(&random)) / CORNERS, &sine, &cosine);
            // Some corners land on sample positions, so that edges go through samples.
            int64_t grid = i % 3 ? 1 : 64;
            ring[i] = at((centre.x + (int64_t)(radius * cosine)) / grid * grid,
                         (centre.y + (int64_t)(radius * sine)) / grid * grid, 0.25);
        }
        for (int i = 0; i < CORNERS; i++)
            draw(&kept, centre, ring[i], ring[(i + 1) % CORNERS], (uint32_t)i);
        static uint8_t times[SIZE * SIZE * TRACE_SAMPLES_MAX];
        memset(times, 0, sizeof times);
        for (size_t i = 0; i < kept.count; i++)
            times[(kept.fragments[i].y * SIZE + kept.fragments[i].x) * TRACE_SAMPLES_MAX + kept.fragments[i].sample]++;
        size_t strictly_inside = 0;
        for (uint32_t y = 0; y < SIZE; y++) {
            for (uint32_t x = 0; x < SIZE; x++) {
                for (uint32_t s = 0; s < kept.info.samples; s++) {
                    // The ring is star-shaped around the centre: inside if on the inner side of its sector's edge.
                    int64_t px = sample_x(&kept, x, s), py = sample_y(&kept, y, s);
                    int inside = 0;
                    for (int i = 0; i < CORNERS; i++) {
                        const screen_vertex *v[3] = {&centre, &ring[i], &ring[(i + 1) % CORNERS]};
                        int64_t e[3];
                        for (int k = 0; k < 3; k++) {
                            const screen_vertex *from = v[k], *to = v[(k + 1) % 3];
                            e[k] = (to->x - from->x) * (py - from->y) - (to->y - from->y) * (px - from->x);
                        }
                        inside |= e[0] >= 0 && e[1] > 0 && e[2] >= 0;
                    }
                    int count = times[(y * SIZE + x) * TRACE_SAMPLES_MAX + s];
                    assert_true(count <= 1);
                    strictly_inside += inside;
                    if (inside)
                        assert_int_equal(count, 1);
                }
            }
        }
        assert_true(strictly_inside > 500);
        kept_stop(&kept);
    }
}

// Every sample against the definition, in 128 bits; and depth against the exact rational value.
static size_t check_exactly(const kept *kept, const screen_vertex v[3])
{
    int128 area = (int128)(v[1].x - v[0].x) * (v[2].y - v[0].y) - (int128)(v[1].y - v[0].y) * (v[2].x - v[0].x);
    int sign = area < 0 ? -1 : 1;
    size_t next = 0, covered = 0;
    for (uint32_t tile = 0; area && tile < kept->info.width / 8 * (kept->info.height / 8); tile++) {
        for (uint32_t i = 0; i < 64 * kept->info.samples; i++) {
            uint32_t s = i % kept->info.samples, pixel = i / kept->info.samples;
            uint32_t x = tile % (kept->info.width / 8) * 8 + pixel % 8,
                     y = tile / (kept->info.width / 8) * 8 + pixel / 8;
            int128 px = sample_x(kept, x, s), py = sample_y(kept, y, s), e[3];
            bool inside = true;
            for (int k = 0; k < 3; k++) {
                const screen_vertex *from = &v[(k + 1) % 3], *to = &v[(k + 2) % 3];
                int128 dx = sign * (to->x - from->x), dy = sign * (to->y - from->y);
                e[k] = dx * (py - from->y) - dy * (px - from->x);
                inside = inside && (e[k] > 0 || (e[k] == 0 && (dy < 0 || (dy == 0 && dx > 0))));
            }
            if (!inside)
                continue;
            covered++;
            // Order and place: the next fragment is this one.
            assert_true(next < kept->count);
            const kept_fragment *f = &kept->fragments[next++];
            assert_true(f->x == x && f->y == y && f->sample == s);
            __extension__ typedef __float128 wide;
            wide exact =
                ((wide)e[0] * (wide)v[0].depth + (wide)e[1] * (wide)v[1].depth + (wide)e[2] * (wide)v[2].depth) /
                ((wide)sign * (wide)area);
            double error = (double)((wide)f->depth - exact);
            assert_true(fabs(error) < 4 * 0x1p-53);
        }
    }
    assert_int_equal(next, kept->count);
    return covered;
}

static void random_triangles_match_exact_arithmetic(void **state)
{
    (void)state;
    static const int64_t reach[] = {256, 2000, 20000, INT64_C(1) << 24, INT64_C(1) << 39};
    uint64_t random = 11;
    size_t covered = 0, covered_huge = 0;
    for (int round = 0; round < 400; round++) {
        kept kept;
        screen_vertex v[3];
        kept_start(&kept, 32, 32, 1u << (round % 5));
        int64_t r = reach[round % 5];
        for (int i = 0; i < 3; i++)
            v[i] = at(4096 + (int64_t)random_below(&random, (uint64_t)(2 * r)) - r,
                      4096 + (int64_t)random_below(&random, (uint64_t)(2 * r)) - r, random_unit(&random));
        draw(&kept, v[0], v[1], v[2], 3);
        size_t count = check_exactly(&kept, v);
        covered += count;
        covered_huge += round % 5 == 4 ? count : 0;
        kept_stop(&kept);
    }
    assert_true(covered > 100000 && covered_huge > 10000);
}

static void slivers_and_points(void **state)
{
    (void)state;
    kept kept;
    kept_start(&kept, 32, 32, 16);
    draw(&kept, at(256, 256, 0), at(512, 512, 0), at(1024, 1024, 0), 0);  // on a line
    draw(&kept, at(300, 300, 0), at(300, 300, 0), at(900, 300, 0), 0);    // two corners the same
    draw(&kept, at(129, 129, 0), at(130, 129, 0), at(129, 130, 0), 0);    // smaller than the gap between samples
    draw(&kept, at(-5000, -5000, 0), at(-100, -5000, 0), at(-5000, -100, 0), 0);  // outside
    assert_int_equal(kept.count, 0);
    kept_stop(&kept);
    // A sub-pixel triangle around the one sample of a pixel.
    kept_start(&kept, 32, 32, 1);
    draw(&kept, at(1400, 1404, 0.5), at(1420, 1404, 0.5), at(1408, 1420, 0.5), 9);
    assert_int_equal(kept.count, 1);
    assert_true(kept.fragments[0].x == 5 && kept.fragments[0].y == 5 && kept.fragments[0].primitive == 9 &&
                kept.fragments[0].depth == 0.5);
    kept_stop(&kept);
    // A sliver across the image, one 1/256 pixel thick at its end.
    kept_start(&kept, 32, 32, 16);
    const screen_vertex sliver[3] = {at(-100000, 4000, 0.1), at(100000, 4200, 0.9), at(100000, 4201, 0.2)};
    draw(&kept, sliver[0], sliver[1], sliver[2], 0);
    check_exactly(&kept, sliver);
    kept_stop(&kept);
}

static void duplicates_have_the_same_depth_bits(void **state)
{
    (void)state;
    uint64_t random = 5;
    static const int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (int round = 0; round < 20; round++) {
        screen_vertex v[3];
        for (int i = 0; i < 3; i++)
            v[i] = at((int64_t)random_below(&random, 8192), (int64_t)random_below(&random, 8192), random_unit(&random));
        kept first;
        kept_start(&first, 32, 32, 4);
        draw(&first, v[0], v[1], v[2], 0);
        for (int o = 1; o < 6; o++) {
            kept other;
            kept_start(&other, 32, 32, 4);
            draw(&other, v[orders[o][0]], v[orders[o][1]], v[orders[o][2]], 0);
            assert_int_equal(other.count, first.count);
            for (size_t i = 0; i < first.count; i++)
                assert_memory_equal(&other.fragments[i].depth, &first.fragments[i].depth, sizeof(double));
            kept_stop(&other);
        }
        kept_stop(&first);
    }
}

static void colors_are_perspective_correct(void **state)
{
    (void)state;
    kept kept;
    screen_vertex v[3] = {at(0, 0, 0.2), at(32 * 256, 0, 0.7), at(0, 32 * 256, 0.4)};
    const double w[3] = {1, 4, 10};
    for (int i = 0; i < 3; i++) {
        v[i].inverse_w = 1 / w[i];
        for (int c = 0; c < 3; c++)
            v[i].rgba[c] = c == i;
        v[i].rgba[3] = 0.3;
    }
    kept_start(&kept, 32, 32, 4);
    draw(&kept, v[0], v[1], v[2], 0);
    assert_true(kept.count > 1500);
    for (size_t i = 0; i < kept.count; i++) {
        const kept_fragment *f = &kept.fragments[i];
        double b1 = (double)sample_x(&kept, f->x, f->sample) / 8192,
               b2 = (double)sample_y(&kept, f->y, f->sample) / 8192, b0 = 1 - b1 - b2;
        double sum = b0 / w[0] + b1 / w[1] + b2 / w[2];
        assert_true(fabs((double)f->rgba[0] - b0 / w[0] / sum) < 1e-7 &&
                    fabs((double)f->rgba[1] - b1 / w[1] / sum) < 1e-7);
        assert_true(f->rgba[3] == 0.3f);  // the same at all corners: the same to the last bit
    }
    kept_stop(&kept);
}

static void reversed_device_depth_comes_out_as_distance(void **state)
{
    (void)state;
    kept kept;
    kept_start(&kept, 8, 8, 1);
    rasterizer_destroy(kept.rasterizer);
    kept.info.reversed_depth = true;
    kept.rasterizer = rasterizer_create(&kept.info, (fragment_sink){keep, &kept});
    draw(&kept, at(0, 0, 0.25), at(0, 9000, 0.25), at(9000, 0, 0.25), 0);
    assert_int_equal(kept.count, 64);
    assert_true(kept.fragments[10].depth == 0.75);
    kept_stop(&kept);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_on_top_and_left_edges_are_inside),
        cmocka_unit_test(a_square_of_two_triangles_is_covered_once),
        cmocka_unit_test(fans_cover_every_sample_once),
        cmocka_unit_test(random_triangles_match_exact_arithmetic),
        cmocka_unit_test(slivers_and_points),
        cmocka_unit_test(duplicates_have_the_same_depth_bits),
        cmocka_unit_test(colors_are_perspective_correct),
        cmocka_unit_test(reversed_device_depth_comes_out_as_distance),
    };
    return cmocka_run_group_tests_name("raster", tests, NULL, NULL);
}
