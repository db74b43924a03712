// Peak rates of the shipped machines against theory: a pass that asks for one resource alone gets 97 to 100 per cent of
// it, from its start until everything is drained. The table is printed.
#include "cost_fixture.h"

#include <math.h>

#define PROGRAM_HEAD \
    "program peak\nplane z depth\nplane base rgba\nquery seen\n" \
    "blend under rgb add dst_alpha one alpha add zero one_minus_src_alpha\noutput base\n"
#define PROGRAM_TAIL "schedule\nclear z far\nclear base background\ndraw opaque with peak_pass\nend\n"
static const char replace[] = PROGRAM_HEAD "pass peak_pass\ntarget base replace color\nend\n" PROGRAM_TAIL;
static const char blend[] = PROGRAM_HEAD "pass peak_pass\ntarget base under color\nend\n" PROGRAM_TAIL;
static const char depth_only[] = PROGRAM_HEAD "pass peak_pass\ndepth less z\nend\n" PROGRAM_TAIL;
static const char depth_read[] = PROGRAM_HEAD "pass peak_pass\ndepth less z read_only\nend\n" PROGRAM_TAIL;
static const char texture[] = PROGRAM_HEAD "pass peak_pass\nclip z < z\ncount seen\nend\n" PROGRAM_TAIL;
static const char opaque[] = PROGRAM_HEAD "pass peak_pass\ndepth less z\ntarget base replace color\nend\n" PROGRAM_TAIL;
static const char blend_behind[] =
    PROGRAM_HEAD "pass peak_pass\ndepth less z read_only\ntarget base under color\nend\n" PROGRAM_TAIL;
// Eight instructions of one slot each.
static const char kernel[] =
    PROGRAM_HEAD "kernel peak_pass\nld r0, z\nmin r0, r0, z\nadd r1, r0, 1\nadd r1, r1, 1\nadd r1, r1, 1\n"
                 "add r1, r1, 1\nadd r1, r1, 1\nst z, r0\nend\n" PROGRAM_TAIL;

// What a fragment of a full layer asks of the resource.
typedef enum work {
    WORK_PIXELS,
    WORK_SAMPLES,
    WORK_SLOTS,
    WORK_READ_BYTES,
    WORK_WRITTEN_BYTES,
    WORK_CLEARED_BYTES
} work;

typedef struct peak {
    const char *what, *machine, *sets, *program;
    uint32_t width, height, samples, layers;
    work work;
    double rate;  // of the whole chip a core clock
} peak;

