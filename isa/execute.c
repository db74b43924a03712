// One dispatch: a kernel over one batch of up to 64 lanes, instruction by instruction, each instruction over
// all lanes with vector instructions. Compiled once for each vector width (EXECUTE_BYTES, EXECUTE_NAME); every
// width gives the same bits, since each lane's arithmetic is IEEE binary32 with one rounding an operation and one NaN.
//
// A predicate is one 64-bit word, a bit a lane: logic on predicates is logic on words, an instruction that no
// lane wants is passed over, one that all want needs no mask, and lanes are counted by counting bits. Lane masks
// are made from the word where an instruction selects. p0 is "this lane is active".
#include "bind.h"

#include "execute_math.h"

#include <string.h>

enum { LANES = EXECUTE_BYTES / 4 };

typedef uint32_t vu __attribute__((vector_size(EXECUTE_BYTES), aligned(4), may_alias));
typedef int32_t vi __attribute__((vector_size(EXECUTE_BYTES), aligned(4), may_alias));
typedef float vf __attribute__((vector_size(EXECUTE_BYTES), aligned(4), may_alias));

typedef struct dispatch {
    _Alignas(64) uint32_t state[STATE_WORDS];
    uint64_t bits[PREDICATE_COUNT];
    const uint32_t *bases[BASE_COUNT];
    const bound_program *bound;
    const tile_plane *planes;
    const batch *batch;
} dispatch;

// The vectors [first, last) of a batch that have a lane. Passed by value, so that the compiler sees constants where
// all do; everything below is inlined for that, twice.
typedef struct span { int first, last; } span;
#define INLINED static inline __attribute__((always_inline))

#include "execute_lanes.inc"

#define EACH_VECTOR for (int v = n.first; v < n.last; v++)

INLINED const uint32_t *source(const dispatch *x, bound_source s)
{
    return x->bases[s.base] + s.offset;
}

// Writes 64 lanes: those of `lanes` only, or all where that is as good.
#define WRITE_TO(TO, ALL, EXPRESSION)                                                 \
    do {                                                                              \
        uint32_t *const to = (TO);                                                    \
        if (ALL)                                                                      \
            EACH_VECTOR store(to, v, (vu)(EXPRESSION));                               \
        else                                                                          \
            EACH_VECTOR store(to, v, choose(lanes, v, (vu)(EXPRESSION), load(to, v)));\
    } while (0)

// A register keeps what it held in lanes outside the guard; without guard and skips nobody looks at those.
#define WRITE_REGISTER(EXPRESSION) WRITE_TO(x->state + i->d_offset, !i->masked || lanes == UINT64_MAX, EXPRESSION)

#define COMPARE(FUNCTION)                                                             \
    do {                                                                              \
        uint64_t found = 0;                                                           \
        EACH_VECTOR found |= FUNCTION(load(a, v), load(b, v)) << (v * LANES);         \
        set_predicate(x, i->d, found & lanes);                                        \
    } while (0)

#define A load(a, v)
#define B load(b, v)
#define FA ((vf)load(a, v))
#define FB ((vf)load(b, v))

// Active lanes take the new value; those that have skipped ahead keep theirs.
INLINED void set_predicate(dispatch *x, int index, uint64_t value)
{
    x->bits[index] = value | (x->bits[index] & ~x->bits[0]);
}

INLINED void read_plane(dispatch *x, const bound_instruction *i, uint64_t lanes, span n)
{
    const bool all = !i->masked || lanes == UINT64_MAX;
    for (int channel = 0; channel < (i->color ? 4 : 1); channel++) {
        const uint32_t *const from = x->planes[i->a] + channel * TILE_LANES;
        WRITE_TO(x->state + i->d_offset + channel * TILE_LANES, all, load(from, v));
    }
}

INLINED const uint32_t *color_channel(const dispatch *x, bound_source s, int channel)
{
    return s.color == PLACE_STATE ? x->state + s.offset + channel * TILE_LANES
                                  : (const uint32_t *)(const void *)x->batch->rgba[channel];
}

// One channel of a colour source, premultiplied where the source says so.
INLINED vf color_lanes(const dispatch *x, bound_source s, int channel, int v)
{
    const vf value = (vf)load(color_channel(x, s, channel), v);
    if (s.color != PLACE_PREMULTIPLIED || channel == 3)
        return value;
    return canonical(value * (vf)load((const uint32_t *)(const void *)x->batch->rgba[3], v));
}

INLINED void write_plane(dispatch *x, const bound_instruction *i, uint64_t lanes, span n)
{
    uint32_t *const plane = x->planes[i->d];
    const bool all = lanes == UINT64_MAX;
    if (!i->color) {
        const uint32_t *const a = source(x, i->source_a);
        const uint32_t cut = x->bound->plane_masks[i->d];
        WRITE_TO(plane, all, A & cut);
        return;
    }
    const format format = x->bound->plane_formats[i->d];
    for (int channel = 0; channel < 4; channel++)
        WRITE_TO(plane + channel * TILE_LANES, all, round_component(format, color_lanes(x, i->source_a, channel, v)));
}

