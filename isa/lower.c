// A fixed-function pass in, the same instructions that a kernel is made of out.
//
// The order is the hardware's (GL 4.6 17.3, D3D11.3 17): the shader, range clip, stencil test,
// depth test, stencil update, depth write, blend, count. Predicates: alive after the clip, passed the
// stencil test, passed both. A plane is read only where the state asks for its value, and only by fragments
// that got so far; the shader's clip reads its maps for every fragment.
#include "bind.h"

enum { R_MAP, R_BOUND, R_DEPTH_IN, R_STENCIL, R_MASKED, R_DEPTH, R_NEW };
enum { C_TARGET = SOURCE_COLOR + COLOR_COUNT - 1 };  // c0 to c6 are the shader's
enum { P_ALWAYS, P_ALIVE, P_STENCIL, P_STENCIL_FAIL, P_PASS, P_DEPTH_FAIL };

typedef struct lowering {
    bound_program *bound;
    instruction *words;
    uint8_t *stages;
    int count;
    pass_stage stage;  // of what is emitted now
} lowering;

static void emit(lowering *l, int guard, opcode op, int d, int a, int b, int c)
{
    if (l->count < LOWERED_MAX) {
        l->stages[l->count] = (uint8_t)l->stage;
        l->words[l->count] = (instruction){op, (uint8_t)guard, false, (uint8_t)d, (uint8_t)a, (uint8_t)b, (uint8_t)c};
    }
    l->count++;
}

// Compares x FUNCTION y into predicate d; `d = guard and ...`.
static void emit_compare(lowering *l, int guard, int d, compare_function function, int x, int y, bool as_float)
{
    const opcode less = as_float ? OP_flt : OP_lt, not_less = as_float ? OP_fge : OP_ge;
    switch (function) {
    case COMPARE_less: emit(l, guard, less, d, x, y, 0); break;
    case COMPARE_greater: emit(l, guard, less, d, y, x, 0); break;
    case COMPARE_lequal: emit(l, guard, not_less, d, y, x, 0); break;
    case COMPARE_gequal: emit(l, guard, not_less, d, x, y, 0); break;
    case COMPARE_equal: emit(l, guard, OP_eq, d, x, y, 0); break;
    case COMPARE_notequal: emit(l, guard, OP_ne, d, x, y, 0); break;
    case COMPARE_always: emit(l, guard, OP_pand, d, P_ALWAYS, P_ALWAYS, 0); break;
    case COMPARE_never: emit(l, guard, OP_pand, d, P_ALWAYS, P_ALWAYS | 8, 0); break;
    case COMPARE_FUNCTION_COUNT: break;
    }
}

// The shader's instructions as they are; then its verdict as P_ALIVE, since the pass uses the other predicates.
static int lower_shader(lowering *l, const pass_decl *pass)
{
    if (pass->shader < 0)
        return P_ALWAYS;
    const kernel_decl *shader = &l->bound->source->kernels[pass->shader];
    for (int w = 0; w < shader->word_count && l->count < LOWERED_MAX; w++) {
        l->stages[l->count] = STAGE_SHADER;
        word_decode(shader->words[w], &l->words[l->count++]);
    }
    if (!pass->keep && !pass->keep_negated)
        return P_ALWAYS;
    const int keep = pass->keep | pass->keep_negated << 3;
    l->stage = STAGE_KEEP;
    emit(l, P_ALWAYS, OP_pand, P_ALIVE, keep, keep, 0);
    l->stage = STAGE_CLIP;
    return P_ALIVE;
}

const compare_function bound_compare[] = {COMPARE_less, COMPARE_lequal, COMPARE_equal, COMPARE_gequal, COMPARE_greater};

static int lower_clips(lowering *l, const pass_decl *pass, int alive)
{
    for (int i = 0; i < pass->clip_count; i++) {
        const clip_decl *clip = &pass->clips[i];
        const format format = l->bound->plane_formats[clip->plane[0]];
        for (int j = 0; j < clip->plane_count; j++) {
            emit(l, P_ALWAYS, OP_tex, j ? R_MAP : R_BOUND, clip->plane[j], 0, 0);
            if (j)
                emit(l, P_ALWAYS, OP_min, R_BOUND, R_BOUND, R_MAP, 0);
        }
        int depth = SOURCE_DEPTH_FORMAT + (int)format;
        const bool interpolated = l->bound->limits.clip_interpolated;
        if (interpolated) {
            emit(l, P_ALWAYS, OP_ztof, R_BOUND, R_BOUND, (int)format, 0);
            emit(l, P_ALWAYS, OP_ztof, R_DEPTH_IN, SOURCE_DEPTH_FORMAT + FORMAT_z32f, FORMAT_z32f, 0);
            depth = R_DEPTH_IN;
        }
        emit_compare(l, alive, P_ALIVE, bound_compare[clip->function], depth, R_BOUND, interpolated);
        alive = P_ALIVE;
    }
    return alive;
}

static bool operation_reads(stencil_operation operation)
{
    return operation != STENCIL_keep && operation != STENCIL_zero && operation != STENCIL_replace;
}

static bool stencil_reads(const pass_decl *pass)
{
    const bool tests = pass->stencil_function != COMPARE_always && pass->stencil_function != COMPARE_never;
    return tests || operation_reads(pass->stencil_fail) || operation_reads(pass->stencil_depth_fail) ||
           operation_reads(pass->stencil_pass) || pass->stencil_write_mask != 255;
}

