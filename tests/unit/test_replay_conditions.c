// Loop conditions over tiles that go their own pace, and iterations that are counted instead of run: programs and
// images made to trip them, each against the twin in every way of running.
#include "../twin/random_input.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

// ---- Images --------------------------------------------------------------------------------------------

enum { FRAGMENT_MAX = 4000 };

static void start_image(twin_image *image, uint32_t width, uint32_t height, uint32_t samples)
{
    *image = (twin_image){.width = width,
                          .height = height,
                          .samples = samples,
                          .background = {0.2f, 0.4f, 0.6f, 1.0f},
                          .classes = {CLASS_TRANSPARENT},
                          .draw_count = 1};
    image->fragments = malloc(FRAGMENT_MAX * sizeof *image->fragments);
    assert_non_null(image->fragments);
}

static void add(twin_image *image, uint32_t x, uint32_t y, uint32_t sample, double depth)
{
    assert_true(image->fragment_count < FRAGMENT_MAX);
    image->fragments[image->fragment_count++] = (twin_fragment){
        .x = x, .y = y, .sample = sample, .depth = depth, .rgba = {0.5f, 0.25f, 1.0f, 0.5f}, .primitive = x};
}

// Tiles of 8 x 8: the further right, the more layers, every third tile against the order of depth, every seventh empty.
static void staircase(twin_image *image)
{
    start_image(image, 38, 20, 1);
    for (uint32_t layer = 0; layer < 18; layer++) {
        for (uint32_t y = 0; y < 20; y += 3) {
            for (uint32_t x = 0; x < 38; x += 2) {
                const uint32_t tile = x / 8 + 5 * (y / 8), layers = tile % 7 * 3;
                if (layer < layers)
                    add(image, x, y, 0, (1.0 + (tile % 3 ? layer : layers - layer)) / 40.0);
            }
        }
    }
}

// One deep sample in one corner of an image of four samples a pixel, and nothing else.
static void lonely(twin_image *image)
{
    start_image(image, 37, 23, 4);
    for (uint32_t layer = 0; layer < 40; layer++)
        add(image, 36, 22, 3, 1.0 - (layer + 1) / 42.0);
}

// P has one layer, Q three in reverse.
static void two_samples(twin_image *image)
{
    start_image(image, 9, 1, 1);  // in two tiles
    add(image, 0, 0, 0, 0.5);
    add(image, 8, 0, 0, 0.5);
    add(image, 8, 0, 0, 0.4);
    add(image, 8, 0, 0, 0.3);
}

static void nothing(twin_image *image)
{
    start_image(image, 17, 9, 2);
}

// ---- Programs ------------------------------------------------------------------------------------------

// Declarations that all share. `peel` counts fragments behind `last` and moves `next` to the nearest of them, so
// that a loop over it runs once a layer and once more. `tick` counts iterations at every sample.
static const char head[] = "program conditions\n"
                           "plane last, next depth\n"
                           "plane ticks, rises u32\n"
                           "plane color rgba\n"
                           "query found\nquery risen\nquery ticked\n"
                           "output color\n"
                           "pass peel\n"
                           "    clip z > last\n"
                           "    depth less next\n"
                           "    target color replace premul\n"
                           "    count found\n"
                           "end\n"
                           "kernel tick fullscreen\n"
                           "    ld r0, ticks\n"
                           "    add r0, r0, 1\n"
                           "    st ticks, r0\n"
                           "end\n"
                           "kernel rise fullscreen\n"  // counts in iterations 4 to 7, 12 to 15 ...
                           "    ld r0, ticks\n"
                           "    and r1, r0, 4\n"
                           "    ne p1, r1, 0\n"
                           "    @p1 count risen\n"
                           "end\n"
                           "kernel note fullscreen\n"
                           "    ld r0, rises\n"
                           "    add r0, r0, 1\n"
                           "    st rises, r0\n"
                           "end\n"
                           "kernel visit\n"  // shallow samples fall silent, then speak again
                           "    ld r0, ticks\n"
                           "    and r1, r0, 7\n"
                           "    eq p1, r1, 6\n"
                           "    @p1 count risen\n"
                           "    @p1 st rises, r0\n"
                           "end\n"
                           "kernel first fullscreen\n"  // counts at one level of ticks only
                           "    ld r0, ticks\n"
                           "    eq p1, r0, 0\n"
                           "    @p1 count ticked\n"
                           "end\n";

