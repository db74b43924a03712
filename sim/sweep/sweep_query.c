// Which runs are the best by one column, among those that meet bounds: for each trace a few rows of a Markdown table.
//
// A column is one of the table `runs` or a machine key. Runs of different levels of detail are never compared, since a
// deeper one of the same combination is the same run seen more closely.
#include "sweep.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

// A number of a run.
typedef struct measure {
    char name[NAME_SIZE];
    int column, key;  // one of them, the other is -1
    column_kind kind;
    detail_level level;
} measure;

typedef struct bound {
    measure measure;
    bool at_least;
    double value;
} bound;

typedef struct query {
    measure order;
    bool most, exact;
    bound bounds[SWEEP_BOUNDS_MAX];
    int bound_count;
    sweep_level level;
    uint64_t top;
} query;

typedef struct candidate {
    uint64_t index;
    double value;
} candidate;

enum { NAMES_MAX = 512 };

// ---- Names ---------------------------------------------------------------------------------------------

static status refuse_name(const char *name, const report *report)
{
    static const machine any;
    machine_value key;
    char storage[NAMES_MAX][NAME_SIZE];
    const char *names[NAMES_MAX];
    size_t count = 0;
    for (int i = 0; i < SWEEP_COLUMN_COUNT && count < NAMES_MAX; i++)
        snprintf(storage[count++], NAME_SIZE, "%s", sweep_get_column(i).name);
    for (int i = 0; machine_get_value(&any, i, &key) && count < NAMES_MAX; i++)
        snprintf(storage[count++], NAME_SIZE, "%s", key.key);
    for (size_t i = 0; i < count; i++)
        names[i] = storage[i];
    const char *meant = nearest_word(name, names, count);
    return report_error(report, STATUS_USAGE, "runs have no column `%.60s`, nor have machines such a key%s%s%s", name,
                        meant ? "; did you mean `" : "; docs/sweep.md lists them", meant ? meant : "",
                        meant ? "`?" : "");
}

static status refuse_word(const char *name, const report *report)
{
    return report_error(report, STATUS_USAGE, "`%s` is a word, but a column of numbers is wanted", name);
}

static status find_measure(const char *word, const report *report, measure *measure)
{
    static const machine any;
    machine_value key;
    const char *name = strcmp(word, "bytes") == 0    ? "plane_bytes"
                       : strcmp(word, "passes") == 0 ? "geometry_passes"
                                                     : word;
    *measure = (struct measure){.column = -1, .key = -1, .level = DETAIL_FUNCTION, .kind = COLUMN_COUNT};
    for (int i = 0; i < SWEEP_COLUMN_COUNT; i++) {
        const sweep_column column = sweep_get_column(i);
        if (strcmp(name, column.name) != 0)
            continue;
        measure->column = i;
        measure->kind = column.kind;
        measure->level = column.level;
        snprintf(measure->name, sizeof measure->name, "%s", name);
        return column.kind == COLUMN_RESOURCE ? refuse_word(name, report) : STATUS_OK;
    }
    for (int i = 0; machine_get_value(&any, i, &key); i++) {
        if (strcmp(name, key.key) != 0)
            continue;
        measure->key = i;
        snprintf(measure->name, sizeof measure->name, "%s", name);
        return key.kind == MACHINE_VALUE_TEXT ? refuse_word(name, report) : STATUS_OK;
    }
    return refuse_name(name, report);
}

static status read_bound(const char *text, const report *report, bound *bound)
{
    char name[NAME_SIZE], *end = NULL;
    const size_t length = strcspn(text, "<>=");
    const char *value = text + length + 2;
    if (length == 0 || length >= sizeof name || (text[length] != '<' && text[length] != '>') || text[length + 1] != '=')
        return report_error(report, STATUS_USAGE, "the bound `%.80s` must be COLUMN<=VALUE or COLUMN>=VALUE", text);
    snprintf(name, sizeof name, "%.*s", (int)length, text);
    bound->at_least = text[length] == '>';
    bound->value = strtod(value, &end);
    if (!*value || strspn(value, "+-.0123456789eE") != strlen(value) || *end || !isfinite(bound->value))
        return report_error(report, STATUS_USAGE, "the bound `%.80s` must end in a number, as in cycles<=1e6", text);
    return find_measure(name, report, &bound->measure);
}

