// Visibility ordering of recorded scenes and meshes, held against every sample of the trace: a layer is the longest
// chain of primitives in front, no more and no less. Meshes that are not there are skipped.
#include "order_fixture.h"

#include <unistd.h>

typedef struct sample_fragment {
    uint64_t sample;
    double depth;
    uint64_t arrival;
    uint32_t primitive;
} sample_fragment;

static int front_first(const void *a, const void *b)
{
    const sample_fragment *x = a, *y = b;
    if (x->sample != y->sample)
        return x->sample < y->sample ? -1 : 1;
    if (x->depth != y->depth)
        return x->depth < y->depth ? -1 : 1;
    return x->arrival < y->arrival ? -1 : 1;
}

static sample_fragment *sorted_fragments(trace *trace, size_t *count)
{
    const trace_info *info = trace_get_info(trace);
    sample_fragment *sorted = malloc((info->fragment_count + 1) * sizeof *sorted);
    assert_non_null(sorted);
    *count = 0;
    for (fragments run; trace_next(trace, &run) == STATUS_OK && run.count;) {
        for (uint32_t i = 0; i < run.count; i++, ++*count)
            sorted[*count] =
                (sample_fragment){((uint64_t)run.y[i] * info->width + run.x[i]) * info->samples + run.sample[i],
                                  run.depth[i], *count, run.primitive[i]};
    }
    assert_int_equal(*count, info->fragment_count);
    qsort(sorted, *count, sizeof *sorted, front_first);
    return sorted;
}

// Recorded primitives are numbered through: the result as an array by number.
static const order_primitive **by_number(const order_result *result)
{
    const order_primitive **numbers = calloc(result->primitive_count + 1, sizeof *numbers);
    assert_non_null(numbers);
    for (uint64_t i = 0; i < result->primitive_count; i++) {
        assert_true(result->primitives[i].primitive < result->primitive_count);
        numbers[result->primitives[i].primitive] = &result->primitives[i];
    }
    return numbers;
}

static void expect_longest_chains(trace *trace, const order_result *result)
{
    size_t count;
    sample_fragment *sorted = sorted_fragments(trace, &count);
    const order_primitive **numbers = by_number(result);
    uint32_t *longest = calloc(result->primitive_count + 1, sizeof *longest);  // 1 + the last layer in front of it
    bool *blocked = calloc(result->primitive_count + 1, sizeof *blocked);      // one without a layer is in front of it
    assert_true(longest && blocked);
    uint32_t before = 0;
    bool stuck = false;
    for (size_t i = 0; i < count; i++) {
        if (i == 0 || sorted[i].sample != sorted[i - 1].sample) {
            before = 0;
            stuck = false;
        }
        const uint32_t number = sorted[i].primitive;
        const order_primitive *p = numbers[number];
        assert_non_null(p);
        assert_int_not_equal(p->place, PLACE_NOWHERE);
        longest[number] = before > longest[number] ? before : longest[number];
        blocked[number] |= stuck;
        if (p->place == PLACE_LAYER && p->layer + 1 > before)
            before = p->layer + 1;
        stuck |= p->place != PLACE_LAYER;
    }
    for (uint64_t i = 0; i < result->primitive_count; i++) {
        if (numbers[i]->place == PLACE_LAYER) {
            assert_int_equal(numbers[i]->layer, longest[i]);
            assert_false(blocked[i]);
        } else if (numbers[i]->place != PLACE_NOWHERE) {
            assert_true(blocked[i]);
        }
    }
    free(blocked);
    free(longest);
    free(numbers);
    free(sorted);
}