static int lower_stencil_test(lowering *l, const pass_decl *pass, int alive)
{
    if (pass->stencil_plane < 0)
        return alive;
    const uint32_t largest = l->bound->plane_masks[pass->stencil_plane], mask = pass->stencil_mask & largest;
    if (stencil_reads(pass))
        emit(l, alive, OP_ld, R_STENCIL, pass->stencil_plane, 0, 0);
    int stored = R_STENCIL;
    if (mask != largest) {
        emit(l, alive, OP_and, R_MASKED, R_STENCIL, bind_constant(l->bound, mask), 0);
        stored = R_MASKED;
    }
    emit_compare(l, alive, P_STENCIL, pass->stencil_function,
                 bind_constant(l->bound, pass->stencil_reference & mask), stored, false);
    emit(l, alive, OP_pand, P_STENCIL_FAIL, P_ALWAYS, P_STENCIL | 8, 0);
    return P_STENCIL;
}

static int lower_depth_test(lowering *l, const pass_decl *pass, int tested)
{
    if (pass->depth_plane < 0)
        return tested;
    if (pass->depth_function != COMPARE_always && pass->depth_function != COMPARE_never)
        emit(l, tested, OP_ld, R_DEPTH, pass->depth_plane, 0, 0);
    const int depth = SOURCE_DEPTH_FORMAT + (int)l->bound->plane_formats[pass->depth_plane];
    emit_compare(l, tested, P_PASS, pass->depth_function, depth, R_DEPTH, false);
    emit(l, tested, OP_pand, P_DEPTH_FAIL, P_ALWAYS, P_PASS | 8, 0);
    return P_PASS;
}

static void lower_stencil_update(lowering *l, const pass_decl *pass, int guard, stencil_operation operation)
{
    const uint8_t largest = bind_constant(l->bound, l->bound->plane_masks[pass->stencil_plane]);
    const uint8_t one = bind_constant(l->bound, 1);
    switch (operation) {
    case STENCIL_keep: return;
    case STENCIL_zero: emit(l, guard, OP_mov, R_NEW, bind_constant(l->bound, 0), 0, 0); break;
    case STENCIL_replace: emit(l, guard, OP_mov, R_NEW, bind_constant(l->bound, pass->stencil_reference), 0, 0); break;
    case STENCIL_incr:
        emit(l, guard, OP_add, R_NEW, R_STENCIL, one, 0);
        emit(l, guard, OP_min, R_NEW, R_NEW, largest, 0);
        break;
    case STENCIL_decr:
        emit(l, guard, OP_max, R_NEW, R_STENCIL, one, 0);
        emit(l, guard, OP_sub, R_NEW, R_NEW, one, 0);
        break;
    case STENCIL_invert: emit(l, guard, OP_xor, R_NEW, R_STENCIL, largest, 0); break;
    case STENCIL_incr_wrap: emit(l, guard, OP_add, R_NEW, R_STENCIL, one, 0); break;
    case STENCIL_decr_wrap: emit(l, guard, OP_sub, R_NEW, R_STENCIL, one, 0); break;
    case STENCIL_OPERATION_COUNT: return;
    }
    if (pass->stencil_write_mask != 255) {
        emit(l, guard, OP_xor, R_NEW, R_NEW, R_STENCIL, 0);
        emit(l, guard, OP_and, R_NEW, R_NEW, bind_constant(l->bound, pass->stencil_write_mask), 0);
        emit(l, guard, OP_xor, R_NEW, R_NEW, R_STENCIL, 0);
    }
    emit(l, guard, OP_st, pass->stencil_plane, R_NEW, 0, 0);
}

static void lower_targets(lowering *l, const pass_decl *pass, int guard)
{
    for (int i = 0; i < pass->target_count; i++) {
        const int plane = pass->targets[i].plane, source = pass->targets[i].source;
        if (pass->targets[i].blend < 0) {
            emit(l, guard, OP_st, plane, source, 0, 0);
            continue;
        }
        emit(l, guard, OP_ld, C_TARGET, plane, 0, 0);
        emit(l, guard, OP_blend, C_TARGET, source, C_TARGET, pass->targets[i].blend);
        emit(l, guard, OP_st, plane, C_TARGET, 0, 0);
    }
}

bool lower_pass(bound_program *bound, const pass_decl *pass, instruction *words, uint8_t *stages, int *count)
{
    lowering l = {bound, words, stages, 0, STAGE_CLIP};
    const int alive = lower_clips(&l, pass, lower_shader(&l, pass));
    l.stage = STAGE_STENCIL_TEST;
    const int tested = lower_stencil_test(&l, pass, alive);
    l.stage = STAGE_DEPTH_TEST;
    const int passed = lower_depth_test(&l, pass, tested);
    l.stage = STAGE_WRITE;
    if (pass->stencil_plane >= 0) {
        lower_stencil_update(&l, pass, P_STENCIL_FAIL, pass->stencil_fail);
        if (pass->depth_plane >= 0)
            lower_stencil_update(&l, pass, P_DEPTH_FAIL, pass->stencil_depth_fail);
        lower_stencil_update(&l, pass, passed, pass->stencil_pass);
    }
    if (pass->depth_plane >= 0 && pass->depth_write)
        emit(&l, passed, OP_st, pass->depth_plane, SOURCE_DEPTH_FORMAT + (int)bound->plane_formats[pass->depth_plane], 0, 0);
    lower_targets(&l, pass, passed);
    if (pass->query >= 0)
        emit(&l, passed, OP_count, pass->query, 0, 0, 0);
    *count = l.count;
    return l.count <= LOWERED_MAX;
}
