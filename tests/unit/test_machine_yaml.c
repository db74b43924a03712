// Machine files that break a rule: each is refused at its line and column, with what would be accepted.
#include "messages.h"

#include <setjmp.h>
#include <stdarg.h>
#include <cmocka.h>
#include <stdlib.h>
#include <unistd.h>

// A whole machine file; %s stands for one line or lines under test, in line 5.
static const char whole[] =
    "fixed_function: false\ndepth_format: z24\ncolor_format: rgba8\nstencil_bits: 8\n%s\n"
    "formats: all\nopcodes: all\nlist_entries_max: 0\nplanes_max: 4\nbits_per_sample_max: 128\ncolor_targets_max: 1\n%s%s";
static const char last_key[] = "instructions_max: 16\n";

// The keys of time and traffic come last, as a shipped machine has them.
enum { TEXT_SIZE = 16384 };
static char rest[TEXT_SIZE];

static int read_rest(void **state)
{
    (void)state;
    static char shipped[TEXT_SIZE];
    FILE *file = fopen(ROPSIM_SOURCE "/sim/machines/tiny.yaml", "rb");
    const size_t size = file ? fread(shipped, 1, sizeof shipped - 1, file) : 0;
    const char *from = size ? strstr(shipped, "\ncore_mhz:") : NULL;
    if (file)
        fclose(file);
    if (!from)
        return -1;
    strcpy(rest, from + 1);
    return 0;
}

static char path[] = "/tmp/ropsim_yaml_XXXXXX.yaml";

static status load_text(const char *text, size_t size, messages *messages, machine *machine)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, size, file), size);
    fclose(file);
    messages_start(messages);
    return machine_load(path, &messages->report, machine);
}

