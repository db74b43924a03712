// A kernel and one fragment in; what it tested, wrote and counted out, in the words of the program.
//
// Registers have no meaning to a reader: each remembers what it was loaded from, so that `lt p1, r0, z` is told as
// z_peel 0.25 < z 0.5. A declared pass is told as its state; the lowered instructions give the verdicts.
#include "history.h"

#include <string.h>

// What a register holds, without its value.
typedef struct origin {
    char name[NAME_SIZE + 4];
    format format;
} origin;

typedef struct observer {
    history *history;
    int kernel;
    const fragment_input *fragment;
    origin registers[SOURCE_COLOR + COLOR_COUNT];
    int clips;  // tested so far
    bool stencil_tested, depth_tested;
} observer;

static origin make_origin(const char *name, format format)
{
    origin origin = {.format = format};
    snprintf(origin.name, sizeof origin.name, "%s", name);
    return origin;
}

static origin computed(int d, format format)
{
    origin origin = {.format = format};
    snprintf(origin.name, sizeof origin.name, "%c%d", d < SOURCE_COLOR ? 'r' : 'c',
             d < SOURCE_COLOR ? d : d - SOURCE_COLOR);
    return origin;
}

static origin constant_origin(const history *h, int index)
{
    if (index >= h->program->constant_count)  // of a pass's state
        return make_origin("", FORMAT_u32);
    const value *value = &h->program->constants[index];
    switch (value->kind) {
    case VALUE_NEAR: return make_origin("near", FORMAT_u32);
    case VALUE_FAR: return make_origin("far", value->format >= 0 ? (format)value->format : h->limits->depth_format);
    case VALUE_STENCIL_MAX: return make_origin("stencil_max", FORMAT_u32);
    case VALUE_FLOAT: return make_origin("", FORMAT_f32);
    case VALUE_UINT:
    case VALUE_BACKGROUND:
    case VALUE_RGBA:
    case VALUE_BATCH_NEAR:
    case VALUE_BATCH_FAR: break;
    }
    return make_origin("", FORMAT_u32);
}

static origin source_origin(const observer *o, int source)
{
    const history *h = o->history;
    if (source >= SOURCE_CONSTANT)
        return constant_origin(h, source - SOURCE_CONSTANT);
    if (source >= SOURCE_DEPTH_FORMAT)
        return make_origin("z", (format)(source - SOURCE_DEPTH_FORMAT));
    switch (source) {
    case SOURCE_DEPTH: return make_origin("z", h->limits->depth_format);
    case SOURCE_PRIMITIVE: return make_origin("primitive", FORMAT_u32);
    case SOURCE_FRAGMENT_COLOR: return make_origin("color", FORMAT_rgba32f);
    case SOURCE_FRAGMENT_PREMUL: return make_origin("premul", FORMAT_rgba32f);
    default: return o->registers[source];
    }
}

static origin component_origin(const observer *o, const stepped *s)
{
    const origin color = source_origin(o, s->instruction.a);
    origin origin = {.format = FORMAT_f32};
    snprintf(origin.name, sizeof origin.name, "%.*s.%c", NAME_SIZE - 1, color.name, "rgba"[s->instruction.b & 3]);
    return origin;
}

// Where the register that an instruction wrote has its value from.
static void note_origin(observer *o, const stepped *s)
{
    const instruction i = s->instruction;
    const operand_kind kind = opcode_table[i.op].d;
    if (kind != OPERAND_REG && kind != OPERAND_COLOR && kind != OPERAND_ANY)
        return;
    origin *to = &o->registers[i.d];
    switch (i.op) {
    case OP_ld:
    case OP_tex:
        *to = make_origin(o->history->program->planes[i.a].name, bound_plane_format(o->history->bound, i.a));
        break;
    case OP_mov: *to = source_origin(o, i.a); break;
    case OP_min:
    case OP_max: *to = source_origin(o, s->after[0] == s->a[0] ? i.a : i.b); break;
    case OP_get: *to = component_origin(o, s); break;
    case OP_utof:
    case OP_ztof:
        *to = source_origin(o, i.a);
        to->format = FORMAT_f32;
        break;
    default: *to = computed(i.d, opcode_table[i.op].unit == UNIT_FLOAT && i.op != OP_ftou ? FORMAT_f32 : FORMAT_u32);
    }
}