// What of a sweep's levels tells most: an estimate of cycles tells less than their count.
static int rank(detail_level level)
{
    return level == DETAIL_CYCLE ? DETAIL_COUNT : (int)level;
}

static bool has_level(const sweep *sweep, const sweep_level *level)
{
    for (int i = 0; i < sweep->file.detail_count; i++) {
        if (strcmp(sweep->file.details[i].name, level->name) == 0)
            return true;
    }
    return false;
}

// The level whose runs are compared, and whether all columns are known there.
static status choose_level(const sweep *sweep, const sweep_query *words, const report *report, query *query)
{
    char why[SWEEP_WHY_SIZE];
    const measure *deepest = &query->order;
    if (words->detail && !sweep_read_level(words->detail, &query->level, why))
        return report_error(report, STATUS_USAGE, "--%s", why);
    if (!sweep)
        return STATUS_OK;
    for (int i = 0; i < sweep->file.detail_count && !words->detail; i++) {
        if (i == 0 || rank(sweep->file.details[i].level) > rank(query->level.level))
            query->level = sweep->file.details[i];
    }
    if (!has_level(sweep, &query->level))
        return report_error(report, STATUS_USAGE, "%s has no runs of the level %s; its key detail says which run",
                            sweep->file.path, words->detail);
    for (int i = 0; i < query->bound_count; i++)
        deepest = query->bounds[i].measure.level > deepest->level ? &query->bounds[i].measure : deepest;
    if (deepest->level > query->level.level)
        return report_error(report, STATUS_USAGE,
                            "`%s` is known from the level %s on, but runs of the level %s are compared; give"
                            " `detail: %s` in the sweep file",
                            deepest->name, detail_level_names[deepest->level], query->level.name,
                            detail_level_names[deepest->level]);
    return STATUS_OK;
}

static status read_query(const sweep *sweep, const sweep_query *words, const report *report, query *query)
{
    *query = (struct query){.most = words->most, .exact = words->exact, .top = words->top};
    status status = find_measure(words->column, report, &query->order);
    for (int i = 0; status == STATUS_OK && i < words->bound_count && i < SWEEP_BOUNDS_MAX; i++)
        status = read_bound(words->bounds[i], report, &query->bounds[query->bound_count++]);
    return status == STATUS_OK ? choose_level(sweep, words, report, query) : status;
}

status sweep_check_query(const sweep *sweep, const sweep_query *words, const report *report)
{
    query query;
    return read_query(sweep, words, report, &query);
}

// ---- Numbers -------------------------------------------------------------------------------------------

// False: this run has none.
static bool get_number(const measure *measure, const sweep_combination *run, const sweep_row *row, double *number)
{
    machine_value key;
    if (measure->column < 0) {
        *number = machine_get_value(&run->variant->machine, measure->key, &key) ? (double)key.number : 0;
        return true;
    }
    const sweep_value *value = &row->stats[measure->column];
    *number = measure->kind == COLUMN_REAL ? value->real : (double)value->count;
    return value->known;
}

static bool meets(const query *query, const sweep_combination *run, const sweep_row *row)
{
    if (row->outcome != OUTCOME_DONE || (query->exact && row->stats[STAT_exact].count != 1))
        return false;
    for (int i = 0; i < query->bound_count; i++) {
        const bound *bound = &query->bounds[i];
        double number;
        if (!get_number(&bound->measure, run, row, &number) ||
            (bound->at_least ? number < bound->value : number > bound->value))
            return false;
    }
    return true;
}

// Puts one among the best so far; of equals, the earlier stays before the later.
static void keep_best(const query *query, candidate *best, uint64_t *count, candidate new)
{
    uint64_t at = *count;
    while (at > 0 && (query->most ? new.value > best[at - 1].value : new.value < best[at - 1].value))
        at--;
    if (at == query->top)
        return;
    if (*count < query->top)
        ++*count;
    memmove(best + at + 1, best + at, (*count - at - 1) * sizeof *best);
    best[at] = new;
}

static status search_trace(sweep *sweep, const query *query, uint64_t trace, candidate *best, uint64_t *count,
                           uint64_t *absent)
{
    const uint64_t runs = sweep_count(sweep) / sweep->trace_count;
    *count = 0;
    for (uint64_t i = trace * runs; i < (trace + 1) * runs; i++) {
        const sweep_combination run = sweep_get(sweep, i);
        candidate new = {.index = i};
        sweep_row row;
        bool found;
        if (strcmp(run.detail->name, query->level.name) != 0)
            continue;
        const status status = store_find(sweep->store, &run, &found, &row);
        if (status != STATUS_OK)
            return status;
        *absent += !found;
        if (found && meets(query, &run, &row) && get_number(&query->order, &run, &row, &new.value))
            keep_best(query, best, count, new);
    }
    return STATUS_OK;
}

