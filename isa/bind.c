// A program and a machine's limits in, a program ready for dispatch out: planes' formats, lowered passes,
// constants spread over lanes, operands settled to places, and which registers must start as zero.
#include "bind.h"

#include <stdlib.h>
#include <string.h>

uint32_t bind_value(const bound_program *bound, const value *value)
{
    switch (value->kind) {
    case VALUE_UINT:
    case VALUE_FLOAT: return value->bits;
    case VALUE_FAR: return format_far_code(value->format >= 0 ? (format)value->format : bound->limits.depth_format);
    case VALUE_STENCIL_MAX: return (1u << bound->limits.stencil_bits) - 1;
    case VALUE_NEAR:
    case VALUE_BACKGROUND:
    case VALUE_BATCH_NEAR:  // settled by the replay, which knows the batches
    case VALUE_BATCH_FAR:
    case VALUE_RGBA: break;
    }
    return 0;
}

uint8_t bind_constant(bound_program *bound, uint32_t bits)
{
    // Those of the program keep their numbers; what lowering adds comes behind them and is shared.
    for (int i = bound->source->constant_count; i < bound->constant_count; i++)
        if (bound->constants[i] == bits)
            return (uint8_t)(SOURCE_CONSTANT + i);
    if (bound->constant_count == BOUND_CONSTANT_MAX)
        bound->constants_full = true;
    else
        bound->constants[bound->constant_count++] = bits;
    return (uint8_t)(SOURCE_CONSTANT + bound->constant_count - 1);
}

static bound_source place_source(bound_program *bound, uint8_t source)
{
    if (source < SOURCE_CONSTANT)
        bound->sources |= 1u << source;
    if (source >= SOURCE_CONSTANT)
        return (bound_source){BASE_CONSTANT, 0, (uint16_t)((source - SOURCE_CONSTANT) * TILE_LANES)};
    if (source >= SOURCE_DEPTH) {
        const format format = source == SOURCE_DEPTH ? bound->limits.depth_format : (enum format)(source - SOURCE_DEPTH_FORMAT);
        bound->depth_formats |= 1u << format;
        return (bound_source){(uint8_t)(BASE_DEPTH + format), 0, 0};
    }
    if (source == SOURCE_PRIMITIVE)
        return (bound_source){BASE_PRIMITIVE, 0, 0};
    if (source == SOURCE_FRAGMENT_COLOR)
        return (bound_source){BASE_STATE, PLACE_STRAIGHT, 0};
    if (source == SOURCE_FRAGMENT_PREMUL)
        return (bound_source){BASE_STATE, PLACE_PREMULTIPLIED, 0};
    if (source >= SOURCE_COLOR)
        return (bound_source){BASE_STATE, PLACE_STATE, (uint16_t)(STATE_COLORS + (source - SOURCE_COLOR) * 4 * TILE_LANES)};
    return (bound_source){BASE_STATE, 0, (uint16_t)(STATE_REGISTERS + source * TILE_LANES)};
}

static bool is_under(const blend_decl *blend)
{
    return blend->rgb.equation == EQUATION_add && blend->rgb.source == FACTOR_dst_alpha &&
           blend->rgb.destination == FACTOR_one && blend->alpha.equation == EQUATION_add &&
           blend->alpha.source == FACTOR_zero && blend->alpha.destination == FACTOR_one_minus_src_alpha;
}