// All planes of these images stay in the caches, but for the rows of memory: 96 x 64 pixels are 12 x 8 blocks, on 6
// partitions 16 each. tiny's 16 x 16 pixels are 4 blocks, its 4 lines. Layers are so many that start, latency and
// write-back are below 3 per cent.
static const peak peaks[] = {
    {"colour pixels", "g80", NULL, replace, 96, 64, 1, 96, WORK_PIXELS, 24},
    {"colour samples, 4 a pixel", "g80", NULL, replace, 48, 32, 4, 192, WORK_SAMPLES, 96},
    {"blends of rgba8", "g80", NULL, blend, 96, 64, 1, 48, WORK_SAMPLES, 12},
    {"blends of rgba32f", "g80", "color_format=rgba32f", blend, 96, 32, 1, 96, WORK_SAMPLES, 6},
    {"depth samples", "g80", NULL, depth_only, 96, 64, 1, 200, WORK_SAMPLES, 192},
    {"texture samples", "g80", NULL, texture, 96, 64, 1, 96, WORK_SAMPLES, 32},
    {"kernel slots", "programmable", NULL, kernel, 96, 64, 1, 24, WORK_SLOTS, 6},
    // 6 channels x 16 bytes x 900 MHz / 575 MHz = 150.26 bytes. 768 x 768 pixels of 4 bytes are 9216 lines of 256: no
    // cache holds them. Nothing is compressed, cleared or discarded by blocks, so that all are read; with no fast clear
    // all are written.
    {"DRAM bytes read", "g80", "depth_format=z32f depth_compression=false fast_clear=false hierarchical_depth=false",
     depth_read, 768, 768, 1, 1, WORK_READ_BYTES, 6 * 16 * 900 / 575.0},
    {"DRAM bytes written", "g80", "depth_format=z32f depth_compression=false fast_clear=false", depth_only, 768, 768, 1,
     1, WORK_CLEARED_BYTES, 6 * 16 * 900 / 575.0},
    // 24 pixels of 8 bytes are 192 bytes a clock: more than memory takes.
    {"DRAM bytes written by ROP", "g80", "color_format=rgba16f", replace, 768, 768, 1, 2, WORK_WRITTEN_BYTES,
     6 * 16 * 900 / 575.0},

    {"colour pixels", "tiny", "color_format=rgba8", replace, 16, 16, 1, 200, WORK_PIXELS, 4},
    {"colour samples, 4 a pixel", "tiny", "color_format=rgba8", replace, 8, 8, 4, 200, WORK_SAMPLES, 4},
    {"blends of rgba8", "tiny", "color_format=rgba8", blend, 16, 16, 1, 200, WORK_SAMPLES, 4},
    {"blends of rgba32f", "tiny", "color_cache_bytes=4096", blend, 16, 16, 1, 400, WORK_SAMPLES, 4},
    {"depth samples", "tiny", NULL, depth_only, 16, 16, 1, 200, WORK_SAMPLES, 4},
    // Two operations shade a fragment (read, compare), on four a clock, and one stamp is shaded at a time: that would
    // bind.
    {"texture samples", "tiny", "shader_operations_per_clock=64 shader_queue=64", texture, 16, 16, 1, 200, WORK_SAMPLES,
     4},
    {"kernel slots", "tiny", NULL, kernel, 16, 16, 1, 100, WORK_SLOTS, 1},
    {"DRAM bytes read", "tiny", "fast_clear=false", depth_read, 256, 256, 1, 1, WORK_READ_BYTES, 8},
    {"DRAM bytes written", "tiny", "fast_clear=false", depth_only, 256, 256, 1, 1, WORK_CLEARED_BYTES, 8},

    // 192 x 128 pixels: 16 blocks on each of 24 partitions, so that a quad's next turn comes later than its operation's
    // latency.
    {"colour pixels", "modern", NULL, replace, 192, 128, 1, 96, WORK_PIXELS, 176},
    {"colour samples, 4 a pixel", "modern", NULL, replace, 96, 64, 4, 300, WORK_SAMPLES, 704},
    {"blends of rgba8", "modern", NULL, blend, 192, 128, 1, 96, WORK_SAMPLES, 176},
    {"blends of rgba32f", "modern", "color_format=rgba32f", blend, 192, 64, 1, 64, WORK_SAMPLES, 44},
    {"depth samples", "modern", NULL, depth_only, 192, 128, 1, 400, WORK_SAMPLES, 704},
    {"texture samples", "modern", NULL, texture, 192, 128, 1, 200, WORK_SAMPLES, 512},
    {"kernel slots", "modern", NULL, kernel, 192, 128, 1, 16, WORK_SLOTS, 44},
    // 24 channels x 16 bytes x 2625 MHz / 2520 MHz = 400 bytes.
    {"DRAM bytes read", "modern", "l2_bytes=0 depth_compression=false fast_clear=false hierarchical_depth=false",
     depth_read, 1536, 1536, 1, 1, WORK_READ_BYTES, 400},
    {"DRAM bytes written", "modern", "l2_bytes=0 depth_compression=false fast_clear=false", depth_only, 1536, 1536, 1,
     1, WORK_CLEARED_BYTES, 400},
};

static const pass_record *pass_of_kind(const detail_result *detail, pass_kind kind)
{
    for (uint64_t i = 0; i < detail->pass_count; i++)
        if (detail->passes[i].info.kind == kind)
            return &detail->passes[i];
    fail();
    return NULL;
}

static double per_cent(const peak *peak)
{
    const machine machine = cost_machine(peak->machine, peak->sets);
    box *boxes = cost_layers(peak->width, peak->height, peak->layers, CLASS_OPAQUE);
    box_scene scene = {
        .width = peak->width, .height = peak->height, .samples = peak->samples, .boxes = boxes, .count = peak->layers};
    detail_result *detail = cost_run(peak->program, &machine, &scene);
    const pass_record *pass = pass_of_kind(detail, peak->work == WORK_CLEARED_BYTES ? PASS_CLEAR : PASS_DRAW);
    const double pixels = (double)peak->width * peak->height * peak->layers;
    double work = pixels;
    switch (peak->work) {
    case WORK_PIXELS: break;
    case WORK_SAMPLES: work = pixels * peak->samples; break;
    case WORK_SLOTS: work = pixels / 4 * 8; break;
    case WORK_READ_BYTES:
        work = (double)pass->statistics.memory_bytes_read;
        assert_true(work == pixels * 4);
        break;
    case WORK_WRITTEN_BYTES:
        work = (double)pass->statistics.memory_bytes_written;
        assert_true(work == pixels * 8);
        break;
    case WORK_CLEARED_BYTES:
        work = (double)pass->statistics.memory_bytes_written;
        assert_true(work == pixels * 4);
        break;
    }
    const double got = work / (double)pass->statistics.cycles;
    printf("%-12s %-28s %9.2f a clock of %9.2f  %6.2f %%\n", peak->machine, peak->what, got, peak->rate,
           100 * got / peak->rate);
    detail_destroy(detail);
    free(boxes);
    return 100 * got / peak->rate;
}

static void rates_reach_theory(void **state)
{
    (void)state;
    int missed = 0;
    for (size_t i = 0; i < sizeof peaks / sizeof *peaks; i++) {
        const double share = per_cent(&peaks[i]);
        missed += !(share >= 97 && share <= 100);
    }
    assert_int_equal(missed, 0);
}

