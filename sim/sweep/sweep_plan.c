// A sweep file to the runs that it stands for: programs assembled, machines with every combination of the settings,
// traces opened once for their hash, and the product of all by index.
#include "sweep.h"

#include <errno.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#define XXH_STATIC_LINKING_ONLY
#include <xxhash.h>

enum { PATH_SIZE = 4096 };

char *sweep_path(const sweep_file *file, const char *path)
{
    const char *slash = strrchr(file->path, '/');
    const size_t folder = slash && path[0] != '/' ? (size_t)(slash - file->path) + 1 : 0;
    char *whole = malloc(folder + strlen(path) + 1);
    if (whole) {
        memcpy(whole, file->path, folder);
        strcpy(whole + folder, path);
    }
    return whole;
}

// A shipped thing by its name as it is; a file relative to the sweep's.
static char *named_path(const sweep_file *file, const char *words)
{
    return words[strcspn(words, "/.,")] == ',' || !strpbrk(words, "/.") ? strdup(words) : sweep_path(file, words);
}

static status refuse_memory(const sweep *sweep)
{
    return report_error(sweep->report, STATUS_IO, "%s: out of memory", sweep->file.path);
}

static status load_program(sweep *sweep, const sweep_word *word, sweep_program *loaded)
{
    sweep_place place;
    char path[PATH_SIZE], *words = named_path(&sweep->file, word->text);
    uint32_t *code = NULL;
    size_t count = 0;
    if (!words)
        return refuse_memory(sweep);
    sweep_place_start(&place, sweep->report, sweep->file.path, word);
    loaded->label = word->text;
    status status = program_load(words, &place.report, path, sizeof path, &loaded->program);
    free(words);
    if (status != STATUS_OK)
        return status;
    loaded->path = strdup(path);
    if (!loaded->path || program_encode(loaded->program, &code, &count) != STATUS_OK)
        return refuse_memory(sweep);
    const XXH128_hash_t digest = XXH3_128bits(code, count * sizeof *code);
    snprintf(loaded->hash, sizeof loaded->hash, "%016llx%016llx", (unsigned long long)digest.high64,
             (unsigned long long)digest.low64);
    free(code);
    return STATUS_OK;
}

static status load_programs(sweep *sweep)
{
    const sweep_list *list = &sweep->file.lists[KEY_programs];
    status status = STATUS_OK;
    sweep->programs = calloc((size_t)list->count, sizeof *sweep->programs);
    if (!sweep->programs)
        return refuse_memory(sweep);
    for (int i = 0; status == STATUS_OK && i < list->count; i++) {
        sweep->program_count++;
        status = load_program(sweep, &list->words[i], &sweep->programs[i]);
    }
    return status;
}

// The value of each setting in the combination `index`, the last setting fastest.
static const char *setting_value(const sweep *sweep, uint32_t index, int setting)
{
    for (int i = sweep->file.setting_count - 1; i > setting; i--)
        index /= (uint32_t)sweep->file.settings[i].values.count;
    const sweep_list *values = &sweep->file.settings[setting].values;
    return values->words[index % (uint32_t)values->count].text;
}

static status build_variant(sweep *sweep, const machine *base, uint32_t settings, sweep_variant *variant)
{
    *variant = (sweep_variant){.machine = *base, .settings = settings};
    for (int i = 0; i < sweep->file.setting_count; i++) {
        char assignment[2048];
        snprintf(assignment, sizeof assignment, "%s=%s", sweep->file.settings[i].key.text,
                 setting_value(sweep, settings, i));
        const status status = machine_set(&variant->machine, assignment, sweep->report);
        if (status != STATUS_OK)
            return status;
    }
    machine_hash(&variant->machine, variant->hash);
    return STATUS_OK;
}

static status build_variants(sweep *sweep)
{
    const sweep_list *list = &sweep->file.lists[KEY_machines];
    const uint64_t others =
        sweep->program_count * (uint64_t)sweep->file.lists[KEY_traces].count * (uint64_t)sweep->file.detail_count;
    uint64_t product = 1;
    for (int i = 0; i < sweep->file.setting_count && product <= SWEEP_RUNS_MAX; i++)
        product *= (uint64_t)sweep->file.settings[i].values.count;
    if (product > SWEEP_RUNS_MAX || product * (uint64_t)list->count > SWEEP_RUNS_MAX / others)
        return report_error(
            sweep->report, STATUS_REFUSED,
            "%s: traces x programs x machines x settings x levels of detail are more than %d runs; set fewer values",
            sweep->file.path, SWEEP_RUNS_MAX);
    sweep->variants = calloc(product * (uint64_t)list->count, sizeof *sweep->variants);
    if (!sweep->variants)
        return refuse_memory(sweep);
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < list->count; i++) {
        sweep_place place;
        machine base;
        char *name = named_path(&sweep->file, list->words[i].text);
        if (!name)
            return refuse_memory(sweep);
        sweep_place_start(&place, sweep->report, sweep->file.path, &list->words[i]);
        status = machine_load(name, &place.report, &base);
        free(name);
        for (uint32_t k = 0; status == STATUS_OK && k < product; k++)
            status = build_variant(sweep, &base, k, &sweep->variants[sweep->variant_count++]);
    }
    return status;
}

static bool is_recorded(const sweep_word *word)
{
    return strncmp(word->text, "record ", 7) == 0;
}