// Records `scene` as seen from `direction` (NULL: as fitted), orders it, checks it. Free with order_destroy.
static order_result *order_scene_of(const char *scene, uint32_t pixels, uint32_t samples, const double direction[3])
{
    char folder[] = "/tmp/ropsim-order-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/trace.ropt", folder);
    messages said;
    messages_start(&said);
    record_options options;
    record_defaults(&options);
    options.width = options.height = pixels;
    options.samples = samples;
    for (int i = 0; direction && i < 3; i++)
        options.camera.eye[i] = direction[i];
    options.camera.eye_set = direction;
    machine machine;
    trace *trace;
    order_result *result;
    if (record_scenes(&scene, 1, &options, path, &said.report) != STATUS_OK ||
        machine_load("programmable", &said.report, &machine) != STATUS_OK ||
        trace_open(path, &said.report, &trace) != STATUS_OK ||
        order_run(trace, &machine, &(order_options){.threads = 2, .block_pixels = 32}, &said.report, &result) !=
            STATUS_OK) {
        fail_msg("%s: %s", scene, said.text);
        return NULL;
    }
    expect_longest_chains(trace, result);
    assert_int_equal(result->pairs_wrong, 0);
    print_message("%s: %u layers, %llu in order, %llu cyclic, %llu behind, %llu + %llu passes\n",
                  strrchr(scene, '/') ? strrchr(scene, '/') + 1 : scene, result->layer_count,
                  (unsigned long long)result->place_counts[PLACE_LAYER],
                  (unsigned long long)result->place_counts[PLACE_CYCLE],
                  (unsigned long long)result->place_counts[PLACE_BEHIND], (unsigned long long)result->item_passes,
                  (unsigned long long)result->complexity_passes);
    trace_close(trace);
    unlink(path);
    rmdir(folder);
    return result;
}

static void sheets_take_a_layer_each(void **state)
{
    (void)state;
    static const char *const scenes[] = {"scene:sheets,count=12,order=shuffled",
                                         "scene:sheets,count=12,order=reversed"};
    for (int i = 0; i < 2; i++) {
        order_result *result = order_scene_of(scenes[i], 64, 1, NULL);
        assert_int_equal(result->layer_count, 12);
        assert_int_equal(result->item_passes, 12);
        assert_int_equal(result->complexity_passes, 12);  // one candidate: nothing goes back
        order_destroy(result);
    }
}

static void a_closed_surface_is_taken_whole(void **state)
{
    (void)state;
    for (uint32_t samples = 1; samples <= 4; samples *= 4) {
        order_result *result = order_scene_of("scene:knot", 128, samples, NULL);
        assert_int_equal(result->place_counts[PLACE_CYCLE], 0);
        assert_int_equal(result->primitive_count, 18432);
        assert_true(result->layer_count >= 4);
        assert_true(result->blocks.bytes_read < result->whole.bytes_read);
        order_destroy(result);
    }
}

static void triangles_that_cut_each_other_are_cyclic(void **state)
{
    (void)state;
    order_result *result = order_scene_of("scene:soup", 96, 1, NULL);
    assert_true(result->place_counts[PLACE_CYCLE] > 900);
    order_destroy(result);
}

static void order_mesh(const char *path, const double direction[3], bool cyclic)
{
    if (access(path, R_OK) != 0) {
        print_message("%s is not there\n", path);
        skip();
    }
    order_result *result = order_scene_of(path, 256, 1, direction);
    assert_int_equal(result->place_counts[PLACE_CYCLE] > 0, cyclic);
    order_destroy(result);
}

static void the_bunny_has_no_cycle(void **state)
{
    (void)state;
    order_mesh("/usr/share/glmark2/models/bunny.obj", NULL, false);
}

#define SHARED ROPSIM_SOURCE "/../shared/models/"

static void the_mannequin_has_no_cycle(void **state)
{
    (void)state;
    order_mesh(SHARED "mannequin.ply", NULL, false);
}

static void the_sphere_has_two_layers(void **state)
{
    (void)state;
    order_mesh(SHARED "sphere966.ply", NULL, false);
}

// Its parts cut each other.
static void the_bones_have_cycles(void **state)
{
    (void)state;
    order_mesh(SHARED "bones.ply", NULL, true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sheets_take_a_layer_each),
        cmocka_unit_test(a_closed_surface_is_taken_whole),
        cmocka_unit_test(triangles_that_cut_each_other_are_cyclic),
        cmocka_unit_test(the_bunny_has_no_cycle),
        cmocka_unit_test(the_mannequin_has_no_cycle),
        cmocka_unit_test(the_sphere_has_two_layers),
        cmocka_unit_test(the_bones_have_cycles),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
