// One dispatch: a kernel over one batch of up to 64 lanes, instruction by instruction, each instruction over
// all lanes with vector instructions. Compiled once for each vector width (EXECUTE_BYTES, EXECUTE_NAME); every
// width gives the same bits, since each lane's arithmetic is IEEE binary32 with one rounding an operation.
//
// A predicate is held twice: as lane masks (all ones or zero), which select, and as one 64-bit word, which
// counts lanes and lets an instruction that no lane wants be passed over. p0 is "this lane is active".
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
    int first, last;  // vectors of the batch that have a lane
} dispatch;

#include "execute_lanes.h"

static const uint32_t *source(const dispatch *x, bound_source s)
{
    return x->bases[s.base] + s.offset;
}

static uint32_t *predicate(dispatch *x, int index)
{
    return x->state + STATE_PREDICATES + index * TILE_LANES;
}

static uint64_t guard_bits(const dispatch *x, const bound_instruction *i)
{
    return x->bits[0] & (i->guard_negated ? ~x->bits[i->guard] : x->bits[i->guard]);
}

// The guard of one instruction as lane masks, made on the fly.
typedef struct guard { const uint32_t *active, *predicate; uint32_t flip; } guard;

static guard guard_of(dispatch *x, const bound_instruction *i)
{
    return (guard){predicate(x, 0), predicate(x, i->guard), i->guard_negated ? ~0u : 0u};
}

static vu guard_mask(guard g, int v)
{
    return load(g.active, v) & (load(g.predicate, v) ^ g.flip);
}

// Writes a register: all lanes, or those of the guard.
#define WRITE_LANES(EXPRESSION)                                                       \
    do {                                                                              \
        uint32_t *const d = x->state + i->d_offset;                                   \
        if (i->masked) {                                                              \
            const guard g = guard_of(x, i);                                           \
            for (int v = x->first; v < x->last; v++) {                                \
                const vu value = (vu)(EXPRESSION), mask = guard_mask(g, v);           \
                store(d, v, choose(mask, value, load(d, v)));                         \
            }                                                                         \
        } else {                                                                      \
            for (int v = x->first; v < x->last; v++)                                  \
                store(d, v, (vu)(EXPRESSION));                                        \
        }                                                                             \
    } while (0)

#define COMPARE_LANES(EXPRESSION)                                                     \
    do {                                                                              \
        uint32_t *const d = x->state + i->d_offset;                                   \
        const guard g = guard_of(x, i);                                               \
        uint64_t bits = 0;                                                            \
        for (int v = x->first; v < x->last; v++) {                                    \
            vu mask = (vu)(EXPRESSION) & guard_mask(g, v);                            \
            if (kernel->has_skip) /* a lane that skipped ahead keeps its predicate */ \
                mask |= load(d, v) & ~load(g.active, v);                              \
            store(d, v, mask);                                                        \
            bits |= mask_bits(mask) << (v * LANES);                                   \
        }                                                                             \
        x->bits[i->d] = bits;                                                         \
    } while (0)

#define A load(a, v)
#define B load(b, v)
#define FA ((vf)load(a, v))
#define FB ((vf)load(b, v))

static void read_plane(dispatch *x, const bound_instruction *i)
{
    const uint32_t *const plane = x->planes[i->a];
    for (int channel = 0; channel < (i->color ? 4 : 1); channel++) {
        const uint32_t *const from = plane + channel * TILE_LANES;
        uint32_t *const d = x->state + i->d_offset + channel * TILE_LANES;
        if (i->masked) {
            const guard g = guard_of(x, i);
            for (int v = x->first; v < x->last; v++)
                store(d, v, choose(guard_mask(g, v), load(from, v), load(d, v)));
        } else {
            for (int v = x->first; v < x->last; v++)
                store(d, v, load(from, v));
        }
    }
}

static const uint32_t *color_channel(const dispatch *x, bound_source s, int channel)
{
    return s.color == PLACE_STATE ? x->state + s.offset + channel * TILE_LANES
                                  : (const uint32_t *)(const void *)x->batch->rgba[channel];
}

// One channel of a colour source, premultiplied where the source says so.
static vf color_lanes(const dispatch *x, bound_source s, int channel, int v)
{
    const vf value = (vf)load(color_channel(x, s, channel), v);
    if (s.color != PLACE_PREMULTIPLIED || channel == 3)
        return value;
    return value * (vf)load((const uint32_t *)(const void *)x->batch->rgba[3], v);
}