typedef struct subject {
    const char *name, *text;
} subject;

static const subject subjects[] = {
    {"layer by layer: finished tiles stand still",
     "schedule\n clear last near\n repeat\n reset found\n clear next far\n draw transparent with peel\n"
     " copy last next\n while found\nend\n"},
    {"names change places: the state repeats by name",
     "schedule\n clear last near\n repeat\n reset found\n clear next far\n draw transparent with peel\n"
     " swap last next\n while found\nend\n"},
    {"finished tiles keep changing",
     "schedule\n clear last near\n repeat\n reset found\n clear next far\n draw transparent with peel\n"
     " copy last next\n fullscreen tick\n while found\nend\n"},
    {"a condition inside rises again after it was zero",
     "schedule\n clear last near\n repeat\n reset found\n reset risen\n clear next far\n draw transparent with peel\n"
     " copy last next\n fullscreen tick\n fullscreen rise\n if risen\n fullscreen note\n end\n while found\nend\n"},
    {"fragments speak again after silence",
     "schedule\n clear last near\n repeat\n reset found\n reset risen\n clear next far\n draw transparent with peel\n"
     " copy last next\n fullscreen tick\n draw transparent with visit\n if risen\n draw transparent with peel\n end\n "
     "while found\nend\n"},
    {"a query that is never reset: the limit ends it",
     "limit iterations 23\nschedule\n clear last near\n repeat\n clear next far\n draw transparent with peel\n"
     " copy last next\n while found\nend\n"},
    {"still from the start: the limit ends it",
     "limit iterations 9\nschedule\n fullscreen first\n repeat\n copy last next\n while ticked\nend\n"},
    {"an inner loop in an outer one",
     "limit iterations 6\nschedule\n clear last near\n repeat\n reset risen\n clear last near\n repeat\n reset found\n "
     "clear next far\n"
     " draw transparent with peel\n copy last next\n while found\n fullscreen tick\n fullscreen rise\n while ticked\n"
     " repeat\n reset risen\n fullscreen tick\n fullscreen rise\n while risen\nend\n"},
    {"a loop after a loop with the same query",
     "schedule\n clear last near\n repeat\n reset found\n clear next far\n draw transparent with peel\n copy last "
     "next\n while found\n"
     " clear last near\n repeat\n reset found\n clear next far\n draw transparent with peel\n copy last next\n"
     " if found\n fullscreen tick\n end\n while found\nend\n"},
};

static program *assemble(const char *text)
{
    static char whole[65536];
    program *program;
    const int size = snprintf(whole, sizeof whole, "%s%s", head, text);
    assert_int_equal(assemble_text("conditions", whole, (size_t)size, &printing, &program), STATUS_OK);
    return program;
}

static void check(const program *program, const machine *machine, const char *name)
{
    static void (*const images[])(twin_image *) = {staircase, lonely, two_samples, nothing};
    static const struct {
        uint64_t limit;
        double ratio;
    } ways[] = {{0, -1.0}, {1, -1.0}, {7, -1.0}, {0, 0.05}};
    for (size_t i = 0; i < sizeof images / sizeof *images; i++) {
        twin_image image;
        images[i](&image);
        for (size_t w = 0; w < sizeof ways / sizeof *ways; w++)
            assert_true(same_as_twin(program, machine, &image, ways[w].limit, ways[w].ratio, name));
        random_image_free(&image);
    }
}

static void conditions_equal_twin(void **state)
{
    (void)state;
    machine machine;
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    for (size_t s = 0; s < sizeof subjects / sizeof *subjects; s++) {
        program *program = assemble(subjects[s].text);
        check(program, &machine, subjects[s].name);
        program_destroy(program);
    }
}

