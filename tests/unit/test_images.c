// Pictures: bits kept by .exr and .pfm, sRGB bytes of .png, the same file run by run, refusals.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <unistd.h>

static char folder[] = "/tmp/ropsim_images_XXXXXX";
enum { WIDTH = 5, HEIGHT = 3, COUNT = WIDTH * HEIGHT * 3 };

static const char *in_folder(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void fill(float rgb[COUNT])
{
    static const float special[] = {0.0f, -0.0f, 1.0f, -1.5f, 1e-42f, 3.0e38f, INFINITY, -INFINITY, 0.1f};
    for (int i = 0; i < COUNT; i++)
        rgb[i] = i < (int)(sizeof special / sizeof *special) ? special[i] : (float)i / 7.0f;
}

static void floats_keep_their_bits(void **state)
{
    (void)state;
    static const char *const names[] = {"bits.exr", "bits.pfm", "bits.EXR"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        float rgb[COUNT], *read;
        uint32_t width, height;
        fill(rgb);
        assert_int_equal(image_write_rgb(in_folder(names[i]), WIDTH, HEIGHT, rgb, NULL), STATUS_OK);
        assert_int_equal(image_read_rgb(in_folder(names[i]), NULL, &width, &height, &read), STATUS_OK);
        assert_int_equal(width, WIDTH);
        assert_int_equal(height, HEIGHT);
        assert_memory_equal(read, rgb, sizeof rgb);
        free(read);
    }
}

// Bytes by hand from IEC 61966-2-1: 0.5 is 187.5, 0.002 is 6.6, 0.2140411 is 127.5; a NaN is black.
static void png_is_srgb(void **state)
{
    (void)state;
    const float rgb[] = {0, 1, 0.5f, 0.002f, -3, 7, NAN, 0.0031308f, INFINITY};
    const int bytes[] = {0, 255, 188, 7, 0, 255, 0, 10, 255};
    float *read;
    uint32_t width, height;
    assert_int_equal(image_write_rgb(in_folder("curve.png"), 3, 1, rgb, NULL), STATUS_OK);
    assert_int_equal(image_read_rgb(in_folder("curve.png"), NULL, &width, &height, &read), STATUS_OK);
    assert_int_equal(width, 3);
    for (int i = 0; i < 9; i++) {
        double value = bytes[i] / 255.0;
        double linear = value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
        assert_true(fabs(linear - (double)read[i]) < 1e-6);
    }
    free(read);
}

static size_t read_bytes(const char *name, unsigned char *bytes, size_t size)
{
    FILE *file = fopen(in_folder(name), "rb");
    assert_non_null(file);
    size_t count = fread(bytes, 1, size, file);
    fclose(file);
    return count;
}

// A file a second later has the same bytes: no time of writing in it.
static void files_repeat(void **state)
{
    (void)state;
    static const char *const names[] = {"a.exr", "a.png", "a.pfm"};
    float rgb[COUNT];
    unsigned char first[3][4096], second[4096];
    size_t sizes[3];
    fill(rgb);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(image_write_rgb(in_folder(names[i]), WIDTH, HEIGHT, rgb, NULL), STATUS_OK);
        sizes[i] = read_bytes(names[i], first[i], sizeof first[i]);
    }
    sleep(1);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(image_write_rgb(in_folder(names[i]), WIDTH, HEIGHT, rgb, NULL), STATUS_OK);
        assert_int_equal(read_bytes(names[i], second, sizeof second), sizes[i]);
        assert_memory_equal(first[i], second, sizes[i]);
    }
}

static void pfm_rows_go_up(void **state)
{
    (void)state;
    const float rgb[] = {1, 2, 3, 4, 5, 6};
    unsigned char bytes[64];
    float bottom[3];
    assert_int_equal(image_write_rgb(in_folder("rows.pfm"), 1, 2, rgb, NULL), STATUS_OK);
    size_t size = read_bytes("rows.pfm", bytes, sizeof bytes);
    assert_memory_equal(bytes, "PF\n1 2\n-1.0\n", 12);
    assert_int_equal(size, 12 + sizeof rgb);
    memcpy(bottom, bytes + 12, sizeof bottom);
    assert_true(bottom[0] == 4 && bottom[2] == 6);
}

static void refusals_leave_no_file(void **state)
{
    (void)state;
    const float rgb[3] = {0};
    messages messages;
    messages_start(&messages);
    assert_int_equal(image_write_rgb(in_folder("a.jpg"), 1, 1, rgb, &messages.report), STATUS_USAGE);
    assert_non_null(strstr(messages.text, ".exr, .pfm or .png"));
    assert_int_equal(image_write_rgb(in_folder("empty.pfm"), 0, 1, rgb, &messages.report), STATUS_REFUSED);
    assert_int_equal(access(in_folder("empty.pfm"), F_OK), -1);
    static const char *const nowhere[] = {"no/a.exr", "no/a.png", "no/a.pfm"};
    for (int i = 0; i < 3; i++)
        assert_int_equal(image_write_rgb(in_folder(nowhere[i]), 1, 1, rgb, &messages.report), STATUS_IO);
}

static void damaged_images_are_refused(void **state)
{
    (void)state;
    static const char *const texts[] = {"PF\n1 1\n-1.0\nabc",
                                        "PF\n1 1\n1.0\nabcdabcdabcd",
                                        "PF\n0 1\n-1.0\n",
                                        "P6\n1 1\n255\n",
                                        "PF\n999999999 999999999\n-1.0\n",
                                        "PF\n-1 1\n-1.0\n",
                                        "",
                                        "PF\n1 1\n-1.0\n"};
    static const char *const names[] = {"bad.pfm", "bad.exr", "bad.png"};
    for (size_t i = 0; i < 3 * sizeof texts / sizeof *texts; i++) {
        const char *name = names[i % 3];
        FILE *file = fopen(in_folder(name), "wb");
        assert_non_null(file);
        fputs(texts[i / 3], file);
        fclose(file);
        float *read;
        uint32_t width, height;
        messages messages;
        messages_start(&messages);
        assert_int_equal(image_read_rgb(in_folder(name), &messages.report, &width, &height, &read), STATUS_REFUSED);
        assert_null(read);
        assert_int_equal(messages.count, 1);
    }
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(floats_keep_their_bits), cmocka_unit_test(png_is_srgb),
        cmocka_unit_test(files_repeat),           cmocka_unit_test(pfm_rows_go_up),
        cmocka_unit_test(refusals_leave_no_file), cmocka_unit_test(damaged_images_are_refused),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    static const char *const names[] = {"bits.exr", "bits.pfm", "bits.EXR", "curve.png", "a.exr",  "a.png",
                                        "a.pfm",    "rows.pfm", "bad.pfm",  "bad.exr",   "bad.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        unlink(in_folder(names[i]));
    return failed + (rmdir(folder) != 0);  // a file left behind is a failure, too
}