INLINED void move(dispatch *x, const bound_instruction *i, uint64_t lanes, span n)
{
    if (!i->color) {
        const uint32_t *const a = source(x, i->source_a);
        WRITE_REGISTER(A);
        return;
    }
    for (int channel = 0; channel < 4; channel++)
        WRITE_TO(x->state + i->d_offset + channel * TILE_LANES, !i->masked, color_lanes(x, i->source_a, channel, v));
}

INLINED void blend_vectors(const blend_decl *state, bool under, const vf s[4], const vf t[4], vf out[4])
{
    if (under) {
        blend_under(s, t, out);
        return;
    }
    for (int channel = 0; channel < 3; channel++)
        out[channel] = blend_channel(state->rgb.equation, state->rgb.source, state->rgb.destination, s, t, channel);
    out[3] = blend_channel(state->alpha.equation, state->alpha.source, state->alpha.destination, s, t, 3);
}

INLINED void blend_colors(dispatch *x, const bound_instruction *i, uint64_t lanes, span n)
{
    const blend_decl *const state = &x->bound->source->blends[i->c];
    uint32_t *const d = x->state + i->d_offset;
    const bool all = !i->masked || lanes == UINT64_MAX;
    EACH_VECTOR {
        vf s[4], t[4], out[4];
        for (int channel = 0; channel < 4; channel++) {
            s[channel] = color_lanes(x, i->source_a, channel, v);
            t[channel] = color_lanes(x, i->source_b, channel, v);
        }
        blend_vectors(state, i->under, s, t, out);
        for (int channel = 0; channel < 4; channel++) {
            uint32_t *const to = d + channel * TILE_LANES;
            store(to, v, all ? (vu)out[channel] : choose(lanes, v, (vu)out[channel], load(to, v)));
        }
    }
}

// Blends into the plane itself what ld, blend and st would carry through a register.
INLINED void blend_in_plane(dispatch *x, const bound_instruction *i, uint64_t lanes, span n)
{
    const blend_decl *const state = &x->bound->source->blends[i->c];
    const format format = x->bound->plane_formats[i->d];
    uint32_t *const plane = x->planes[i->d];
    EACH_VECTOR {
        vf s[4], t[4], out[4];
        for (int channel = 0; channel < 4; channel++) {
            s[channel] = color_lanes(x, i->source_a, channel, v);
            t[channel] = (vf)load(plane + channel * TILE_LANES, v);
        }
        blend_vectors(state, i->under, s, t, out);
        for (int channel = 0; channel < 4; channel++) {
            uint32_t *const to = plane + channel * TILE_LANES;
            store(to, v, choose(lanes, v, (vu)round_component(format, out[channel]), (vu)t[channel]));
        }
    }
}

// Lane by lane, for what has no vector form. Lanes outside the guard are not computed.
#define EACH_LANE(EXPRESSION)                                                         \
    do {                                                                              \
        uint32_t *const d = x->state + i->d_offset;                                   \
        for (uint64_t left = lanes; left; left &= left - 1) {                         \
            const int lane = __builtin_ctzll(left);                                   \
            d[lane] = (EXPRESSION);                                                   \
        }                                                                             \
    } while (0)

INLINED uint64_t predicate(const dispatch *x, int index, bool negated)
{
    return negated ? ~x->bits[index] : x->bits[index];
}

// Takes lanes out of the active ones until the label; returns where dispatch goes on.
INLINED int skip_lanes(dispatch *x, const bound_instruction *i, int at, uint64_t lanes, uint64_t *waiting)
{
    const uint64_t taken = lanes & predicate(x, i->a, i->a_negated);
    waiting[at + i->b] |= taken;
    x->bits[0] &= ~taken;
    int next = at + 1;
    while (!x->bits[0] && !waiting[next])  // if none is left here, some lane waits ahead
        next++;
    return next;
}

static void start(dispatch *x, const bound_kernel *kernel)
{
    const batch *const batch = x->batch;
    x->bases[BASE_STATE] = x->state;
    x->bases[BASE_CONSTANT] = x->bound->constant_lanes[0];
    x->bases[BASE_PRIMITIVE] = batch->primitive;
    for (int f = 0; f < FORMAT_COUNT; f++)
        x->bases[BASE_DEPTH + f] = batch->depth[f];
    for (int p = 0; p < x->bound->source->plane_count; p++)
        x->bases[BASE_PLANE + p] = x->planes[p];
    for (uint32_t left = kernel->zero_registers; left; left &= left - 1)
        memset(x->state + STATE_REGISTERS + __builtin_ctz(left) * TILE_LANES, 0, TILE_LANES * 4);
    for (uint32_t left = kernel->zero_colors; left; left &= left - 1)
        memset(x->state + STATE_COLORS + __builtin_ctz(left) * 4 * TILE_LANES, 0, 4 * TILE_LANES * 4);
    memset(x->bits, 0, sizeof x->bits);
    x->bits[0] = batch->lanes;
}