static void settle_operands(bound_program *bound, instruction i, bound_instruction *out, bool has_skip)
{
    const opcode_row *row = &opcode_table[i.op];
    memset(out, 0, sizeof *out);
    out->op = (uint8_t)i.op;
    out->guard = i.guard;
    out->writes_predicate = row->d == OPERAND_PRED;
    out->guard_negated = i.guard_negated;
    out->masked = i.guard != 0 || has_skip;  // a lane that skips ahead keeps its registers
    out->d = i.d;
    out->a = i.a;
    out->b = i.b;
    out->c = i.c;
    if (operand_is_register(row->d))
        out->d_offset = place_source(bound, i.d).offset;
    if (row->a == OPERAND_PRED) {
        out->a = i.a & 7;
        out->a_negated = i.a >> 3;
    } else if (operand_is_source(row->a)) {
        out->source_a = place_source(bound, i.a);
    }
    if (row->b == OPERAND_PRED) {
        out->b = i.b & 7;
        out->b_negated = i.b >> 3;
    } else if (operand_is_source(row->b)) {
        out->source_b = place_source(bound, i.b);
    }
    out->under = i.op == OP_blend && is_under(&bound->source->blends[i.c]);
    const int plane = row->d == OPERAND_PLANE ? i.d : i.a;
    out->color = row->d == OPERAND_PLANE || row->a == OPERAND_PLANE
                     ? format_table[bound->plane_formats[plane]].class == FORMAT_CLASS_COLOR
                     : i.d >= SOURCE_COLOR;
}

// ---- Registers that may be read before they are written ------------------------------------------------

// What a register holds so far: nothing, a value in every lane, or a value where predicate `guard` held
// when it had version `version`.
typedef struct definition { bool all, some; uint8_t guard; bool negated; int version; } definition;

typedef struct flow {
    definition registers[SOURCE_COLOR + COLOR_COUNT];
    int predicate_version[PREDICATE_COUNT];
} flow;

static void note_read(const flow *flow, bound_kernel *kernel, uint8_t source, instruction reader, bool has_skip)
{
    if (source >= SOURCE_COLOR + COLOR_COUNT)
        return;
    const definition *def = &flow->registers[source];
    const bool same_guard = def->some && reader.guard && def->guard == reader.guard && def->negated == reader.guard_negated &&
                            def->version == flow->predicate_version[reader.guard];
    if (!has_skip && (def->all || same_guard))
        return;
    if (source < SOURCE_COLOR)
        kernel->zero_registers |= 1u << source;
    else
        kernel->zero_colors |= 1u << (source - SOURCE_COLOR);
}

static void note_write(flow *flow, uint8_t destination, instruction writer)
{
    definition *def = &flow->registers[destination];
    if (def->all)
        return;
    if (writer.guard == 0)
        *def = (definition){.all = true};
    else
        *def = (definition){false, true, writer.guard, writer.guard_negated, flow->predicate_version[writer.guard]};
}

static void find_zeros(bound_kernel *kernel)
{
    const bool has_skip = kernel->has_skip;
    flow flow = {0};
    for (int w = 0; w < kernel->count; w++) {
        const instruction i = kernel->words[w];
        const opcode_row *row = &opcode_table[i.op];
        if (operand_is_source(row->a))
            note_read(&flow, kernel, i.a, i, has_skip);
        if (operand_is_source(row->b))
            note_read(&flow, kernel, i.b, i, has_skip);
        if (i.op == OP_put)  // the other components stay
            note_read(&flow, kernel, i.d, i, has_skip);
        if (operand_is_register(row->d))
            note_write(&flow, i.d, i);
        if (row->d == OPERAND_PRED)
            flow.predicate_version[i.d]++;
    }
}

// ---- The program ---------------------------------------------------------------------------------------

static bool bind_kernel(bound_program *bound, int k)
{
    const kernel_decl *decl = &bound->source->kernels[k];
    bound_kernel *kernel = &bound->kernels[k];
    if (decl->is_pass) {
        if (!lower_pass(bound, &decl->pass, kernel->words, kernel->stages, &kernel->count))
            return false;
    } else {
        kernel->count = decl->word_count;
        for (int w = 0; w < decl->word_count; w++)
            word_decode(decl->words[w], &kernel->words[w]);
    }
    for (int w = 0; w < kernel->count; w++)
        kernel->has_skip |= kernel->words[w].op == OP_skip;
    for (int w = 0; w < kernel->count; w++)
        settle_operands(bound, kernel->words[w], &kernel->code[w], kernel->has_skip);
    find_zeros(kernel);
    shorten_kernel(kernel);
    return true;
}

