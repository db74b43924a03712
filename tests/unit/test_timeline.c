// A timeline read back by jansson: names, order, nesting, and cycles that stay apart.
#include "messages.h"

#include "../../sim/levels.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <jansson.h>
#include <stdlib.h>
#include <unistd.h>

static char path[] = "/tmp/ropsim_timeline_XXXXXX.json";

static timeline *opened(int64_t core_mhz)
{
    machine machine;
    timeline *timeline = NULL;
    assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
    machine.core_mhz = core_mhz;
    assert_int_equal(timeline_open(path, &machine, NULL, &timeline), STATUS_OK);
    return timeline;
}

static json_t *read_back(timeline *timeline)
{
    json_error_t error;
    assert_int_equal(timeline_finish(timeline), STATUS_OK);
    json_t *object = json_load_file(path, JSON_REJECT_DUPLICATES, &error);
    if (!object)
        fail_msg("%s in line %d", error.text, error.line);
    return object;
}

static pass_record a_pass(const char *name, uint64_t iteration, uint64_t start, uint64_t drained)
{
    pass_record pass = {.info = {.kind = PASS_DRAW, .number = 1, .iteration = iteration},
                        .statistics = {.fragments = 9, .unit_wait_data = 7},
                        .start = start,
                        .last_fragment = drained,
                        .drained = drained,
                        .bound_by = RESOURCE_DEPTH};
    snprintf(pass.info.name, sizeof pass.info.name, "%s", name);
    return pass;
}

static const char *text_of(json_t *event, const char *key)
{
    return json_string_value(json_object_get(event, key));
}

// Events of a phase in the file's order, as "name@ts+dur " each.
static void list_events(json_t *object, const char *phases, int64_t track, char *list, size_t size)
{
    size_t index;
    json_t *event;
    list[0] = 0;
    json_array_foreach(json_object_get(object, "traceEvents"), index, event)
    {
        const size_t length = strlen(list);
        if (!strstr(phases, text_of(event, "ph")) || json_integer_value(json_object_get(event, "tid")) != track)
            continue;
        snprintf(list + length, size - length, "%s%s@%g", length > 0 ? " " : "", text_of(event, "name"),
                 json_number_value(json_object_get(event, "ts")));
        const size_t more = strlen(list);
        json_t *duration = json_object_get(event, "dur");
        if (duration)
            snprintf(list + more, size - more, "+%g", json_number_value(duration));
    }
}

static int64_t track_of(json_t *object, const char *name)
{
    size_t index;
    json_t *event;
    json_array_foreach(json_object_get(object, "traceEvents"), index, event)
    {
        if (strcmp(text_of(event, "name"), "thread_name") == 0 &&
            strcmp(text_of(json_object_get(event, "args"), "name"), name) == 0)
            return json_integer_value(json_object_get(event, "tid"));
    }
    fail_msg("no track %s", name);
    return 0;
}

static void passes_lie_in_iterations(void **state)
{
    (void)state;
    char list[1024];
    timeline *timeline = opened(1);  // a cycle is a microsecond
    const pass_record passes[] = {a_pass("clear", 0, 0, 3), a_pass("peel", 1, 3, 10), a_pass("blend", 1, 10, 12),
                                  a_pass("peel", 2, 12, 20), a_pass("copy", 0, 20, 21)};
    for (size_t i = 0; i < sizeof passes / sizeof *passes; i++)
        timeline_pass(timeline, &passes[i]);
    json_t *object = read_back(timeline);
    list_events(object, "XBE", track_of(object, "passes"), list, sizeof list);
    assert_string_equal(list, "clear@0+3 iteration@3 peel@3+7 blend@10+2 iteration@12 iteration@12 peel@12+8 "
                              "iteration@20 copy@20+1");
    // Counters hold until the next; after the last pass nothing waits.
    list_events(object, "C", 0, list, sizeof list);
    assert_string_equal(list, "stalls@0 stalls@3 stalls@10 stalls@12 stalls@20 stalls@21");
    size_t index, opens = 0;
    json_t *event;
    json_array_foreach(json_object_get(object, "traceEvents"), index, event)
    {
        json_t *args = json_object_get(event, "args");
        if (strcmp(text_of(event, "name"), "blend") == 0) {
            assert_string_equal(text_of(args, "bound_by"), "depth");
            assert_int_equal(json_integer_value(json_object_get(args, "cycles")), 2);
        }
        opens += strcmp(text_of(event, "ph"), "B") == 0;
    }
    assert_int_equal(opens, 2);
    json_t *last = json_array_get(json_object_get(object, "traceEvents"), index - 1);
    assert_int_equal(json_integer_value(json_object_get(json_object_get(last, "args"), "unit_wait_data")), 0);
    json_decref(object);
}

