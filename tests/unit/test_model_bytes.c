// Bytes that shipped traces move on tiny, by pass and by plane, worked out by hand from the rules of docs/machine.md.
//
// The images are one block: pixels 0 to 3 of its first row. A depth plane's block is a line of 256 bytes, a colour
// plane's four of 16 samples, of which the first holds all pixels. Caches hold four lines: nothing is replaced. What a
// clear has marked is read for nothing and written back whole; what memory holds already goes back in bursts of 8
// bytes. Nothing is compressed.
#include "cost_fixture.h"

enum { LINE = 256, PASSES_MAX = 32 };

typedef struct pass_bytes {
    pass_kind kind;
    const char *name;
    uint64_t geometry, read, written;
} pass_bytes;
typedef struct plane_bytes {
    const char *name;
    uint64_t read, written;
} plane_bytes;

static void check(const char *trace_name, const char *program_name, const pass_bytes *passes, uint64_t pass_count,
                  const plane_bytes *planes, int plane_count)
{
    char path[4096];
    program *program = NULL;
    trace *trace = NULL;
    const machine machine = cost_machine("tiny", NULL);
    assert_int_equal(program_load(program_name, NULL, path, sizeof path, &program), STATUS_OK);
    snprintf(path, sizeof path, "%s/traces/%s.rtxt", ROPSIM_SOURCE, trace_name);
    assert_int_equal(trace_open(path, NULL, &trace), STATUS_OK);
    detail_result *detail = cost_trace_at(program, &machine, trace, DETAIL_TRAFFIC);
    uint64_t read = 0, written = 0, at = 0;
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        const pass_record *pass = &detail->passes[i];
        if (pass->info.kind == PASS_CLEAR) {  // marked, on tiny
            assert_int_equal(pass->statistics.memory_bytes_read + pass->statistics.memory_bytes_written, 0);
            continue;
        }
        assert_true(at < pass_count);
        const pass_bytes *wanted = &passes[at++];
        if (pass->info.kind != wanted->kind || strcmp(pass->info.name, wanted->name) ||
            pass->statistics.geometry_bytes != wanted->geometry ||
            pass->statistics.memory_bytes_read != wanted->geometry + wanted->read ||
            pass->statistics.memory_bytes_written != wanted->written)
            fail_msg("%s, pass %d, %s: %d bytes of geometry, %d read, %d written", trace_name, (int)at, pass->info.name,
                     (int)pass->statistics.geometry_bytes, (int)pass->statistics.memory_bytes_read,
                     (int)pass->statistics.memory_bytes_written);
        read += wanted->geometry + wanted->read;
        written += wanted->written;
    }
    assert_int_equal(at, pass_count);
    assert_int_equal(detail->total.memory_bytes_read, read);
    assert_int_equal(detail->total.memory_bytes_written, written);
    assert_int_equal(detail->plane_count, plane_count);
    for (int i = 0; i < plane_count; i++) {
        assert_string_equal(detail->plane_names[i], planes[i].name);
        if (detail->planes[i].read != planes[i].read || detail->planes[i].written != planes[i].written)
            fail_msg("%s, plane %s: %d bytes read, %d written", trace_name, planes[i].name, (int)detail->planes[i].read,
                     (int)detail->planes[i].written);
    }
    detail_destroy(detail);
    trace_close(trace);
    program_destroy(program);
}

// Geometry: 2 triangles and 4 vertices of the floor are 2 x 12 + 4 x 24 = 120 bytes, those of the glass 12 + 3 x 24 =
// 84: a line each. The floor leaves a line of z_opaque and of base. `nearest` reads z_peel, marked, and z_opaque as
// textures, which start empty in each pass, and fills z_next; it is in the depth cache still when `composite` reads it,
// and z_opaque is read again. In iteration 2 no fragment lies beyond z_peel, the storage that was z_next; both maps of
// a range clip are read for every fragment all the same.
static void opaque_peeled(void **state)
{
    (void)state;
    const pass_bytes passes[] = {
        {PASS_DRAW, "opaque", LINE, 0, 2 * LINE},
        {PASS_DRAW, "nearest", LINE, LINE, LINE},
        {PASS_DRAW, "composite", LINE, LINE, LINE},
        {PASS_DRAW, "nearest", LINE, 2 * LINE, 0},
    };
    const plane_bytes planes[] = {
        {"z_opaque", 3 * LINE, LINE}, {"z_peel", 0, 0}, {"z_next", LINE, LINE}, {"front", 0, LINE}, {"base", 0, LINE}};
    check("opaque", "layer_peel", passes, 4, planes, 5);
}