// ---- Events --------------------------------------------------------------------------------------------

static bool is_depth(format format)
{
    return format_table[format].class == FORMAT_CLASS_DEPTH;
}

static void note_compare(observer *o, const stepped *s)
{
    static const char *const relations[OPCODE_COUNT] = {
        [OP_eq] = "=", [OP_ne] = "!=", [OP_lt] = "<", [OP_ge] = ">=", [OP_flt] = "<", [OP_fge] = ">=",
    };
    const instruction i = s->instruction;
    event *event = event_add(o->history, EVENT_COMPARE);
    origin left = source_origin(o, i.a), right = source_origin(o, i.b);
    const bool as_float = i.op == OP_flt || i.op == OP_fge;
    if (as_float)
        left.format = right.format = FORMAT_f32;
    // A constant beside a depth is a depth.
    if (i.a >= SOURCE_CONSTANT && is_depth(right.format))
        left.format = right.format;
    if (i.b >= SOURCE_CONSTANT && is_depth(left.format))
        right.format = left.format;
    // Floats that are compared as integers: their bits.
    if (!as_float && left.format == FORMAT_f32)
        left.format = FORMAT_u32;
    if (!as_float && right.format == FORMAT_f32)
        right.format = FORMAT_u32;
    event->relation = relations[i.op];
    event->holds = s->after[0];
    event->left = value_named(left.name, left.format, s->a[0]);
    event->right = value_named(right.name, right.format, s->b[0]);
}

static uint32_t depth_code(const observer *o, format format)
{
    return format_depth_to_code(format, o->fragment->depth, o->history->info->reversed_depth);
}

static const char *const compare_symbols[COMPARE_FUNCTION_COUNT] = {
    [COMPARE_never] = "never", [COMPARE_less] = "<",      [COMPARE_equal] = "=",   [COMPARE_lequal] = "<=",
    [COMPARE_greater] = ">",   [COMPARE_notequal] = "!=", [COMPARE_gequal] = ">=", [COMPARE_always] = "always",
};

// z FUNCTION min(planes), as the machine compares them: as codes, or both as floats.
static void note_clip(observer *o, const pass_decl *pass, const stepped *s)
{
    static const char *const relations[] = {
        [BOUND_less] = "<", [BOUND_lequal] = "<=", [BOUND_equal] = "=", [BOUND_gequal] = ">=", [BOUND_greater] = ">"};
    const history *h = o->history;
    const clip_decl *clip = &pass->clips[o->clips++];
    const format format = bound_plane_format(h->bound, clip->plane[0]);
    event *event = event_add(o->history, EVENT_CLIP);
    event->relation = relations[clip->function];
    event->holds = s->after[0];
    named_value right = {.format = format, .words = {UINT32_MAX}};
    size_t used = 0;
    for (int j = 0; j < clip->plane_count; j++) {
        const uint32_t code = h->planes[clip->plane[j]][0];
        right.words[0] = code < right.words[0] ? code : right.words[0];
        used += (size_t)snprintf(right.name + used, sizeof right.name - used, "%s%s",
                                 j                       ? ", "
                                 : clip->plane_count > 1 ? "min("
                                                         : "",
                                 h->program->planes[clip->plane[j]].name);
    }
    if (clip->plane_count > 1)
        snprintf(right.name + used, sizeof right.name - used, ")");
    event->left = value_named("z", format, depth_code(o, format));
    if (h->limits->clip_interpolated) {
        const bool reversed = h->info->reversed_depth;
        const float z = (float)format_code_to_depth(FORMAT_z32f, depth_code(o, FORMAT_z32f), reversed);
        const float bound = (float)format_code_to_depth(format, right.words[0], reversed);
        event->left.format = right.format = FORMAT_f32;
        memcpy(event->left.words, &z, sizeof z);
        memcpy(right.words, &bound, sizeof bound);
    }
    event->right = right;
}

