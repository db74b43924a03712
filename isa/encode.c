// A program as 32-bit words and back: what `asm` writes and `disasm` reads. One walk over the program
// serves both directions, so that they cannot fall out of step. docs/isa.md lists the order of the words.
//
// Decoding trusts nothing: counts and table rows are bounded in the walk; then the program is written out as
// text, assembled, and must encode to the same words. So the assembler's rules are the only rules.
#include "isa.h"

#include <stdlib.h>
#include <string.h>

enum { MAGIC = 0x42504f52, VERSION = 1 };  // "ROPB"

typedef struct walker {
    uint32_t *words;
    size_t count, capacity, at;
    bool decoding, bad;
} walker;

static void walk_word(walker *w, uint32_t *word)
{
    if (w->decoding) {
        if (w->at >= w->count)
            w->bad = true;
        else
            *word = w->words[w->at++];
        return;
    }
    if (w->count == w->capacity) {
        const size_t capacity = w->capacity ? 2 * w->capacity : 1024;
        uint32_t *grown = realloc(w->words, capacity * sizeof *grown);
        if (!grown) {
            w->bad = true;
            return;
        }
        w->words = grown;
        w->capacity = capacity;
    }
    w->words[w->count++] = *word;
}

// A number from `least` up to, not with, `end`.
static int walk_int(walker *w, int value, int least, int end)
{
    uint32_t word = (uint32_t)value;
    walk_word(w, &word);
    value = (int)word;
    if (value < least || value >= end) {
        w->bad = true;
        return least < 0 ? 0 : least;
    }
    return value;
}

#define WALK(w, field, least, end) ((field) = (__typeof__(field))walk_int(w, (int)(field), least, end))

static void walk_float(walker *w, float *value)
{
    uint32_t word;
    memcpy(&word, value, sizeof word);
    walk_word(w, &word);
    memcpy(value, &word, sizeof word);
}

static void walk_name(walker *w, char name[NAME_SIZE])
{
    for (int i = 0; i < NAME_SIZE; i += 4) {
        uint32_t word = 0;
        for (int j = 0; j < 4; j++)
            word |= (uint32_t)(unsigned char)name[i + j] << 8 * j;
        walk_word(w, &word);
        for (int j = 0; j < 4; j++)
            name[i + j] = (char)(word >> 8 * j & 255);
    }
    name[NAME_SIZE - 1] = 0;
}

static void walk_value(walker *w, value *value)
{
    WALK(w, value->kind, 0, VALUE_BATCH_FAR + 1);
    walk_word(w, &value->bits);
    WALK(w, value->format, -1, FORMAT_COUNT);
    for (int i = 0; i < 4; i++)
        walk_float(w, &value->rgba[i]);
}

static void walk_pass(walker *w, pass_decl *pass, const program *p)
{
    WALK(w, pass->shader, -1, p->kernel_count);
    WALK(w, pass->keep, 0, PREDICATE_COUNT);
    WALK(w, pass->keep_negated, 0, 2);
    WALK(w, pass->clip_count, 0, CLIP_MAX + 1);
    for (int i = 0; i < pass->clip_count; i++) {
        WALK(w, pass->clips[i].function, 0, BOUND_greater + 1);
        WALK(w, pass->clips[i].plane_count, 1, CLIP_MAX + 1);
        for (int j = 0; j < pass->clips[i].plane_count && j < CLIP_MAX; j++)
            WALK(w, pass->clips[i].plane[j], 0, p->plane_count);
    }
    WALK(w, pass->depth_plane, -1, p->plane_count);
    WALK(w, pass->depth_function, 0, COMPARE_FUNCTION_COUNT);
    WALK(w, pass->depth_write, 0, 2);
    WALK(w, pass->stencil_plane, -1, p->plane_count);
    WALK(w, pass->stencil_function, 0, COMPARE_FUNCTION_COUNT);
    WALK(w, pass->stencil_reference, 0, 256);
    WALK(w, pass->stencil_mask, 0, 256);
    WALK(w, pass->stencil_write_mask, 0, 256);
    WALK(w, pass->stencil_fail, 0, STENCIL_OPERATION_COUNT);
    WALK(w, pass->stencil_depth_fail, 0, STENCIL_OPERATION_COUNT);
    WALK(w, pass->stencil_pass, 0, STENCIL_OPERATION_COUNT);
    WALK(w, pass->target_count, 0, TARGET_MAX + 1);
    for (int i = 0; i < pass->target_count; i++) {
        WALK(w, pass->targets[i].plane, 0, p->plane_count);
        WALK(w, pass->targets[i].blend, -1, p->blend_count);
        WALK(w, pass->targets[i].source, SOURCE_COLOR, SOURCE_FRAGMENT_PREMUL + 1);
    }
    WALK(w, pass->query, -1, p->query_count);
}

