// `ropsim trade`: what each level of detail costs and how far off it is, on the user's own traces.
#include "sampling_words.h"
#include "trade.h"

#include <stdlib.h>

enum { ROW_PROGRAM, ROW_MACHINE, ROW_SET, ROW_SEEDS, ROW_SAMPLE_EVERY, ROW_SAMPLE_WINDOW, ROW_SEED, ROW_JSON };
static const command_option option_rows[] = {
    [ROW_PROGRAM] = {"program", 0, "PROGRAM", "may be repeated; default: layer_peel and fused_coherent_layer_peel"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE", "may be repeated; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of every machine; may be repeated"},
    [ROW_SEEDS] = {"seeds", 0, "N", "sampled: runs with other windows; default 1"},
    [ROW_SAMPLE_EVERY] = SAMPLE_EVERY_ROW,
    [ROW_SAMPLE_WINDOW] = SAMPLE_WINDOW_ROW,
    [ROW_SEED] = SEED_ROW,
    [ROW_JSON] = {"json", 0, "FILE", "write all figures of every level and seed as JSON"},
    {0},
};
enum { PATH_SIZE = 4096, WORDS_MAX = 64 };

typedef struct trading {
    const char *traces[WORDS_MAX], *programs[WORDS_MAX], *machine_names[WORDS_MAX], *json;
    int trace_count, program_count, machine_count;
    machine machines[WORDS_MAX];
    uint64_t seeds;
    sampling_words words;
    trade_row *rows;
    int row_count;
} trading;

static bool add_word(const char *what, const char *word, const char **words, int *count)
{
    if (*count < WORDS_MAX) {
        words[(*count)++] = word;
        return true;
    }
    report_error(&command_report, STATUS_USAGE, "too many %s: %d are the most", what, WORDS_MAX);
    return false;
}

static bool take_option(int option, const char *value, trading *t)
{
    switch (option) {
    case ROW_PROGRAM: return add_word("programs", value, t->programs, &t->program_count);
    case ROW_MACHINE: return add_word("machines", value, t->machine_names, &t->machine_count);
    case ROW_SEEDS: return command_uint("seeds", value, 1, TRADE_SEEDS_MAX, &t->seeds);
    case ROW_JSON: t->json = value; return true;
    case ROW_SET: return true;  // taken with each machine
    default: return sampling_words_take(option_rows[option].name, value, &t->words);
    }
}

// Whether the program runs on the machine; what does not is left out, after a warning.
static status runs_on(const char *name, const machine *machine, bool *runs)
{
    char path[PATH_SIZE];
    rop_limits limits;
    program *program;
    const status status = program_load(name, &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    machine_limits(machine, &limits);
    *runs = verify_program(program, path, &limits, NULL) == STATUS_OK;
    program_destroy(program);
    if (!*runs)
        report_warning(&command_report, "%s does not run on the machine %s and is left out", name, machine->name);
    return STATUS_OK;
}

static status measure(trading *t, const char *trace, const char *program, const machine *machine, const sampling *sampling)
{
    trade_row *row = &t->rows[t->row_count];
    *row = (trade_row){.trace = trace, .program = program, .machine = machine, .seed_count = (int)t->seeds,
                       .seeds = calloc(t->seeds, sizeof *row->seeds)};
    t->row_count++;
    if (!row->seeds)
        return report_error(&command_report, STATUS_IO, "out of memory");
    return trade_measure(row, sampling);
}

static status trade(trading *t)
{
    bool runs[WORDS_MAX][WORDS_MAX] = {{false}}, any = false;
    const sampling sampling = sampling_words_get(&t->words);
    status status = STATUS_OK;
    for (int p = 0; p < t->program_count; p++)
        for (int m = 0; status == STATUS_OK && m < t->machine_count; m++) {
            status = runs_on(t->programs[p], &t->machines[m], &runs[p][m]);
            any |= runs[p][m];
        }
    if (status == STATUS_OK && !any)
        return report_error(&command_report, STATUS_REFUSED, "none of the programs runs on any of the machines");
    for (int i = 0; i < t->trace_count; i++)
        for (int p = 0; p < t->program_count; p++)
            for (int m = 0; status == STATUS_OK && m < t->machine_count; m++)
                if (runs[p][m])
                    status = measure(t, t->traces[i], t->programs[p], &t->machines[m], &sampling);
    if (status != STATUS_OK)
        return status;
    trade_print(t->rows, t->row_count);
    return t->json ? trade_write_json(t->rows, t->row_count, &sampling, t->json) : STATUS_OK;
}

int command_trade(int argc, char **argv)
{
    trading t = {.seeds = 1, .words = sampling_words_default()};
    command_line line = {.argc = argc, .argv = argv, .options = option_rows};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND ? !add_word("traces", line.value, t.traces, &t.trace_count) : !take_option(option, line.value, &t))
            return STATUS_USAGE;
    }
    if (t.trace_count == 0)
        return (int)command_usage("trade", "a trace is wanted");
    if (t.program_count == 0) {
        t.programs[t.program_count++] = "layer_peel";
        t.programs[t.program_count++] = "fused_coherent_layer_peel";
    }
    if (t.machine_count == 0)
        t.machine_names[t.machine_count++] = COMMAND_DEFAULT_MACHINE;
    status status = STATUS_OK;
    for (int m = 0; status == STATUS_OK && m < t.machine_count; m++)
        status = command_find_machine(t.machine_names[m], argc, argv, option_rows, ROW_SET, &t.machines[m]);
    t.rows = calloc((size_t)t.trace_count * (size_t)t.program_count * (size_t)t.machine_count, sizeof *t.rows);
    if (status == STATUS_OK && !t.rows)
        status = report_error(&command_report, STATUS_IO, "out of memory");
    if (status == STATUS_OK)
        status = trade(&t);
    for (int i = 0; i < t.row_count; i++)
        free(t.rows[i].seeds);
    free(t.rows);
    return (int)status;
}