// No opaque draw: z_opaque stays marked. Iteration 1 takes the nearest of pixels 0 to 2, iteration 2 the tie of pixel 2
// at 0.5, iteration 3 none. The storages of z_peel and z_next change places, and what is peeled next is read back once
// an iteration. `front` is in the colour cache from iteration 1 on; of it, iteration 2 changes one sample of 16 bytes.
static void ties_peeled(void **state)
{
    (void)state;
    const pass_bytes passes[] = {
        {PASS_DRAW, "opaque", 0, 0, 0},        {PASS_DRAW, "nearest", 0, 0, LINE}, {PASS_DRAW, "composite", 0, 0, LINE},
        {PASS_DRAW, "nearest", 0, LINE, LINE}, {PASS_DRAW, "composite", 0, 0, 16}, {PASS_DRAW, "nearest", 0, LINE, 0},
    };
    const plane_bytes planes[] = {
        {"z_opaque", 0, 0}, {"z_peel", LINE, LINE}, {"z_next", LINE, LINE}, {"front", 0, LINE + 16}, {"base", 0, 0}};
    check("ties", "layer_peel", passes, 6, planes, 5);
}

// One pass over four stamps: z_opaque is marked and only read, front is filled from its mark and written back once.
static void classes_blended(void **state)
{
    (void)state;
    const pass_bytes passes[] = {{PASS_DRAW, "opaque", 0, 0, 0}, {PASS_DRAW, "composite", 0, 0, LINE}};
    const plane_bytes planes[] = {{"z_opaque", 0, 0}, {"front", 0, LINE}, {"base", 0, 0}};
    check("classes", "sorted_blend", passes, 2, planes, 3);
}

// A full-screen pass at the end: reads sums and base as textures, base marked, and writes picture. Four pixels of
// `picture` were never cleared, so that memory holds them: none is fetched, and 4 x 16 bytes go back. A block of four
// samples a pixel has its one pixel's samples in the first line: the same.
static void sums_and_a_full_screen_pass(void **state)
{
    (void)state;
    const pass_bytes passes[] = {{PASS_DRAW, "opaque", 0, 0, 0},
                                 {PASS_DRAW, "accumulate", 0, 0, LINE},
                                 {PASS_FULLSCREEN, "finish", 0, LINE, 64}};
    const plane_bytes planes[] = {{"z_opaque", 0, 0}, {"sums", LINE, LINE}, {"base", 0, 0}, {"picture", 0, 64}};
    check("ties", "weighted_sum", passes, 3, planes, 4);
    check("edge_samples", "weighted_sum", passes, 3, planes, 4);
}

// An image without draws moves nothing.
static void nothing_moves_nothing(void **state)
{
    (void)state;
    const pass_bytes passes[] = {{PASS_DRAW, "opaque", 0, 0, 0}, {PASS_DRAW, "nearest", 0, 0, 0}};
    const plane_bytes planes[] = {
        {"z_opaque", 0, 0}, {"z_peel", 0, 0}, {"z_next", 0, 0}, {"front", 0, 0}, {"base", 0, 0}};
    check("empty", "layer_peel", passes, 2, planes, 5);
}

// A copy reads one plane's line and writes another's: 10 x 8 pixels are two blocks, the second of 2 x 8 pixels. `front`
// was never cleared: of the second block 2 of 8 samples in each of 8 rows are read whole, 256 bytes, and of 4 bytes
// each 8 bursts are written.
static void a_copy(void **state)
{
    (void)state;
    static const char text[] =
        "program copies\nplane a, b depth\nplane base rgba\noutput base\npass first\ndepth less a\nend\nschedule\n"
        "copy a b\ndraw opaque with first\nend\n";
    const box boxes[] = {{0, 0, 1, 1, 0.5, CLASS_OPAQUE}};
    const machine machine = cost_machine("tiny", NULL);
    box_scene scene = {.width = 10, .height = 8, .samples = 1, .boxes = boxes, .count = 1};
    detail_result *detail = cost_run(text, &machine, &scene);
    const pass_record *pass = &detail->passes[0];
    assert_int_equal(pass->info.kind, PASS_COPY);
    assert_int_equal(pass->statistics.memory_bytes_read, 2 * LINE);
    assert_int_equal(pass->statistics.memory_bytes_written, LINE + 8 * 8);
    detail_destroy(detail);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(opaque_peeled),         cmocka_unit_test(ties_peeled),
        cmocka_unit_test(classes_blended),       cmocka_unit_test(sums_and_a_full_screen_pass),
        cmocka_unit_test(nothing_moves_nothing), cmocka_unit_test(a_copy),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