// Whether every field of the instruction indexes something that is there.
static bool instruction_fits(uint32_t word, const program *p, int at, int word_count)
{
    instruction i;
    if (!word_decode(word, &i))
        return false;
    const opcode_row *row = &opcode_table[i.op];
    const operand_kind kinds[] = {row->d, row->a, row->b, row->c};
    const uint8_t fields[] = {i.d, i.a, i.b, i.c};
    for (int k = 0; k < 4; k++) {
        const int field = fields[k];
        switch (kinds[k]) {
        case OPERAND_PLANE: if (field >= p->plane_count) return false; break;
        case OPERAND_QUERY: if (field >= p->query_count) return false; break;
        case OPERAND_BLEND: if (field >= p->blend_count) return false; break;
        case OPERAND_FORMAT: if (field >= FORMAT_COUNT) return false; break;
        case OPERAND_LABEL: if (field < 1 || at + field > word_count) return false; break;
        default:
            if (field >= SOURCE_CONSTANT ? field - SOURCE_CONSTANT >= p->constant_count
                                         : field >= SOURCE_DEPTH_FORMAT + FORMAT_COUNT)
                return false;
        }
    }
    return true;
}

static void walk_kernel(walker *w, kernel_decl *kernel, const program *p)
{
    walk_name(w, kernel->name);
    WALK(w, kernel->fullscreen, 0, 2);
    WALK(w, kernel->is_pass, 0, 2);
    WALK(w, kernel->is_shader, 0, 2);
    if (kernel->is_pass) {
        walk_pass(w, &kernel->pass, p);
        return;
    }
    WALK(w, kernel->word_count, 0, WORD_MAX + 1);
    for (int i = 0; i < kernel->word_count; i++) {
        walk_word(w, &kernel->words[i]);
        if (w->decoding && !instruction_fits(kernel->words[i], p, i, kernel->word_count))
            w->bad = true;
    }
}

static void walk_step(walker *w, step *step, const program *p)
{
    WALK(w, step->kind, 0, STEP_END_BATCHES + 1);
    WALK(w, step->plane, 0, p->plane_count + (p->plane_count == 0));
    WALK(w, step->source, 0, p->plane_count + (p->plane_count == 0));
    const int named = step->kind == STEP_LIST ? p->blend_count : p->kernel_count;
    WALK(w, step->kernel, 0, named + (named == 0));
    WALK(w, step->query, 0, p->query_count + (p->query_count == 0));
    WALK(w, step->classes, 0, DRAW_BATCH + 1);
    WALK(w, step->entries, 0, 65537);
    WALK(w, step->target, 0, STEP_MAX);
    walk_value(w, &step->value);
}