// ---- The table -----------------------------------------------------------------------------------------

// Columns beside those of all tables: what runs are ordered by, and what is bounded, each once.
static int list_measures(const query *query, const measure *shown[SWEEP_BOUNDS_MAX + 1])
{
    int count = 0;
    for (int i = -1; i < query->bound_count; i++) {
        const measure *measure = i < 0 ? &query->order : &query->bounds[i].measure;
        bool there = measure->column == STAT_geometry_passes || measure->column == STAT_fragments_replayed ||
                     measure->column == STAT_plane_bytes;
        for (int k = 0; k < count; k++)
            there = there || strcmp(shown[k]->name, measure->name) == 0;
        if (!there)
            shown[count++] = measure;
    }
    return count;
}

static void print_number(const measure *measure, const sweep_combination *run, const sweep_row *row, FILE *out)
{
    double number;
    const bool known = get_number(measure, run, row, &number);
    if (!known)
        fputs(" -", out);
    else if (measure->kind == COLUMN_REAL)
        fprintf(out, " %.6g", number);
    else
        fprintf(out, " %.0f", number);
    if (known && measure->column >= 0)
        print_half_width(row, measure->column, 1, 0, out);
    fputs(" |", out);
}

static status print_run(sweep *sweep, const query *query, uint64_t index, FILE *out)
{
    const sweep_combination run = sweep_get(sweep, index);
    const measure *shown[SWEEP_BOUNDS_MAX + 1];
    const int count = list_measures(query, shown);
    sweep_row row;
    bool found;
    const status status = store_find(sweep->store, &run, &found, &row);
    if (status != STATUS_OK)
        return status;
    print_labels(sweep, &run, out);
    print_figures(&row, out);
    for (int i = 0; i < count; i++)
        print_number(shown[i], &run, &row, out);
    fputs("\n", out);
    return STATUS_OK;
}

static void print_none(const sweep *sweep, const query *query, uint64_t trace, int cells, FILE *out)
{
    fputs("|", out);
    print_cell(sweep->traces[trace].label, out);
    fprintf(out, " no run%s%s%s |", query->exact ? " is exact" : "", query->exact && query->bound_count ? " and" : "",
            query->bound_count ? " meets all bounds" : "");
    for (int i = 0; i < cells; i++)
        fputs(" |", out);
    fputs("\n", out);
}

static status print_all(sweep *sweep, const query *query, candidate *best, FILE *out)
{
    const measure *shown[SWEEP_BOUNDS_MAX + 1];
    const int count = list_measures(query, shown);
    uint64_t absent = 0;
    status status = STATUS_OK;
    fputs(LABELS_HEADING FIGURES_HEADING, out);
    for (int i = 0; i < count; i++)
        print_cell(shown[i]->name, out);
    fputs("\n" LABELS_RULE FIGURES_RULE, out);
    for (int i = 0; i < count; i++)
        fputs("---:|", out);
    fputs("\n", out);
    for (uint64_t t = 0; status == STATUS_OK && t < sweep->trace_count; t++) {
        uint64_t found = 0;
        status = search_trace(sweep, query, t, best, &found, &absent);
        if (status == STATUS_OK && found == 0)
            print_none(sweep, query, t, count + 6, out);
        for (uint64_t i = 0; status == STATUS_OK && i < found; i++)
            status = print_run(sweep, query, best[i].index, out);
    }
    if (absent > 0)
        fprintf(out, "\n%" PRIu64 " runs of the level %s are not there yet.\n", absent,
                query->level.name);
    return status == STATUS_OK && ferror(out) ? STATUS_IO : status;
}

status sweep_print_query(sweep *sweep, const sweep_query *words, FILE *out)
{
    query query;
    status status = read_query(sweep, words, sweep->report, &query);
    if (status != STATUS_OK)
        return status;
    candidate *best = calloc(query.top, sizeof *best);
    if (!best)
        return report_error(sweep->report, STATUS_IO, "out of memory");
    status = print_all(sweep, &query, best, out);
    free(best);
    return status;
}