status bind_program(const program *program, const rop_limits *limits, bool reversed_depth, const float background[4],
                    const report *report, bound_program **result)
{
    *result = NULL;
    bound_program *bound = calloc(1, sizeof *bound);
    if (!bound)
        return report_error(report, STATUS_IO, "out of memory");
    bound->source = program;
    bound->limits = *limits;
    bound->reversed_depth = reversed_depth;
    memcpy(bound->background, background, sizeof bound->background);
    for (int i = 0; i < program->plane_count; i++) {
        bound->plane_formats[i] = plane_format(&program->planes[i], limits);
        const int bits = plane_bits(&program->planes[i], limits);
        bound->plane_masks[i] = bits >= 32 ? UINT32_MAX : (1u << bits) - 1;
    }
    for (int i = 0; i < program->constant_count; i++)
        bound->constants[bound->constant_count++] = bind_value(bound, &program->constants[i]);
    bound->kernels = calloc(program->kernel_count ? (size_t)program->kernel_count : 1, sizeof *bound->kernels);
    for (int k = 0; bound->kernels && k < program->kernel_count; k++) {
        const bool fits = bind_kernel(bound, k);
        if (bound->constants_full) {
            bound_destroy(bound);
            return report_error(report, STATUS_REFUSED,
                                "with pass '%s' the passes need more than %d constants for their stencil values",
                                program->kernels[k].name, BOUND_CONSTANT_MAX);
        }
        if (!fits) {
            bound_destroy(bound);
            return report_error(report, STATUS_REFUSED, "pass '%s' lowers to more than %d instructions",
                                program->kernels[k].name, LOWERED_MAX);
        }
    }
    bound->constant_lanes = aligned_alloc(64, sizeof *bound->constant_lanes * BOUND_CONSTANT_MAX);
    if (!bound->kernels || !bound->constant_lanes) {
        bound_destroy(bound);
        return report_error(report, STATUS_IO, "out of memory");
    }
    for (int i = 0; i < bound->constant_count; i++)
        for (int lane = 0; lane < TILE_LANES; lane++)
            bound->constant_lanes[i][lane] = bound->constants[i];
    *result = bound;
    return STATUS_OK;
}

void bound_destroy(bound_program *bound)
{
    if (!bound)
        return;
    free(bound->kernels);
    free(bound->constant_lanes);
    free(bound);
}

const instruction *bound_instructions(const bound_program *bound, int kernel, int *count)
{
    *count = bound->kernels[kernel].count;
    return bound->kernels[kernel].words;
}

pass_stage bound_stage(const bound_program *bound, int kernel, int word)
{
    return (pass_stage)bound->kernels[kernel].stages[word];
}

uint32_t bound_constant(const bound_program *bound, int index)
{
    return bound->constants[index];
}

format bound_plane_format(const bound_program *bound, int plane)
{
    return bound->plane_formats[plane];
}

uint32_t bound_plane_mask(const bound_program *bound, int plane)
{
    return bound->plane_masks[plane];
}

uint32_t bound_depth_formats(const bound_program *bound)
{
    return bound->depth_formats;
}

bool bound_reads(const bound_program *bound, int source)
{
    return bound->sources >> source & 1;
}

void bound_clear_value(const bound_program *bound, const step *clear, uint32_t value[4])
{
    const format format = bound->plane_formats[clear->plane];
    memset(value, 0, 4 * sizeof *value);
    if (format_table[format].class != FORMAT_CLASS_COLOR) {
        const bool far = clear->value.kind == VALUE_FAR && clear->value.format < 0 &&
                         format_table[format].class == FORMAT_CLASS_DEPTH;
        // `far` is the plane's own farthest code, whatever the machine's depth format is.
        value[0] = (far ? format_far_code(format) : bind_value(bound, &clear->value)) & bound->plane_masks[clear->plane];
        return;
    }
    const float *rgba = clear->value.kind == VALUE_BACKGROUND ? bound->background : clear->value.rgba;
    for (int i = 0; i < 4; i++) {
        const float rounded = format_round_component(format, rgba[i]);
        memcpy(&value[i], &rounded, sizeof rounded);
    }
}