static void walk_declarations(walker *w, program *p)
{
    WALK(w, p->plane_count, 0, PLANE_MAX + 1);
    for (int i = 0; i < p->plane_count; i++) {
        walk_name(w, p->planes[i].name);
        WALK(w, p->planes[i].kind, 0, PLANE_FORMAT + 1);
        WALK(w, p->planes[i].format, 0, FORMAT_COUNT);
    }
    WALK(w, p->query_count, 0, QUERY_MAX + 1);
    for (int i = 0; i < p->query_count; i++)
        walk_name(w, p->queries[i].name);
    WALK(w, p->blend_count, 0, BLEND_MAX + 1);
    for (int i = 0; i < p->blend_count; i++) {
        blend_decl *blend = &p->blends[i];
        walk_name(w, blend->name);
        WALK(w, blend->rgb.equation, 0, BLEND_EQUATION_COUNT);
        WALK(w, blend->rgb.source, 0, BLEND_FACTOR_COUNT);
        WALK(w, blend->rgb.destination, 0, BLEND_FACTOR_COUNT);
        WALK(w, blend->alpha.equation, 0, BLEND_EQUATION_COUNT);
        WALK(w, blend->alpha.source, 0, BLEND_FACTOR_COUNT);
        WALK(w, blend->alpha.destination, 0, BLEND_FACTOR_COUNT);
        WALK(w, blend->composites, 0, 2);
    }
    WALK(w, p->constant_count, 0, CONSTANT_MAX + 1);
    for (int i = 0; i < p->constant_count; i++)
        walk_value(w, &p->constants[i]);
}

static void walk_program(walker *w, program *p)
{
    walk_int(w, MAGIC, MAGIC, MAGIC + 1);
    walk_int(w, VERSION, VERSION, VERSION + 1);
    walk_name(w, p->name);
    walk_declarations(w, p);
    WALK(w, p->kernel_count, 0, KERNEL_MAX + 1);
    for (int i = 0; i < p->kernel_count && !w->bad; i++)
        walk_kernel(w, &p->kernels[i], p);
    WALK(w, p->step_count, 0, STEP_MAX + 1);
    for (int i = 0; i < p->step_count && !w->bad; i++)
        walk_step(w, &p->steps[i], p);
    WALK(w, p->max_iterations, 0, 1000000001);
    float ratio = (float)p->occlusion_ratio;
    walk_float(w, &ratio);
    p->occlusion_ratio = (double)ratio;
    WALK(w, p->output_front, -1, p->plane_count);
    WALK(w, p->output_base, 0, p->plane_count);
}

status program_encode(const program *source, uint32_t **words, size_t *count)
{
    walker walker = {0};
    program copy = *source;  // the walk takes what it may write to
    walk_program(&walker, &copy);
    *words = walker.words;
    *count = walker.count;
    if (!walker.bad)
        return STATUS_OK;
    free(walker.words);
    *words = NULL;
    *count = 0;
    return STATUS_IO;
}

static status same_after_assembly(const char *file, const program *decoded, const uint32_t *words, size_t count,
                                  const report *report, program **result)
{
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return report_error(report, STATUS_IO, "%s: out of memory", file);
    disassemble_text(decoded, stream);
    fclose(stream);
    status status = assemble_text(file, text, size, report, result);
    free(text);
    uint32_t *again = NULL;
    size_t again_count = 0;
    if (status == STATUS_OK)
        status = program_encode(*result, &again, &again_count);
    if (status == STATUS_OK && (again_count != count || memcmp(again, words, count * sizeof *words) != 0))
        status = report_error(report, STATUS_REFUSED, "%s: is not what the assembler would have written", file);
    free(again);
    if (status != STATUS_OK) {
        program_destroy(*result);
        *result = NULL;
    }
    return status;
}

status program_decode(const char *file, const uint32_t *words, size_t count, const report *report, program **result)
{
    *result = NULL;
    program *decoded = calloc(1, sizeof *decoded);
    uint32_t *copy = malloc(count ? count * sizeof *copy : 1);
    if (!decoded || !copy) {
        free(decoded);
        free(copy);
        return report_error(report, STATUS_IO, "%s: out of memory", file);
    }
    if (count)
        memcpy(copy, words, count * sizeof *copy);
    walker walker = {.words = copy, .count = count, .decoding = true};
    walk_program(&walker, decoded);
    const status status =
        walker.bad || walker.at != count
            ? report_error(report, STATUS_REFUSED, "%s: not a ROP program in words (of version %d): word %zu of %zu does not fit",
                           file, VERSION, walker.at, count)
            : same_after_assembly(file, decoded, words, count, report, result);
    free(copy);
    free(decoded);
    return status;
}