static void write_plane(dispatch *x, const bound_instruction *i)
{
    uint32_t *const plane = x->planes[i->d];
    const guard g = guard_of(x, i);
    if (!i->color) {
        const uint32_t *const a = source(x, i->source_a);
        const uint32_t cut = x->bound->plane_masks[i->d];
        for (int v = x->first; v < x->last; v++)
            store(plane, v, choose(guard_mask(g, v), A & cut, load(plane, v)));
        return;
    }
    const format format = x->bound->plane_formats[i->d];
    for (int channel = 0; channel < 4; channel++) {
        uint32_t *const to = plane + channel * TILE_LANES;
        for (int v = x->first; v < x->last; v++) {
            const vf value = round_component(format, color_lanes(x, i->source_a, channel, v));
            store(to, v, choose(guard_mask(g, v), (vu)value, load(to, v)));
        }
    }
}

static void move(dispatch *x, const bound_instruction *i)
{
    if (!i->color) {
        const uint32_t *const a = source(x, i->source_a);
        WRITE_LANES(A);
        return;
    }
    const guard g = guard_of(x, i);
    for (int channel = 0; channel < 4; channel++) {
        uint32_t *const d = x->state + i->d_offset + channel * TILE_LANES;
        for (int v = x->first; v < x->last; v++)
            store(d, v, choose(guard_mask(g, v), (vu)color_lanes(x, i->source_a, channel, v), load(d, v)));
    }
}

static void put_component(dispatch *x, const bound_instruction *i)
{
    const uint32_t *const a = source(x, i->source_a);
    const guard g = guard_of(x, i);
    uint32_t *const d = x->state + i->d_offset + i->b * TILE_LANES;
    for (int v = x->first; v < x->last; v++)
        store(d, v, choose(guard_mask(g, v), A, load(d, v)));
}

static void blend_colors(dispatch *x, const bound_instruction *i)
{
    const blend_decl *const state = &x->bound->source->blends[i->c];
    const guard g = guard_of(x, i);
    uint32_t *const d = x->state + i->d_offset;
    for (int v = x->first; v < x->last; v++) {
        vf s[4], t[4], out[4];
        for (int channel = 0; channel < 4; channel++) {
            s[channel] = color_lanes(x, i->source_a, channel, v);
            t[channel] = color_lanes(x, i->source_b, channel, v);
        }
        for (int channel = 0; channel < 3; channel++)
            out[channel] = blend_channel(state->rgb.equation, state->rgb.source, state->rgb.destination, s, t, channel);
        out[3] = blend_channel(state->alpha.equation, state->alpha.source, state->alpha.destination, s, t, 3);
        const vu mask = guard_mask(g, v);
        for (int channel = 0; channel < 4; channel++)
            store(d + channel * TILE_LANES, v, choose(mask, (vu)out[channel], load(d + channel * TILE_LANES, v)));
    }
}