// Where the trace lies, or will lie once it is recorded.
static status find_trace(sweep *sweep, const sweep_word *word, sweep_trace *trace)
{
    trace->label = word->text;
    if (!is_recorded(word)) {
        trace->path = sweep_path(&sweep->file, word->text);
        return trace->path ? STATUS_OK : refuse_memory(sweep);
    }
    char *database = sweep_path(&sweep->file, sweep->file.lists[KEY_results].words[0].text);
    const size_t size = database ? strlen(database) + 64 : 0;
    trace->path = database ? malloc(size) : NULL;
    if (trace->path)
        snprintf(trace->path, size, "%s.traces/%016llx.ropt", database,
                 (unsigned long long)XXH3_64bits(word->text, strlen(word->text)));
    free(database);
    return trace->path ? STATUS_OK : refuse_memory(sweep);
}

static status find_traces(sweep *sweep)
{
    const sweep_list *list = &sweep->file.lists[KEY_traces];
    status status = STATUS_OK;
    sweep->traces = calloc((size_t)list->count, sizeof *sweep->traces);
    if (!sweep->traces)
        return refuse_memory(sweep);
    for (int i = 0; status == STATUS_OK && i < list->count; i++) {
        sweep->trace_count++;
        status = find_trace(sweep, &list->words[i], &sweep->traces[i]);
    }
    return status;
}

// Recorded anew each time, since a mesh may have changed; the same scene gives the same hash.
static status record_trace(sweep *sweep, const sweep_word *word, char *path)
{
    char *slash = strrchr(path, '/');
    status status = STATUS_OK;
    *slash = 0;
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        status = report_error(sweep->report, STATUS_IO, "%s: cannot be made: %s", path, strerror(errno));
    *slash = '/';
    return status == STATUS_OK ? sweep_record(&sweep->file, word, path, sweep->report) : status;
}

static void keep_info(sweep_trace *loaded, const trace_info *info)
{
    const double samples = (double)info->width * info->height * info->samples, fragments = (double)info->fragment_count;
    memcpy(loaded->hash, info->hash, sizeof loaded->hash);
    loaded->work = (samples + fragments) * (1 + fragments / samples);
}

static status load_trace(sweep *sweep, const sweep_word *word, sweep_trace *loaded)
{
    sweep_place place;
    trace *trace = NULL;
    status status = is_recorded(word) ? record_trace(sweep, word, loaded->path) : STATUS_OK;
    sweep_place_start(&place, sweep->report, sweep->file.path, word);
    if (status == STATUS_OK)
        status = trace_open(loaded->path, &place.report, &trace);
    if (status == STATUS_OK)
        keep_info(loaded, trace_get_info(trace));
    trace_close(trace);
    return status;
}

static status load_traces(sweep *sweep)
{
    status status = STATUS_OK;
    for (uint64_t i = 0; status == STATUS_OK && i < sweep->trace_count; i++)
        status = load_trace(sweep, &sweep->file.lists[KEY_traces].words[i], &sweep->traces[i]);
    return status;
}

static status open_store(sweep *sweep)
{
    char *path = sweep_path(&sweep->file, sweep->file.lists[KEY_results].words[0].text);
    if (!path)
        return refuse_memory(sweep);
    const status status = store_open(path, sweep->report, &sweep->store);
    free(path);
    return status;
}

status sweep_open_plan(const char *path, const report *report, sweep **sweep)
{
    *sweep = NULL;
    struct sweep *new = calloc(1, sizeof *new);
    if (!new)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    new->report = report;
    status status = sweep_file_read(path, report, &new->file);
    if (status == STATUS_OK)
        status = load_programs(new);
    if (status == STATUS_OK)
        status = build_variants(new);
    if (status == STATUS_OK)
        status = find_traces(new);
    if (status == STATUS_OK)
        *sweep = new;
    else
        sweep_close(new);
    return status;
}

status sweep_open(const char *path, const report *report, sweep **sweep)
{
    status status = sweep_open_plan(path, report, sweep);
    if (status == STATUS_OK)
        status = open_store(*sweep);
    if (status == STATUS_OK)
        status = load_traces(*sweep);
    if (status != STATUS_OK) {
        sweep_close(*sweep);
        *sweep = NULL;
    }
    return status;
}

void sweep_close(sweep *sweep)
{
    if (!sweep)
        return;
    store_close(sweep->store);
    for (uint64_t i = 0; i < sweep->program_count; i++) {
        program_destroy(sweep->programs[i].program);
        free(sweep->programs[i].path);
    }
    for (uint64_t i = 0; i < sweep->trace_count; i++)
        free(sweep->traces[i].path);
    free(sweep->programs);
    free(sweep->traces);
    free(sweep->variants);
    sweep_file_free(&sweep->file);
    free(sweep);
}

uint64_t sweep_count(const sweep *sweep)
{
    return sweep->trace_count * (uint64_t)sweep->file.detail_count * sweep->program_count * sweep->variant_count;
}

sweep_combination sweep_get(const sweep *sweep, uint64_t index)
{
    const uint64_t program = index / sweep->variant_count, detail = program / sweep->program_count;
    const uint64_t trace = detail / (uint64_t)sweep->file.detail_count;
    return (sweep_combination){.trace = &sweep->traces[trace],
                               .program = &sweep->programs[program % sweep->program_count],
                               .variant = &sweep->variants[index % sweep->variant_count],
                               .detail = &sweep->file.details[detail % (uint64_t)sweep->file.detail_count],
                               .max_iterations = sweep->file.max_iterations};
}

void sweep_settings_text(const sweep *sweep, const sweep_variant *variant, char *text, size_t size)
{
    size_t length = 0;
    text[0] = 0;
    for (int i = 0; i < sweep->file.setting_count && length < size; i++)
        length += (size_t)snprintf(text + length, size - length, "%s%s=%s", i ? " " : "",
                                   sweep->file.settings[i].key.text, setting_value(sweep, variant->settings, i));
}
