// Visibility ordering: small cases with their answers beside them, limits, and what it refuses.
#include "order_fixture.h"

#include <unistd.h>

static const order_options one_thread = {.threads = 1};

static void expect_layer(const order_result *result, uint32_t primitive, uint32_t layer)
{
    const order_primitive *p = find_primitive(result, 0, primitive);
    assert_non_null(p);
    assert_int_equal(p->place, PLACE_LAYER);
    assert_int_equal(p->layer, layer);
}

static void expect_place(const order_result *result, uint32_t primitive, order_place place)
{
    const order_primitive *p = find_primitive(result, 0, primitive);
    assert_non_null(p);
    assert_int_equal(p->place, place);
}

// ---- The two rules -------------------------------------------------------------------------------------

// 0 covers 1, which covers 2, all at pixel 0, and 3 covers 0 at pixel 3. The paper's rule takes 2 and 0 out in one
// pass; nobody is left then to say that 1 is covered.
static const order_fragment cover_goes_back[] = {
    {0, 0, 0, 0, 0.2, 0}, {0, 3, 0, 0, 0.3, 0}, {0, 0, 0, 0, 0.4, 1}, {0, 1, 0, 0, 0.4, 1},
    {0, 0, 0, 0, 0.6, 2}, {0, 2, 0, 0, 0.6, 2}, {0, 3, 0, 0, 0.1, 3},
};

static void a_cover_that_goes_back_still_covers(void **state)
{
    (void)state;
    const order_scene scene = ROW_SCENE(4, cover_goes_back);
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_layer(result, 3, 0);
    expect_layer(result, 0, 1);
    expect_layer(result, 1, 2);
    expect_layer(result, 2, 3);
    assert_int_equal(result->pairs, 3);
    assert_int_equal(result->pairs_wrong, 0);
    order_destroy(result);
}

static void the_printed_rule_misses_it(void **state)
{
    (void)state;
    const order_scene scene = ROW_SCENE(4, cover_goes_back);
    order_result *result = scene_ordered(&scene, &(order_options){.threads = 1, .printed = true});
    expect_layer(result, 3, 0);
    expect_layer(result, 1, 0);  // behind 0
    expect_layer(result, 0, 1);
    expect_layer(result, 2, 2);
    assert_int_equal(result->pairs_wrong, 1);
    order_destroy(result);
}

// Figure 1 of the paper: A covers parts of B and of C; B lies in front of C wherever it is.
static void figure_1_takes_three_layers(void **state)
{
    (void)state;
    enum { A, B, C };
    const order_fragment table[] = {
        {0, 0, 0, 0, 0.6, C}, {0, 0, 0, 0, 0.5, B}, {0, 0, 0, 0, 0.1, A}, {0, 1, 0, 0, 0.6, C},
        {0, 1, 0, 0, 0.5, B}, {0, 2, 0, 0, 0.6, C}, {0, 2, 0, 0, 0.1, A}, {0, 3, 0, 0, 0.6, C},
    };
    const order_scene scene = ROW_SCENE(4, table);
    for (int printed = 0; printed < 2; printed++) {
        order_result *result = scene_ordered(&scene, &(order_options){.threads = 1, .printed = printed});
        expect_layer(result, A, 0);
        expect_layer(result, B, 1);
        expect_layer(result, C, 2);
        assert_int_equal(result->item_passes, 3);
        assert_int_equal(result->complexity_passes_most, 2);  // C, then B, goes back
        assert_int_equal(result->pairs_wrong, 0);
        order_destroy(result);
    }
}

// ---- Cycles, ties, overlaps with itself, primitives that are nowhere ---------------------------------------

static void cycles_are_named_and_so_is_what_lies_behind_them(void **state)
{
    (void)state;
    const order_fragment table[] = {
        {0, 0, 0, 0, 0.1, 9},                        // in front of all
        {0, 0, 0, 0, 0.2, 0}, {0, 0, 0, 0, 0.3, 1},  // 0 in front of 1
        {0, 1, 0, 0, 0.2, 1}, {0, 1, 0, 0, 0.3, 2},  // 1 of 2
        {0, 2, 0, 0, 0.2, 2}, {0, 2, 0, 0, 0.3, 0},  // 2 of 0
        {0, 2, 0, 0, 0.4, 7}, {0, 3, 0, 0, 0.4, 5},  // 7 behind the cycle, 5 alone
    };
    const order_scene scene = ROW_SCENE(4, table);
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_layer(result, 9, 0);
    expect_layer(result, 5, 0);
    expect_place(result, 0, PLACE_CYCLE);
    expect_place(result, 1, PLACE_CYCLE);
    expect_place(result, 2, PLACE_CYCLE);
    expect_place(result, 7, PLACE_BEHIND);
    assert_int_equal(result->layer_count, 1);
    assert_int_equal(result->item_passes, 2);  // the second makes no progress
    order_destroy(result);
}