static void note_stencil_test(observer *o, const pass_decl *pass, const stepped *s)
{
    const history *h = o->history;
    const uint32_t largest = bound_plane_mask(h->bound, pass->stencil_plane), mask = pass->stencil_mask & largest;
    event *event = event_add(o->history, EVENT_STENCIL);
    event->relation = compare_symbols[pass->stencil_function];
    event->holds = s->after[0];
    event->left = value_named("", FORMAT_u32, pass->stencil_reference & mask);
    event->right =
        value_named(h->program->planes[pass->stencil_plane].name, FORMAT_u32, h->planes[pass->stencil_plane][0] & mask);
    if (mask != largest) {
        const size_t used = strlen(event->right.name);
        snprintf(event->right.name + used, sizeof event->right.name - used, " & %u", mask);
    }
}

static void note_depth_test(observer *o, const pass_decl *pass, const stepped *s)
{
    const history *h = o->history;
    const format format = bound_plane_format(h->bound, pass->depth_plane);
    event *event = event_add(o->history, EVENT_DEPTH);
    event->relation = compare_symbols[pass->depth_function];
    event->holds = s->after[0];
    event->left = value_named("z", format, depth_code(o, format));
    event->right = value_of_plane(h, pass->depth_plane, h->planes[pass->depth_plane]);
}

// The first instruction of a stage that writes a predicate decides its test.
static void note_verdict(observer *o, pass_stage stage, const stepped *s)
{
    const pass_decl *pass = &o->history->program->kernels[o->kernel].pass;
    if (stage == STAGE_KEEP)
        event_add(o->history, EVENT_KEEP)->holds = s->after[0];
    else if (stage == STAGE_CLIP)
        note_clip(o, pass, s);
    else if (stage == STAGE_STENCIL_TEST && !o->stencil_tested)
        note_stencil_test(o, pass, s);
    else if (stage == STAGE_DEPTH_TEST && !o->depth_tested)
        note_depth_test(o, pass, s);
    o->stencil_tested |= stage == STAGE_STENCIL_TEST;
    o->depth_tested |= stage == STAGE_DEPTH_TEST;
}

static void note_write(observer *o, const stepped *s)
{
    event *event = event_add(o->history, EVENT_WRITE);
    event->left = value_of_plane(o->history, s->instruction.d, s->before);
    event->right = value_of_plane(o->history, s->instruction.d, s->after);
}

static void note_instruction(observer *o, const stepped *s)
{
    history *h = o->history;
    const pass_stage stage = bound_stage(h->bound, o->kernel, s->at);
    const opcode_row *row = &opcode_table[s->instruction.op];
    if (row->d == OPERAND_PRED && stage != STAGE_KERNEL && stage != STAGE_SHADER)
        note_verdict(o, stage, s);
    else if (row->unit == UNIT_COMPARE)
        note_compare(o, s);
    else if (s->instruction.op == OP_st)
        note_write(o, s);
    else if (s->instruction.op == OP_count) {
        event_add(o->history, EVENT_COUNT)->query = s->instruction.d;
        h->queries[s->instruction.d]++;
    } else if (s->instruction.op == OP_blend && h->program->blends[s->instruction.c].composites)
        event_add(o->history, EVENT_COMPOSITE);
    note_origin(o, s);
}

void observe_fragment(history *h, int kernel, const fragment_input *fragment)
{
    observer o = {.history = h, .kernel = kernel, .fragment = fragment};
    for (int r = 0; r < SOURCE_COLOR + COLOR_COUNT; r++)
        o.registers[r] = computed(r, r < SOURCE_COLOR ? FORMAT_u32 : FORMAT_rgba32f);
    h->event_count = 0;
    fragment_state state = {0};
    stepped stepped;
    while (step_instruction(h->bound, kernel, fragment, h->planes, &state, &stepped))
        if (stepped.executed)
            note_instruction(&o, &stepped);
}