INLINED void run(dispatch *x, const bound_kernel *kernel, uint64_t *counts, span n, lane_log *log)
{
    uint64_t waiting[LOWERED_MAX + 1];
    if (kernel->has_skip)
        memset(waiting, 0, sizeof *waiting * ((size_t)kernel->count + 1));
    if (kernel->has_skip && log)  // what all lanes skip is not met below
        memset(log, 0, sizeof *log * (size_t)kernel->count);

    for (int at = 0; at < kernel->count; at++) {
        const bound_instruction *const i = &kernel->code[at];
        if (kernel->has_skip && waiting[at]) {
            x->bits[0] |= waiting[at];
            waiting[at] = 0;
        }
        const uint64_t lanes = x->bits[0] & predicate(x, i->guard, i->guard_negated);
        if (log)
            log[at] = (lane_log){x->bits[0], lanes, 0};
        if (!lanes) {
            if (i->writes_predicate)
                set_predicate(x, i->d, 0);
            continue;
        }
        counts[at] += (uint64_t)__builtin_popcountll(lanes);
        const uint32_t *const a = source(x, i->source_a), *const b = source(x, i->source_b);
        switch ((int)i->op) {
        case OP_ld:
        case OP_tex: read_plane(x, i, lanes, n); break;
        case OP_st: write_plane(x, i, lanes, n); break;
        case OP_mov: move(x, i, lanes, n); break;
        case OP_get: WRITE_REGISTER(color_lanes(x, i->source_a, i->b, v)); break;
        case OP_put: WRITE_TO(x->state + i->d_offset + i->b * TILE_LANES, !i->masked, A); break;
        case OP_eq: COMPARE(lanes_eq); break;
        case OP_ne: COMPARE(lanes_ne); break;
        case OP_lt: COMPARE(lanes_lt); break;
        case OP_ge: COMPARE(lanes_ge); break;
        case OP_flt: COMPARE(lanes_flt); break;
        case OP_fge: COMPARE(lanes_fge); break;
        case OP_pand: set_predicate(x, i->d, lanes & predicate(x, i->a, i->a_negated) & predicate(x, i->b, i->b_negated)); break;
        case OP_por: set_predicate(x, i->d, lanes & (predicate(x, i->a, i->a_negated) | predicate(x, i->b, i->b_negated))); break;
        case OP_add: WRITE_REGISTER(A + B); break;
        case OP_sub: WRITE_REGISTER(A - B); break;
        case OP_and: WRITE_REGISTER(A & B); break;
        case OP_xor: WRITE_REGISTER(A ^ B); break;
        case OP_min: WRITE_REGISTER(lanes_min(A, B)); break;
        case OP_max: WRITE_REGISTER(lanes_max(A, B)); break;
        case OP_fadd: WRITE_REGISTER(canonical(FA + FB)); break;
        case OP_fsub: WRITE_REGISTER(canonical(FA - FB)); break;
        case OP_fmul: WRITE_REGISTER(canonical(FA * FB)); break;
        case OP_fdiv: WRITE_REGISTER(canonical(FA / FB)); break;
        case OP_fpow: EACH_LANE(execute_fpow(a[lane], b[lane])); break;
        case OP_ftou: EACH_LANE(execute_ftou(a[lane])); break;
        case OP_utof: EACH_LANE(execute_utof(a[lane])); break;
        case OP_ztof: EACH_LANE(execute_ztof((format)i->b, a[lane], x->bound->reversed_depth)); break;
        case OP_blend: blend_colors(x, i, lanes, n); break;
        case OP_count: break;  // its own execution count is the count
        case OP_skip: at = skip_lanes(x, i, at, lanes, waiting) - 1; break;
        case BOUND_BLEND_IN_PLANE: blend_in_plane(x, i, lanes, n); break;
        }
        if (log && i->writes_predicate)
            log[at].outcome = x->bits[i->d];
    }
}

execute_kernel EXECUTE_NAME;

void EXECUTE_NAME(const bound_program *bound, int k, const tile_plane *planes, const batch *batch, uint64_t *counts)
{
    const bound_kernel *const kernel = &bound->kernels[k];
    if (!batch->lanes)
        return;
    dispatch state, *const x = &state;
    x->bound = bound;
    x->planes = planes;
    x->batch = batch;
    start(x, kernel);
    const span n = {__builtin_ctzll(batch->lanes) / LANES, (63 - __builtin_clzll(batch->lanes)) / LANES + 1};
    if (batch->log)
        run(x, kernel, counts, n, batch->log);
    else if (n.first == 0 && n.last == TILE_LANES / LANES)
        run(x, kernel, counts, (span){0, TILE_LANES / LANES}, NULL);
    else
        run(x, kernel, counts, n, NULL);
}