static void equal_depths_count_in_order_of_arrival(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.5, 4}, {0, 0, 0, 0, 0.5, 2}, {0, 0, 0, 0, 0.5, 3}};
    const order_scene scene = ROW_SCENE(1, table);
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_layer(result, 4, 0);
    expect_layer(result, 2, 1);
    expect_layer(result, 3, 2);
    order_destroy(result);
}

static void a_primitive_twice_at_a_sample_is_a_cycle_of_one(void **state)
{
    (void)state;
    const order_fragment table[] = {
        {0, 0, 0, 0, 0.1, 0}, {0, 0, 0, 0, 0.2, 0}, {0, 0, 0, 0, 0.3, 1}, {0, 1, 0, 0, 0.5, 2}};
    const order_scene scene = ROW_SCENE(2, table);
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_place(result, 0, PLACE_CYCLE);
    expect_place(result, 1, PLACE_BEHIND);
    expect_layer(result, 2, 0);
    order_destroy(result);
}

static void the_near_and_the_far_plane_and_beyond_have_their_place(void **state)
{
    (void)state;
    const order_fragment table[] = {
        {0, 0, 0, 0, 1.0, 0}, {0, 0, 0, 0, 7.0, 1}, {0, 0, 0, 0, 0.0, 2}, {0, 1, 0, 0, 1.0, 3}, {0, 0, 0, 0, -1.0, 4},
    };
    const order_scene scene = ROW_SCENE(2, table);
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_layer(result, 2, 0);  // -1 is clamped to 0: a tie, and 2 came first
    expect_layer(result, 4, 1);
    expect_layer(result, 0, 2);
    expect_layer(result, 1, 3);
    expect_layer(result, 3, 0);
    assert_int_equal(result->pairs_wrong, 0);
    order_destroy(result);
}

static void who_covers_no_sample_is_named_where_numbers_tell(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.1, 1}, {1, 0, 0, 0, 0.2, 3}, {2, 0, 0, 0, 0.3, 40}};
    const order_scene scene = {.width = 1,
                               .height = 1,
                               .samples = 1,
                               .draw_count = 3,
                               .classes = {CLASS_OPAQUE, CLASS_TRANSPARENT, CLASS_SORTED},
                               .triangles = {3, 3, 5},
                               .fragments = table,
                               .count = 3};
    order_result *result = scene_ordered(&scene, &one_thread);
    // Draw 0 is opaque: no part of the order, but its numbers count. Draw 1 has 3, 4 and 5. Draw 2 is not numbered on.
    assert_int_equal(result->primitive_count, 4);
    assert_int_equal(find_primitive(result, 1, 3)->layer, 0);
    assert_int_equal(find_primitive(result, 2, 40)->layer, 1);
    assert_int_equal(find_primitive(result, 1, 4)->place, PLACE_NOWHERE);
    assert_int_equal(find_primitive(result, 1, 5)->place, PLACE_NOWHERE);
    assert_int_equal(result->nowhere_unnamed, 4);
    order_destroy(result);
}

static void absurd_numbers_of_triangles_are_counted_not_listed(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.1, 0}, {1, 0, 0, 0, 0.1, 0}};
    const order_scene scene = {.width = 1,
                               .height = 1,
                               .samples = 1,
                               .draw_count = 2,
                               .classes = {CLASS_TRANSPARENT, CLASS_TRANSPARENT},
                               .triangles = {UINT64_MAX, UINT64_MAX},
                               .fragments = table,
                               .count = 2};
    order_result *result = scene_ordered(&scene, &one_thread);
    assert_int_equal(result->primitive_count, 2);
    assert_int_equal(result->nowhere_unnamed, INT64_MAX);
    order_destroy(result);
}

static void nothing_transparent_is_no_layer(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.1, 0}};
    order_scene scene = ROW_SCENE(1, table);
    scene.classes[0] = CLASS_OPAQUE;
    for (int empty = 0; empty < 2; empty++) {
        order_result *result = scene_ordered(&scene, &one_thread);
        assert_int_equal(result->primitive_count, 0);
        assert_int_equal(result->item_passes + result->complexity_passes, 0);
        assert_int_equal(result->whole.bytes_read, 0);
        order_destroy(result);
        scene.draw_count = 0;
        scene.count = 0;
    }
}

