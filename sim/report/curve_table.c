// Passes against bits a sample as a Markdown table for pages and as CSV for other tools.
#include "../sim.h"

#include <inttypes.h>

bool curve_is_best(const trade_curve *curve, int program, int trace)
{
    const curve_program *p = &curve->programs[program];
    const uint64_t passes = curve->passes[program * curve->trace_count + trace];
    if (!p->runs || !p->exact)
        return false;
    for (int i = 0; i < curve->program_count; i++) {
        const curve_program *other = &curve->programs[i];
        const uint64_t others = curve->passes[i * curve->trace_count + trace];
        if (other->runs && other->exact &&
            ((other->bits <= p->bits && others < passes) || (other->bits < p->bits && others == passes)))
            return false;
    }
    return true;
}

static void print_traces(const trade_curve *curve, FILE *out)
{
    for (int i = 0; i < curve->trace_count; i++) {
        const curve_trace *t = &curve->traces[i];
        fprintf(out, "%s: %u x %u pixels, %u %s a pixel, %" PRIu64 " fragments, at most %" PRIu64 " at a sample  \n",
                t->label, t->width, t->height, t->samples, t->samples == 1 ? "sample" : "samples", t->fragments,
                t->deepest);
    }
}

status curve_print(const trade_curve *curve, FILE *out)
{
    print_traces(curve, out);
    fputs("\n| | program | bits a sample |", out);
    for (int i = 0; i < curve->trace_count; i++)
        fprintf(out, " %s |", curve->traces[i].label);
    fputs(" exact |\n|---:|---|---:|", out);
    for (int i = 0; i < curve->trace_count; i++)
        fputs("---:|", out);
    fputs("---|\n", out);
    for (int i = 0; i < curve->program_count; i++) {
        const curve_program *p = &curve->programs[i];
        fprintf(out, "| %d | %s | %u |", i + 1, p->name, p->bits);
        for (int k = 0; k < curve->trace_count; k++) {
            const char *mark = curve_is_best(curve, i, k) ? "**" : "";
            if (p->runs)
                fprintf(out, " %s%" PRIu64 "%s |", mark, curve->passes[i * curve->trace_count + k], mark);
            else
                fputs(" - |", out);
        }
        if (!p->runs)
            fputs(" the machine refuses it |\n", out);
        else if (p->exact)
            fputs(" yes |\n", out);
        else
            fprintf(out, " no: %.2g |\n", p->error);
    }
    fputs("\nPasses are geometry passes. Bold: no exact program with as many bits takes fewer.\n", out);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}

// In quotes, doubled inside, as RFC 4180 has it: names of programs hold commas.
static void write_text(FILE *file, const char *text)
{
    fputc('"', file);
    for (; *text; text++)
        fprintf(file, *text == '"' ? "\"\"" : "%c", *text);
    fputc('"', file);
}

status curve_write_csv(const trade_curve *curve, const char *path, const report *report)
{
    aside *aside;
    FILE *file;
    const status status = aside_open(path, report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    fputs("program,bits_per_sample,trace,deepest_sample,geometry_passes,exact,largest_error,best\r\n", file);
    for (int i = 0; i < curve->program_count; i++) {
        const curve_program *p = &curve->programs[i];
        for (int k = 0; p->runs && k < curve->trace_count; k++) {
            write_text(file, p->name);
            fprintf(file, ",%u,", p->bits);
            write_text(file, curve->traces[k].label);
            fprintf(file, ",%" PRIu64 ",%" PRIu64 ",%d,%.17g,%d\r\n", curve->traces[k].deepest,
                    curve->passes[i * curve->trace_count + k], p->exact, p->error, curve_is_best(curve, i, k));
        }
    }
    return aside_finish(aside);
}
