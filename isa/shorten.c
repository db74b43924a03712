// A bound kernel in, the same kernel with less to do out. What is executed is counted as before; what the kernel
// computes is the same, lane by lane.
//
// 1. A `ld` whose register is read only while the plane still holds the value, and only in lanes that loaded it, copies
//    nothing: its readers look at the plane itself.
// 2. `ld c, PLANE; blend c, S, c; st PLANE, c` under one guard blends in the plane, if nobody reads c afterwards.
//
// Both need to know that the lanes of one guard are lanes of another: a compare under guard g sets a predicate that holds
// only where g does. Kernels with skips are left alone.
#include "bind.h"

#include <string.h>

enum { REGISTERS = SOURCE_COLOR + COLOR_COUNT };

// A predicate at one time: its version counts the writes to it.
typedef struct guard { uint8_t predicate; bool negated; int version; } guard;

typedef struct flow {
    bound_kernel *kernel;
    guard at[LOWERED_MAX];                              // the guard of each instruction
    guard parent[PREDICATE_COUNT][LOWERED_MAX + 1];     // of each version: the guard under which it was written
} flow;

static void follow(flow *flow)
{
    int version[PREDICATE_COUNT] = {0};
    for (int w = 0; w < flow->kernel->count; w++) {
        const instruction i = flow->kernel->words[w];
        flow->at[w] = (guard){i.guard, i.guard_negated, version[i.guard]};
        if (opcode_table[i.op].d == OPERAND_PRED)
            flow->parent[i.d][++version[i.d]] = flow->at[w];
    }
}

// Whether every lane of `inner` is a lane of `outer`.
static bool within(const flow *flow, guard inner, guard outer)
{
    for (;;) {
        if (outer.predicate == 0 || (inner.predicate == outer.predicate && inner.negated == outer.negated &&
                                     inner.version == outer.version))
            return true;
        // What was never written is false everywhere; its opposite says nothing.
        if (inner.predicate == 0 || inner.negated || inner.version == 0)
            return false;
        inner = flow->parent[inner.predicate][inner.version];
    }
}

static bool reads(instruction i, int reg)
{
    const opcode_row *row = &opcode_table[i.op];
    return (operand_is_source(row->a) && i.a == reg) || (operand_is_source(row->b) && i.b == reg) || (i.op == OP_put && i.d == reg);
}

static bool writes(instruction i, int reg)
{
    return operand_is_register(opcode_table[i.op].d) && i.d == reg;
}

// Whether readers of the register that `ld` at w fills may look at its plane.
static bool can_alias(const flow *flow, int w)
{
    const instruction *words = flow->kernel->words;
    const int reg = words[w].d, plane = words[w].a;
    int last_read = w, first_store = flow->kernel->count;
    for (int u = 0; u < flow->kernel->count; u++) {
        if (u != w && writes(words[u], reg))
            return false;
        if (reads(words[u], reg)) {
            if (u < w || !within(flow, flow->at[u], flow->at[w]))
                return false;
            last_read = u;
        }
        if (u > w && u < first_store && words[u].op == OP_st && words[u].d == plane)
            first_store = u;
    }
    return last_read <= first_store;  // a store of the register itself reads before it writes
}

static void alias(const flow *flow, int w)
{
    bound_kernel *kernel = flow->kernel;
    const instruction load = kernel->words[w];
    const bound_source plane = {(uint8_t)(BASE_PLANE + load.a), 0, 0};
    for (int u = w + 1; u < kernel->count; u++) {
        const opcode_row *row = &opcode_table[kernel->words[u].op];
        if (operand_is_source(row->a) && kernel->words[u].a == load.d)
            kernel->code[u].source_a = plane;
        if (operand_is_source(row->b) && kernel->words[u].b == load.d)
            kernel->code[u].source_b = plane;
    }
    kernel->code[w].op = OP_count;  // which is counted and does nothing
    kernel->zero_registers &= ~(1u << load.d);
}

// Whether w starts ld, blend, st as above.
static bool is_triple(const flow *flow, int w)
{
    if (w + 2 >= flow->kernel->count)
        return false;
    const instruction load = flow->kernel->words[w], blend = flow->kernel->words[w + 1], store = flow->kernel->words[w + 2];
    const guard g = flow->at[w], h = flow->at[w + 1], k = flow->at[w + 2];
    return load.op == OP_ld && blend.op == OP_blend && store.op == OP_st && load.d >= SOURCE_COLOR && blend.d == load.d &&
           blend.b == load.d && blend.a != load.d && store.a == load.d && store.d == load.a && within(flow, g, h) &&
           within(flow, h, g) && within(flow, h, k) && within(flow, k, h);
}

static bool read_elsewhere(const flow *flow, int w)
{
    const int reg = flow->kernel->words[w].d;
    for (int u = w + 3; u < flow->kernel->count; u++) {
        if (flow->kernel->words[u].d == reg && is_triple(flow, u))
            u += 2;  // reads what it loads itself
        else if (reads(flow->kernel->words[u], reg))
            return true;
    }
    return false;
}

static void blend_in_plane(const flow *flow, int w)
{
    bound_instruction *code = flow->kernel->code;
    code[w].op = OP_count;
    code[w + 1].op = BOUND_BLEND_IN_PLANE;
    code[w + 1].d = code[w].a;
    code[w + 2].op = OP_count;
}

void shorten_kernel(bound_kernel *kernel)
{
    if (kernel->has_skip)
        return;
    static const flow nothing;
    flow flow = nothing;
    flow.kernel = kernel;
    follow(&flow);
    for (int w = 0; w < kernel->count; w++) {
        const instruction i = kernel->words[w];
        if ((i.op == OP_ld || i.op == OP_tex) && i.d < SOURCE_COLOR && can_alias(&flow, w))
            alias(&flow, w);
        else if (is_triple(&flow, w) && !read_elsewhere(&flow, w))
            blend_in_plane(&flow, w);
    }
    // Colours that only such blends touch need not start as zero.
    for (int c = 0; c < COLOR_COUNT; c++) {
        bool touched = false;
        for (int w = 0; w < kernel->count; w++) {
            const bool in_plane = kernel->code[w].op == BOUND_BLEND_IN_PLANE;  // reads its source, not its destination
            if (kernel->code[w].op != OP_count)
                touched |= in_plane ? kernel->words[w].a == SOURCE_COLOR + c : reads(kernel->words[w], SOURCE_COLOR + c);
        }
        if (!touched)
            kernel->zero_colors &= ~(1u << c);
    }
}