// ---- The stencil ---------------------------------------------------------------------------------------

// 0 in front of 1 in front of 2 ... at pixel 0, each also alone at a pixel of its own; if asked for, the last in front
// of 1.
static order_fragment *stack(uint32_t count, bool cyclic, size_t *fragment_count)
{
    order_fragment *table = calloc(2 * (size_t)count + 2, sizeof *table);
    assert_non_null(table);
    size_t at = 0;
    for (uint32_t i = 0; i < count; i++) {
        table[at++] = (order_fragment){0, 0, 0, 0, (i + 1.0) / 1024, i};
        table[at++] = (order_fragment){0, i + 1, 0, 0, 0.5, i};
    }
    if (cyclic) {
        table[at++] = (order_fragment){0, count + 1, 0, 0, 0.25, count - 1};
        table[at++] = (order_fragment){0, count + 1, 0, 0, 0.5, 1};
    }
    *fragment_count = at;
    return table;
}

// A count that stands at its limit still exceeds two.
static void a_stencil_of_two_bits_is_enough(void **state)
{
    (void)state;
    messages said;
    order_result *result;
    order_scene scene = {.width = 10, .height = 1, .samples = 1, .draw_count = 1, .classes = {CLASS_TRANSPARENT}};
    order_fragment *table = stack(9, false, &scene.count);
    scene.fragments = table;
    assert_int_equal(scene_order(&scene, "programmable", "stencil_bits=2", &one_thread, &said, &result), STATUS_OK);
    for (uint32_t i = 0; i < 9; i++)
        expect_layer(result, i, i);
    assert_int_equal(result->complexity_passes_most, 8);
    order_destroy(result);
    assert_int_equal(scene_order(&scene, "programmable", "stencil_bits=1", &one_thread, &said, &result),
                     STATUS_REFUSED);
    assert_non_null(strstr(said.text, "stencil of 1 bit"));
    free(table);
}

static void more_overlaps_than_the_stencil_counts_do_no_harm(void **state)
{
    (void)state;
    enum { COUNT = 300 };
    order_scene scene = {
        .width = COUNT + 2, .height = 1, .samples = 1, .draw_count = 1, .classes = {CLASS_TRANSPARENT}};
    order_fragment *table = stack(COUNT, true, &scene.count);
    scene.fragments = table;
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_layer(result, 0, 0);
    assert_int_equal(result->place_counts[PLACE_CYCLE], COUNT - 1);
    assert_int_equal(result->item_passes, 2);
    assert_int_equal(result->complexity_passes_most, COUNT - 2);  // the first sends two back, 1 and the last
    order_destroy(result);
    free(table);
}

// ---- Blocks --------------------------------------------------------------------------------------------

// Pixels 0 and 1 have two layers, 2 one, 3 none. Each pass reads what the last item buffer covered.
static void blocks_without_a_primitive_are_not_read_again(void **state)
{
    (void)state;
    const order_fragment table[] = {
        {0, 0, 0, 0, 0.1, 0}, {0, 1, 0, 0, 0.1, 0}, {0, 2, 0, 0, 0.1, 0}, {0, 0, 0, 0, 0.2, 1}, {0, 1, 0, 0, 0.2, 1},
    };
    const order_scene scene = ROW_SCENE(4, table);
    order_result *result = scene_ordered(&scene, &(order_options){.threads = 1, .block_pixels = 1});
    assert_int_equal(result->item_passes, 2);
    assert_int_equal(result->complexity_passes, 2);
    assert_int_equal(result->whole.samples_scanned, 4 * 4);
    assert_int_equal(result->whole.bytes_read, 2 * 4 * 4 + 2 * 4 * 5);
    assert_int_equal(result->blocks.samples_scanned, 4 + 3 + 3 + 2);
    assert_int_equal(result->blocks.bytes_read, (4 + 3) * 4 + (3 + 2) * 5);
    order_destroy(result);
    result = scene_ordered(&scene, &(order_options){.threads = 1, .block_pixels = 3});  // pixels 0 to 2, and 3
    assert_int_equal(result->blocks.samples_scanned, 4 + 3 + 3 + 3);
    order_destroy(result);
    result = scene_ordered(&scene, &one_thread);  // the whole image
    assert_memory_equal(&result->blocks, &result->whole, sizeof result->whole);
    order_destroy(result);
}