// A compare whose guard holds nowhere: false in every active lane.
static void write_false(dispatch *x, int index)
{
    x->bits[index] &= ~x->bits[0];
    expand_bits(predicate(x, index), x->bits[index]);
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

// Takes lanes out of the active ones until `target`; returns where dispatch goes on.
static int skip_lanes(dispatch *x, const bound_instruction *i, int at, uint64_t *waiting)
{
    const guard g = guard_of(x, i);
    const uint32_t *const a = predicate(x, i->a);
    const uint32_t flip = i->a_negated ? ~0u : 0u;
    uint32_t *const active = predicate(x, 0);
    uint64_t taken = 0;
    for (int v = x->first; v < x->last; v++) {
        const vu mask = guard_mask(g, v) & (load(a, v) ^ flip);
        taken |= mask_bits(mask) << (v * LANES);
        store(active, v, load(active, v) & ~mask);
    }
    const int target = at + i->b;
    waiting[target] |= taken;
    x->bits[0] &= ~taken;
    if (x->bits[0])
        return at + 1;
    int next = at + 1;
    while (!waiting[next])  // some lane waits ahead, since all have skipped
        next++;
    return next;
}

static void join_lanes(dispatch *x, uint64_t joining)
{
    x->bits[0] |= joining;
    expand_bits(predicate(x, 0), x->bits[0]);
}

static void start(dispatch *x, const bound_kernel *kernel)
{
    const batch *const batch = x->batch;
    x->first = __builtin_ctzll(batch->lanes) / LANES;
    x->last = (63 - __builtin_clzll(batch->lanes)) / LANES + 1;
    x->bases[BASE_STATE] = x->state;
    x->bases[BASE_CONSTANT] = x->bound->constant_lanes[0];
    x->bases[BASE_PRIMITIVE] = batch->primitive;
    for (int f = 0; f < FORMAT_COUNT; f++)
        x->bases[BASE_DEPTH + f] = batch->depth[f];
    for (uint32_t left = kernel->zero_registers; left; left &= left - 1)
        memset(x->state + STATE_REGISTERS + __builtin_ctz(left) * TILE_LANES, 0, TILE_LANES * 4);
    for (uint32_t left = kernel->zero_colors; left; left &= left - 1)
        memset(x->state + STATE_COLORS + __builtin_ctz(left) * 4 * TILE_LANES, 0, 4 * TILE_LANES * 4);
    for (uint32_t left = kernel->zero_predicates; left; left &= left - 1) {
        const int index = __builtin_ctz(left);
        memset(predicate(x, index), 0, TILE_LANES * 4);
        x->bits[index] = 0;
    }
    x->bits[0] = batch->lanes;
    expand_bits(predicate(x, 0), batch->lanes);
}

void EXECUTE_NAME(const bound_program *bound, int k, const tile_plane *planes, const batch *batch, uint64_t *counts);

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
    uint64_t waiting[LOWERED_MAX + 1];
    if (kernel->has_skip)
        memset(waiting, 0, sizeof *waiting * ((size_t)kernel->count + 1));

    for (int at = 0; at < kernel->count; at++) {
        const bound_instruction *const i = &kernel->code[at];
        if (kernel->has_skip && waiting[at]) {
            join_lanes(x, waiting[at]);
            waiting[at] = 0;
        }
        const uint64_t lanes = guard_bits(x, i);
        if (!lanes) {
            if (i->writes_predicate)
                write_false(x, i->d);
            continue;
        }
        counts[at] += (uint64_t)__builtin_popcountll(lanes);
        const uint32_t *const a = source(x, i->source_a), *const b = source(x, i->source_b);
        switch ((opcode)i->op) {
        case OP_ld:
        case OP_tex: read_plane(x, i); break;
        case OP_st: write_plane(x, i); break;
        case OP_mov: move(x, i); break;
        case OP_get: WRITE_LANES(color_lanes(x, i->source_a, i->b, v)); break;
        case OP_put: put_component(x, i); break;
        case OP_eq: COMPARE_LANES(A == B); break;
        case OP_ne: COMPARE_LANES(A != B); break;
        case OP_lt: COMPARE_LANES(A < B); break;
        case OP_ge: COMPARE_LANES(A >= B); break;
        case OP_flt: COMPARE_LANES(FA < FB); break;
        case OP_fge: COMPARE_LANES(FA >= FB); break;
        case OP_pand:
        case OP_por: {
            const uint32_t *const p = predicate(x, i->a), *const q = predicate(x, i->b);
            const uint32_t flip_p = i->a_negated ? ~0u : 0u, flip_q = i->b_negated ? ~0u : 0u;
            if (i->op == OP_pand)
                COMPARE_LANES((load(p, v) ^ flip_p) & (load(q, v) ^ flip_q));
            else
                COMPARE_LANES((load(p, v) ^ flip_p) | (load(q, v) ^ flip_q));
            break;
        }
        case OP_add: WRITE_LANES(A + B); break;
        case OP_sub: WRITE_LANES(A - B); break;
        case OP_and: WRITE_LANES(A & B); break;
        case OP_xor: WRITE_LANES(A ^ B); break;
        case OP_min: WRITE_LANES(choose((vu)(A < B), A, B)); break;
        case OP_max: WRITE_LANES(choose((vu)(A < B), B, A)); break;
        case OP_fadd: WRITE_LANES(FA + FB); break;
        case OP_fsub: WRITE_LANES(FA - FB); break;
        case OP_fmul: WRITE_LANES(FA * FB); break;
        case OP_fdiv: WRITE_LANES(FA / FB); break;
        case OP_fpow: EACH_LANE(execute_fpow(a[lane], b[lane])); break;
        case OP_ftou: EACH_LANE(execute_ftou(a[lane])); break;
        case OP_utof: EACH_LANE(execute_utof(a[lane])); break;
        case OP_ztof: EACH_LANE(execute_ztof((format)i->b, a[lane], bound->reversed_depth)); break;
        case OP_blend: blend_colors(x, i); break;
        case OP_count: break;  // its own execution count is the count
        case OP_skip: at = skip_lanes(x, i, at, waiting) - 1; break;
        case OPCODE_COUNT: break;
        }
    }
}