// An iteration that is the last thing of a run ends with it.
static void the_last_iteration_ends(void **state)
{
    (void)state;
    char list[256];
    timeline *timeline = opened(1);
    const pass_record pass = a_pass("peel", 1, 0, 5);
    timeline_pass(timeline, &pass);
    json_t *object = read_back(timeline);
    list_events(object, "XBE", track_of(object, "passes"), list, sizeof list);
    assert_string_equal(list, "iteration@0 peel@0+5 iteration@5");
    json_decref(object);
}

static void tracks_have_their_names(void **state)
{
    (void)state;
    char name[NAME_SIZE], list[256];
    timeline *timeline = opened(1);
    for (int round = 0; round < 2; round++) {
        for (int i = 0; i < 300; i++) {
            snprintf(name, sizeof name, "depth %d", i);
            timeline_slice(timeline, name, round ? "late" : "early", (uint64_t)(i + 1000 * round),
                           (uint64_t)(i + 1000 * round + 1));
        }
    }
    timeline_slice(timeline, "odd \"track\"", "a \\ b", 0, 1);
    timeline_counter(timeline, "queue", 4, 0.5);
    json_t *object = read_back(timeline);
    for (int i = 0; i < 300; i++) {
        char expected[64];
        snprintf(name, sizeof name, "depth %d", i);
        snprintf(expected, sizeof expected, "early@%d+1 late@%d+1", i, i + 1000);
        list_events(object, "X", track_of(object, name), list, sizeof list);
        assert_string_equal(list, expected);
    }
    list_events(object, "X", track_of(object, "odd \"track\""), list, sizeof list);
    assert_string_equal(list, "a \\ b@0+1");
    list_events(object, "C", 0, list, sizeof list);
    assert_string_equal(list, "queue@4 stalls@0");
    json_decref(object);
}

// Neighbouring cycles at clocks of less and of more than one a nanosecond, early and late in a run.
static void cycles_stay_apart(void **state)
{
    (void)state;
    static const int64_t clocks[] = {1, 575, 999, 1000, 2520, 100000};
    for (size_t k = 0; k < sizeof clocks / sizeof *clocks; k++) {
        timeline *timeline = opened(clocks[k]);
        const uint64_t starts[] = {0, 12345, UINT64_C(1000000000)};
        for (size_t s = 0; s < 3; s++) {
            for (uint64_t cycle = 0; cycle < 50; cycle++)
                timeline_slice(timeline, "unit", "work", starts[s] + cycle, starts[s] + cycle + 1);
        }
        json_t *object = read_back(timeline), *event;
        size_t index;
        double end = 0, before = -1;
        json_array_foreach(json_object_get(object, "traceEvents"), index, event)
        {
            if (strcmp(text_of(event, "ph"), "X") != 0)
                continue;
            const double start = json_number_value(json_object_get(event, "ts"));
            const double duration = json_number_value(json_object_get(event, "dur"));
            assert_true(start > before && duration > 0);
            // Slices meet, but for what a double of that size cannot tell apart.
            assert_true(start >= end - 1e-6 / 2);
            before = start;
            end = start + duration;
        }
        assert_true(end > 1e9 / (double)clocks[k]);
        json_decref(object);
    }
}

static void refusals(void **state)
{
    (void)state;
    machine machine;
    messages messages;
    timeline *none = NULL;
    messages_start(&messages);
    assert_int_equal(machine_load("tiny", NULL, &machine), STATUS_OK);
    assert_int_equal(timeline_open("/nowhere/at/all.json", &machine, &messages.report, &none), STATUS_IO);
    assert_null(none);
    assert_non_null(strstr(messages.text, "/nowhere/at/all.json"));
    timeline_discard(NULL);
    unlink(path);
    timeline_discard(opened(1));
    assert_int_not_equal(access(path, F_OK), 0);
}

int main(void)
{
    int descriptor = mkstemps(path, 5);
    if (descriptor < 0)
        return 1;
    close(descriptor);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(passes_lie_in_iterations),
        cmocka_unit_test(the_last_iteration_ends),
        cmocka_unit_test(tracks_have_their_names),
        cmocka_unit_test(cycles_stay_apart),
        cmocka_unit_test(refusals),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    unlink(path);
    return failed;
}