// ---- Depth formats, refusals, files ---------------------------------------------------------------------

static void depths_that_the_machine_cannot_tell_apart_are_reported(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.500001, 0}, {0, 0, 0, 0, 0.5, 1}};
    const order_scene scene = ROW_SCENE(1, table);
    messages said;
    order_result *result;
    for (int z16 = 0; z16 < 2; z16++) {
        assert_int_equal(
            scene_order(&scene, "programmable", z16 ? "depth_format=z16" : NULL, &one_thread, &said, &result),
            STATUS_OK);
        expect_layer(result, 1, z16 ? 1 : 0);
        assert_int_equal(result->pairs_wrong, z16);
        order_destroy(result);
    }
}

static void machines_and_budgets_that_do_not_do_are_refused(void **state)
{
    (void)state;
    const order_fragment table[] = {{0, 0, 0, 0, 0.5, 1}};
    const order_scene scene = ROW_SCENE(1, table);
    messages said;
    order_result *result;
    assert_int_equal(scene_order(&scene, "g80", NULL, &one_thread, &said, &result), STATUS_REFUSED);
    assert_null(result);
    assert_non_null(strstr(said.text, "no programmable ROP"));
    const order_options tight = {.threads = 1, .memory_bytes = 8};
    assert_int_equal(scene_order(&scene, "programmable", NULL, &tight, &said, &result), STATUS_REFUSED);
    assert_null(result);
    assert_non_null(strstr(said.text, "budget"));
}

static void expect_file(const order_result *result, const char *text)
{
    char path[] = "/tmp/ropsim-order-XXXXXX", read[256] = {0};
    const int descriptor = mkstemp(path);
    assert_true(descriptor >= 0);
    close(descriptor);
    assert_int_equal(order_write(result, path, NULL), STATUS_OK);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_true(fread(read, 1, sizeof read - 1, file) > 0);
    fclose(file);
    unlink(path);
    assert_string_equal(read, text);
}

static void lines_are_number_layer_and_draw_where_needed(void **state)
{
    (void)state;
    const order_fragment table[] = {
        {0, 0, 0, 0, 0.5, 1}, {0, 1, 0, 0, 0.1, 7}, {1, 0, 0, 0, 0.2, 3}, {1, 1, 0, 0, 0.2, 7}};
    order_scene scene = {.width = 2,
                         .height = 1,
                         .samples = 1,
                         .draw_count = 2,
                         .classes = {CLASS_TRANSPARENT, CLASS_SORTED},
                         .fragments = table,
                         .count = 3};
    order_result *result = scene_ordered(&scene, &one_thread);
    expect_file(result, "7 0\n3 0\n1 1\n");
    order_destroy(result);
    scene.count = 4;
    result = scene_ordered(&scene, &one_thread);
    expect_file(result, "7 0 0\n3 0 1\n1 1 0\n7 1 1\n");
    messages said;
    messages_start(&said);
    assert_int_equal(order_write(result, "/no/such/folder/order.txt", &said.report), STATUS_IO);
    assert_int_equal(order_write_json(result, "a\xff", "/tmp/never", &said.report), STATUS_REFUSED);
    assert_non_null(strstr(said.text, "UTF-8"));
    order_destroy(result);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cover_that_goes_back_still_covers),
        cmocka_unit_test(the_printed_rule_misses_it),
        cmocka_unit_test(figure_1_takes_three_layers),
        cmocka_unit_test(cycles_are_named_and_so_is_what_lies_behind_them),
        cmocka_unit_test(equal_depths_count_in_order_of_arrival),
        cmocka_unit_test(a_primitive_twice_at_a_sample_is_a_cycle_of_one),
        cmocka_unit_test(the_near_and_the_far_plane_and_beyond_have_their_place),
        cmocka_unit_test(who_covers_no_sample_is_named_where_numbers_tell),
        cmocka_unit_test(absurd_numbers_of_triangles_are_counted_not_listed),
        cmocka_unit_test(nothing_transparent_is_no_layer),
        cmocka_unit_test(a_stencil_of_two_bits_is_enough),
        cmocka_unit_test(more_overlaps_than_the_stencil_counts_do_no_harm),
        cmocka_unit_test(blocks_without_a_primitive_are_not_read_again),
        cmocka_unit_test(depths_that_the_machine_cannot_tell_apart_are_reported),
        cmocka_unit_test(machines_and_budgets_that_do_not_do_are_refused),
        cmocka_unit_test(lines_are_number_layer_and_draw_where_needed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