static void shipped_programs_equal_twin(void **state)
{
    (void)state;
    static const char *const names[] = {"ideal_coherent_layer_peel_printed.rop", "ideal_coherent_layer_peel.rop",
                                        "layer_peel.rop", "coherent_layer_peel_a.rop"};
    machine machine;
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[4096];
        program *program;
        assert_int_equal(data_path("programs", names[i], path, sizeof path), STATUS_OK);
        assert_int_equal(assemble_file(path, &printing, &program), STATUS_OK);
        check(program, &machine, names[i]);
        program_destroy(program);
    }
}

// P stands still in the inner loop but for a query that only the outer loop asks for: it must grow all the same.
// Q has six layers, so P is visited seven times: above the threshold of 4, which 3 visits would not be.
static void silent_query_grows(void **state)
{
    (void)state;
    twin_image image;
    start_image(&image, 9, 1, 1);
    add(&image, 0, 0, 0, 0.5);
    for (int layer = 1; layer <= 6; layer++)
        add(&image, 8, 0, 0, layer / 8.0);
    char text[4096] = "kernel loud\n ld r0, last\n ld r1, next\n lt p1, r0, z\n @p1 lt p1, z, r1\n @p1 st next, z\n";
    for (int i = 0; i < 10; i++)
        strcat(text, " @p1 count found\n");
    strcat(
        text,
        "end\nkernel tally\n eq p1, primitive, 0\n @p1 count risen\nend\n"
        "schedule\n repeat\n fullscreen tick\n reset risen\n clear last near\n repeat\n reset found\n clear next far\n"
        " draw transparent with loud\n copy last next\n draw transparent with tally\n while found\n while "
        "risen\nend\n");
    machine machine;
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    program *program = assemble(text);
    assert_true(same_as_twin(program, &machine, &image, 12, 0.5, "silent query"));
    random_image_free(&image);
    program_destroy(program);
}

// More conditions in one iteration than are remembered.
static void many_conditions_equal_twin(void **state)
{
    (void)state;
    char text[16384];
    size_t size = (size_t)snprintf(text, sizeof text,
                                   "schedule\n clear last near\n repeat\n reset found\n clear next far\n draw "
                                   "transparent with peel\n copy last next\n");
    for (int i = 0; i < 70; i++)
        size += (size_t)snprintf(text + size, sizeof text - size, " if found\n end\n");
    snprintf(text + size, sizeof text - size, " fullscreen first\n while found\nend\n");
    machine machine;
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    program *program = assemble(text);
    check(program, &machine, "many conditions");
    program_destroy(program);
}

// Many kernels with many `count`: each is heard.
static void many_counts_equal_twin(void **state)
{
    (void)state;
    enum { KERNELS = 20, COUNTS = 60 };
    static char text[65536];
    size_t size = 0;
    for (int k = 0; k < KERNELS; k++) {
        size += (size_t)snprintf(text + size, sizeof text - size, "kernel counts%d fullscreen\n", k);
        for (int i = 0; i < COUNTS; i++)
            size += (size_t)snprintf(text + size, sizeof text - size, " count risen\n");
        size += (size_t)snprintf(text + size, sizeof text - size, "end\n");
    }
    snprintf(text + size, sizeof text - size,
             "schedule\n fullscreen counts%d\n if risen\n fullscreen tick\n end\nend\n", KERNELS - 1);
    machine machine;
    assert_int_equal(machine_load("programmable", NULL, &machine), STATUS_OK);
    program *program = assemble(text);
    twin_image image;
    nothing(&image);
    assert_true(same_as_twin(program, &machine, &image, 0, -1.0, "many counts"));
    random_image_free(&image);
    program_destroy(program);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(conditions_equal_twin),  cmocka_unit_test(shipped_programs_equal_twin),
        cmocka_unit_test(silent_query_grows),     cmocka_unit_test(many_conditions_equal_twin),
        cmocka_unit_test(many_counts_equal_twin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