static void rules_are_kept(void **state)
{
    (void)state;
    static const struct {
        const char *line_5, *end;
        status expected;
        const char *says[2];
    } cases[] = {
        {"range_clip: stored", last_key, STATUS_OK, {"", ""}},
        {"range_clip: stored  # why", last_key, STATUS_OK, {"", ""}},
        {"range_clip: store", last_key, STATUS_REFUSED, {".yaml:5:13: ", "did you mean `stored`?"}},
        {"range_clip: 'stored'", last_key, STATUS_REFUSED, {".yaml:5:13: ", "no quotes"}},
        {"range_clip: [stored]", last_key, STATUS_REFUSED, {".yaml:5:13: ", "must be stored or interpolated"}},
        {"range_clip: {a: b}", last_key, STATUS_REFUSED, {".yaml:5:13: ", "must be stored or interpolated"}},
        {"range_clip: &x stored", last_key, STATUS_REFUSED, {".yaml:5:13: ", "anchors"}},
        {"range_clip: !!str stored", last_key, STATUS_REFUSED, {".yaml:5:13: ", "tags"}},
        {"range_clip:", last_key, STATUS_REFUSED, {".yaml:5:12: ", "must be stored or interpolated"}},
        {"range_clip: *x", last_key, STATUS_REFUSED, {".yaml:5:13: ", ""}},
        {"range_clop: stored",
         last_key,
         STATUS_REFUSED,
         {".yaml:5:1: unknown key `range_clop`; did you mean `range_clip`?", "missing key range_clip"}},
        {"colour: red\nrange_clip: stored", last_key, STATUS_REFUSED, {".yaml:5:1: unknown key `colour`", "--keys"}},
        {"[a, b]: stored\nrange_clip: stored", last_key, STATUS_REFUSED, {".yaml:5:1: a key must be a plain word", ""}},
        {"# nothing", last_key, STATUS_REFUSED, {"missing key range_clip: stored or interpolated", ""}},
        {"range_clip: stored\nrange_clip: stored",
         last_key,
         STATUS_REFUSED,
         {".yaml:6:1: range_clip is set a second time", "line 5"}},
        {"range_clip: stored", "instructions_max: 0\n", STATUS_REFUSED, {".yaml:12:19: ", "from 1 to 256 (words)"}},
        {"range_clip: stored", "instructions_max: 257\n", STATUS_REFUSED, {".yaml:12:19: ", "from 1 to 256 (words)"}},
        {"range_clip: stored", "instructions_max: 1_0\n", STATUS_REFUSED, {".yaml:12:19: ", "an integer"}},
        {"range_clip: stored", "instructions_max: 010\n", STATUS_REFUSED, {".yaml:12:19: ", "an integer"}},
        {"range_clip: stored", "instructions_max: 1.0\n", STATUS_REFUSED, {".yaml:12:19: ", "an integer"}},
        {"range_clip: stored", "", STATUS_REFUSED, {"missing key instructions_max: an integer from 1 to 256", ""}},
        {"range_clip: stored", "instructions_max: 16\n---\na: b\n", STATUS_REFUSED, {"one document", ""}},
        {"\trange_clip: stored", last_key, STATUS_REFUSED, {".yaml:5:1: ", ""}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[TEXT_SIZE];
        messages messages;
        machine machine;
        const bool ends = strstr(cases[i].end, "---");  // then nothing may follow
        int size = snprintf(text, sizeof text, whole, cases[i].line_5, ends ? rest : cases[i].end, ends ? cases[i].end : rest);
        status result = load_text(text, (size_t)size, &messages, &machine);
        for (int j = 0; j < 2; j++) {
            const char *says = cases[i].says[j] ? cases[i].says[j] : "";
            if (result != cases[i].expected || !strstr(messages.text, says))
                fail_msg("%s / %s gave %d and said: %s", cases[i].line_5, cases[i].end, result, messages.text);
        }
    }
}

static void all_errors_of_a_file_are_said(void **state)
{
    (void)state;
    char text[TEXT_SIZE];
    messages messages;
    machine machine;
    int size = snprintf(text, sizeof text, whole, "range_clip: no\nsize: 7", "instructions_max: many\n", rest);
    assert_int_equal(load_text(text, (size_t)size, &messages, &machine), STATUS_REFUSED);
    assert_int_equal(messages.count, 3);
}

static void lists_of_formats(void **state)
{
    (void)state;
    static const char format[] =
        "fixed_function: true\ndepth_format: z24\ncolor_format: rgba8\nstencil_bits: 8\nrange_clip: stored\nformats: "
        "%s\n"
        "opcodes: all\nlist_entries_max: 0\nplanes_max: 4\nbits_per_sample_max: 128\ncolor_targets_max: 1\ninstructions_max: 16\n%s";
    static const struct {
        const char *list;
        status expected;
        const char *says;
    } cases[] = {
        {"[z24, rgba8]", STATUS_OK, ""},
        {"\n  - z24\n  - rgba8", STATUS_OK, ""},
        {"[z24, z24]", STATUS_REFUSED, ".yaml:6:16: formats lists `z24` twice"},
        {"[z24, z42]", STATUS_REFUSED, ".yaml:6:16: "},
        {"[z24, [rgba8]]", STATUS_REFUSED, ".yaml:6:16: an element of formats must be a plain word"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[TEXT_SIZE];
        messages messages;
        machine machine;
        int size = snprintf(text, sizeof text, format, cases[i].list, rest);
        status result = load_text(text, (size_t)size, &messages, &machine);
        if (result != cases[i].expected || !strstr(messages.text, cases[i].says))
            fail_msg("%s gave %d and said: %s", cases[i].list, result, messages.text);
        if (result == STATUS_OK)
            assert_int_equal(machine.formats, 1u << FORMAT_z24 | 1u << FORMAT_rgba8);
    }
}

// Whatever the bytes are, the reader ends and either takes or refuses them.
static void damaged_files_are_refused(void **state)
{
    (void)state;
    char text[TEXT_SIZE], copy[TEXT_SIZE];
    messages messages;
    machine machine;
    size_t size = (size_t)snprintf(text, sizeof text, whole, "range_clip: stored", last_key, rest);
    for (size_t cut = 0; cut + 2 < size; cut += 7) {
        assert_int_equal(load_text(text, cut, &messages, &machine), STATUS_REFUSED);
        assert_true(messages.count > 0);
    }
    for (size_t at = 0; at < size; at += 5) {
        memcpy(copy, text, size);
        copy[at] = 0;
        assert_int_equal(load_text(copy, size, &messages, &machine), STATUS_REFUSED);
        copy[at] = (char)0xFF;
        assert_int_equal(load_text(copy, size, &messages, &machine), STATUS_REFUSED);
    }
    enum { TOO_LARGE = 70000 };
    char *large = malloc(TOO_LARGE);
    assert_non_null(large);
    memset(large, '#', TOO_LARGE);
    assert_int_equal(load_text(large, TOO_LARGE, &messages, &machine), STATUS_REFUSED);
    memset(large, '[', 60000);
    assert_int_equal(load_text(large, 60000, &messages, &machine), STATUS_REFUSED);
    free(large);
}

int main(void)
{
    int descriptor = mkstemps(path, 5);
    if (descriptor < 0)
        return 1;
    close(descriptor);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rules_are_kept),
        cmocka_unit_test(all_errors_of_a_file_are_said),
        cmocka_unit_test(lists_of_formats),
        cmocka_unit_test(damaged_files_are_refused),
    };
    int failed = cmocka_run_group_tests(tests, read_rest, NULL);
    unlink(path);
    return failed;
}