// One triangle a quad, each on a quad of its own until all had their turn. Two vertices serve three triangles or so:
// half as many.
static void set_up(const char *name, const char *sets, double rate)
{
    enum { TRIANGLES = 150000, COLUMNS = 12, ROWS = 8, QUADS = 16 };
    static box boxes[TRIANGLES];
    const machine machine = cost_machine(name, sets);
    for (uint32_t i = 0; i < TRIANGLES; i++) {
        const uint32_t block = i % (COLUMNS * ROWS), quad = i / (COLUMNS * ROWS) % QUADS;
        const uint32_t x = block % COLUMNS * 8 + quad % 4 * 2, y = block / COLUMNS * 8 + quad / 4 * 2;
        boxes[i] = (box){x, y, x + 2, y + 2, 1 - (i + 1.0) / (TRIANGLES + 2), CLASS_OPAQUE};
    }
    box_scene scene = {.width = 96,
                       .height = 64,
                       .samples = 1,
                       .boxes = boxes,
                       .count = TRIANGLES,
                       .triangles = TRIANGLES,
                       .vertices = TRIANGLES / 2};
    detail_result *detail = cost_run(depth_only, &machine, &scene);
    const double got = TRIANGLES / (double)cost_draw(detail)->statistics.cycles;
    printf("%-12s %-28s %9.2f a clock of %9.2f  %6.2f %%\n", name, "triangles", got, rate, 100 * got / rate);
    assert_true(100 * got / rate >= 97 && got <= rate);
    detail_destroy(detail);
}

static void triangles_of_g80(void **state)
{
    (void)state;
    set_up("g80", NULL, 1);  // 12 + 24 / 2 bytes a triangle: 24 of the memory's 150
}

static void triangles_of_modern(void **state)
{
    (void)state;
    set_up("modern", NULL, 11);  // 24 bytes each: 264 of 400
}

static void triangles_of_tiny(void **state)
{
    (void)state;
    // 24 bytes a triangle would be three times the memory's 8, and a stamp is 6 cycles in the depth unit: a queue of 4
    // would bind.
    set_up("tiny", "triangle_bytes=0 vertex_bytes=0 depth_cache_bytes=65536 depth_queue=8", 1);
}

// Without compression and fast clears, what memory has to move binds an opaque fill: 24 pixels ask for 4 bytes of depth
// read, 4 written and 4 of colour written, 288 bytes a clock of 150. Each block once: of depth and colour, read only
// where a test or a blend asks for it.
static double balance(const char *program, uint32_t bytes_a_pixel, const char **bound_by)
{
    enum { SIDE = 768, LAYERS = 4 };
    // 32 bits of depth, as the packed format has with its stencil.
    const machine machine =
        cost_machine("g80", "depth_format=z32f depth_compression=false fast_clear=false hierarchical_depth=false");
    box *boxes = cost_layers(SIDE, SIDE, LAYERS, CLASS_OPAQUE);
    box_scene scene = {.width = SIDE, .height = SIDE, .samples = 1, .boxes = boxes, .count = LAYERS};
    detail_result *detail = cost_run(program, &machine, &scene);
    const pass_record *pass = cost_draw(detail);
    const double bytes = (double)(pass->statistics.memory_bytes_read + pass->statistics.memory_bytes_written);
    assert_true(bytes == (double)SIDE * SIDE * LAYERS * bytes_a_pixel);
    const double rate = bytes / (double)pass->statistics.cycles;
    *bound_by = clock_resource_names[pass->bound_by];
    printf("g80          %-28s %9.2f bytes a clock, %.2f pixels, bound by %s\n",
           program == opaque ? "opaque fill" : "blended fill", rate, rate / bytes_a_pixel, *bound_by);
    detail_destroy(detail);
    free(boxes);
    return rate;
}

static void opaque_fill_is_bound_by_memory(void **state)
{
    (void)state;
    const char *bound_by;
    const double rate = balance(opaque, 12, &bound_by);
    assert_string_equal(bound_by, "memory");
    assert_true(rate <= 150.26 && rate >= 0.88 * 150.26);  // below the peak by the turns between reads and writes
}

// 12 blends ask for 4 bytes of depth read, 4 of colour read and 4 written: 144 bytes of 150, so that both are near
// their bounds.
static void blending_is_balanced(void **state)
{
    (void)state;
    const char *bound_by;
    const double rate = balance(blend_behind, 12, &bound_by);
    assert_true(rate <= 144 && rate >= 0.95 * 144);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rates_reach_theory),   cmocka_unit_test(opaque_fill_is_bound_by_memory),
        cmocka_unit_test(blending_is_balanced), cmocka_unit_test(triangles_of_g80),
        cmocka_unit_test(triangles_of_modern),  cmocka_unit_test(triangles_of_tiny),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
