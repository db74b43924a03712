// A machine by name or file, changed key by key, printed, hashed, and as limits for the verifier.
//
// The hash is over values in the order of params.def, not over the file's bytes: comments and order of keys
// do not make another machine.
#include "machine_params.h"
#include "machine_yaml.h"

#include <string.h>
#define XXH_STATIC_LINKING_ONLY  // for a hash state on the stack
#include <xxhash.h>

enum { PATH_SIZE = 4096, SHIPPED_MAX = 64 };

static bool ends_with(const char *text, const char *ending)
{
    size_t length = strlen(text), tail = strlen(ending);
    return length >= tail && strcmp(text + length - tail, ending) == 0;
}

static status refuse_name(const char *name, const report *report)
{
    char names[SHIPPED_MAX][NAME_SIZE], list[SHIPPED_MAX * NAME_SIZE] = "";
    const char *words[SHIPPED_MAX];
    int count = data_names("machines", ".yaml", names, SHIPPED_MAX);
    for (int i = 0; i < count; i++) {
        size_t length = strlen(list);
        snprintf(list + length, sizeof list - length, "%s%s", i ? ", " : "", names[i]);
        words[i] = names[i];
    }
    const char *meant = nearest_word(name, words, (size_t)count);
    return report_error(report, STATUS_REFUSED,
                        "no machine is called `%s`; there are %s; or give a file ending in .yaml%s%s%s", name,
                        count ? list : "none (is ROPSIM_DATA right?)", meant ? "; did you mean `" : "",
                        meant ? meant : "", meant ? "`?" : "");
}

status machine_load(const char *name, const report *report, machine *machine)
{
    char path[PATH_SIZE], file_name[NAME_SIZE + 8];
    *machine = (struct machine){0};
    if (strchr(name, '/') || ends_with(name, ".yaml")) {
        snprintf(path, sizeof path, "%s", name);
    } else {
        snprintf(file_name, sizeof file_name, "%.*s.yaml", NAME_SIZE - 1, name);
        if (strlen(name) >= NAME_SIZE || data_path("machines", file_name, path, sizeof path) != STATUS_OK)
            return refuse_name(name, report);
    }
    status result = machine_read_yaml(path, report, machine);
    if (result != STATUS_OK) {
        *machine = (struct machine){0};
        return result;
    }
    const char *slash = strrchr(path, '/');
    snprintf(machine->name, sizeof machine->name, "%.*s", NAME_SIZE - 1, slash ? slash + 1 : path);
    if (ends_with(machine->name, ".yaml"))
        machine->name[strlen(machine->name) - strlen(".yaml")] = 0;
    return STATUS_OK;
}

status machine_set(machine *machine, const char *assignment, const report *report)
{
    char key[NAME_SIZE], why[PARAM_TEXT_SIZE];
    const char *equals = strchr(assignment, '=');
    if (!equals || equals == assignment || equals - assignment >= NAME_SIZE)
        return report_error(report, STATUS_USAGE, "`%.80s` must be KEY=VALUE, as in depth_format=z24", assignment);
    snprintf(key, sizeof key, "%.*s", (int)(equals - assignment), assignment);
    const param_row *row = param_find(key);
    if (!row) {
        const char *meant = param_nearest(key);
        return report_error(report, STATUS_REFUSED, "a machine has no key `%s`%s%s%s", key,
                            meant ? "; did you mean `" : "; `ropsim machine --keys` lists all", meant ? meant : "",
                            meant ? "`?" : "");
    }
    if (!param_read(row, equals + 1, machine, why))
        return report_error(report, STATUS_REFUSED, "%s", why);
    return STATUS_OK;
}

status machine_print(const machine *machine, FILE *out)
{
    fprintf(out, "# %s\n", machine->name);
    for (int i = 0; i < param_count; i++) {
        char value[PARAM_TEXT_SIZE];
        param_write(&param_rows[i], machine, value);
        fprintf(out, "%s: %s\n", param_rows[i].key, value);
    }
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

status machine_print_keys(FILE *out)
{
    fputs("| key | accepts | meaning |\n|---|---|---|\n", out);
    for (int i = 0; i < param_count; i++) {
        char accepted[PARAM_TEXT_SIZE];
        param_accepted(&param_rows[i], accepted);
        fprintf(out, "| `%s` | %s | %s |\n", param_rows[i].key, accepted, param_rows[i].meaning);
    }
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

void machine_hash(const machine *machine, char hash[33])
{
    XXH3_state_t state;
    XXH3_INITSTATE(&state);
    XXH3_128bits_reset(&state);
    for (int i = 0; i < param_count; i++) {
        char value[PARAM_TEXT_SIZE], line[PARAM_TEXT_SIZE + NAME_SIZE];
        param_write(&param_rows[i], machine, value);
        int length = snprintf(line, sizeof line, "%s: %s\n", param_rows[i].key, value);
        XXH3_128bits_update(&state, line, (size_t)length);
    }
    XXH128_hash_t digest = XXH3_128bits_digest(&state);
    snprintf(hash, 33, "%016llx%016llx", (unsigned long long)digest.high64, (unsigned long long)digest.low64);
}

void machine_limits(const machine *machine, rop_limits *limits)
{
    enum { CHOICE_INTERPOLATED = 1 };  // range_clip: "stored interpolated"
    uint32_t own_formats = UINT32_C(1) << machine->depth_format | UINT32_C(1) << machine->color_format;
    *limits = (rop_limits){
        .machine = machine->name,
        .fixed_function = machine->fixed_function,
        .depth_format = machine->depth_format,
        .color_format = machine->color_format,
        .stencil_bits = (int)machine->stencil_bits,
        .clip_interpolated = machine->range_clip == CHOICE_INTERPOLATED,
        .formats = machine->formats | own_formats,
        .opcodes = machine->opcodes,
        .planes_max = (int)machine->planes_max,
        .bits_per_sample_max = (int)machine->bits_per_sample_max,
        .color_targets_max = (int)machine->color_targets_max,
        .instructions_max = (int)machine->instructions_max,
        .list_entries_max = (int)machine->list_entries_max,
    };
}

bool machine_same_limits(const machine *a, const machine *b)
{
    rop_limits x, y;
    machine_limits(a, &x);
    machine_limits(b, &y);
    return x.fixed_function == y.fixed_function && x.depth_format == y.depth_format && x.color_format == y.color_format &&
           x.stencil_bits == y.stencil_bits && x.clip_interpolated == y.clip_interpolated && x.formats == y.formats &&
           x.opcodes == y.opcodes && x.planes_max == y.planes_max && x.bits_per_sample_max == y.bits_per_sample_max &&
           x.color_targets_max == y.color_targets_max && x.instructions_max == y.instructions_max &&
           x.list_entries_max == y.list_entries_max;
}

bool machine_get_value(const machine *machine, int index, machine_value *value)
{
    _Static_assert(sizeof value->text == PARAM_TEXT_SIZE, "a value is as long as param_write may make it");
    if (index < 0 || index >= param_count)
        return false;
    const param_row *row = &param_rows[index];
    const void *field = (const char *)machine + row->offset;
    *value = (machine_value){.key = row->key, .kind = MACHINE_VALUE_TEXT};
    param_write(row, machine, value->text);
    if (row->kind == PARAM_KIND_INT) {
        value->kind = MACHINE_VALUE_INTEGER;
        value->number = *(const int64_t *)field;
    } else if (row->kind == PARAM_KIND_BOOL) {
        value->kind = MACHINE_VALUE_BOOL;
        value->number = *(const bool *)field;
    }
    return true;
}
