// The ROP's instruction set: programs as text, as words, checked against a machine, executed.
//
//   text --assemble_text--> program --program_encode--> words --program_decode--> program
//   program --disassemble_text--> text          program --verify_program--> runs on this machine, or why not
//   program --bind_program--> bound_program --execute_kernel--> one dispatch of a kernel over 64 lanes
//
// A *fragment* is one covered sample of one primitive. A *plane* is one named value a sample. A *kernel* is
// a straight line of instructions, run for each fragment in raster order or once a sample. A *pass* is
// fixed-function state; it is lowered to a kernel. The *schedule* says what runs in which order.
// docs/isa.md draws the word and the language. This library needs the C library only.
#ifndef ROPSIM_ISA_H
#define ROPSIM_ISA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

// ---- Status and messages -------------------------------------------------------------------------------

// What a call that can fail returns; also the command's exit codes.
typedef enum status {
    STATUS_OK = 0,
    STATUS_REFUSED = 1,  // the input breaks a rule, or a check failed
    STATUS_USAGE = 2,    // the caller's words are off
    STATUS_IO = 3,       // a file could not be read or written, or memory ran out
} status;

typedef enum severity { SEVERITY_ERROR, SEVERITY_WARNING, SEVERITY_NOTE } severity;

// Where messages and progress go. The library never prints. Every member may be NULL, and so may a
// `const report *`: then nothing is said. Calls may come from several threads, one at a time.
typedef struct report {
    void (*say)(void *user, severity severity, const char *text);  // text: no newline at its end
    void (*progress)(void *user, const char *what, uint64_t done, uint64_t total);
    void *user;
} report;

#if defined(__GNUC__)
#define PRINTF_LIKE(text, first) __attribute__((format(printf, text, first)))
#else
#define PRINTF_LIKE(text, first)
#endif

// Says a message and returns `result`, so that a failing function ends with `return report_error(...)`.
status report_error(const report *report, status result, const char *format, ...) PRINTF_LIKE(3, 4);
void report_warning(const report *report, const char *format, ...) PRINTF_LIKE(2, 3);
void report_progress(const report *report, const char *what, uint64_t done, uint64_t total);

// ---- Tables --------------------------------------------------------------------------------------------

typedef enum opcode {
#define OPCODE(name, d, a, b, c, unit, cycles, meaning) OP_##name,
#include "opcodes.def"
#undef OPCODE
    OPCODE_COUNT
} opcode;

typedef enum format {
#define FORMAT(name, class, bits, meaning) FORMAT_##name,
#include "formats.def"
#undef FORMAT
    FORMAT_COUNT
} format;

typedef enum format_class { FORMAT_CLASS_DEPTH, FORMAT_CLASS_UINT, FORMAT_CLASS_FLOAT, FORMAT_CLASS_COLOR } format_class;

// What an operand field of an instruction holds; opcodes.def explains each.
typedef enum operand_kind {
    OPERAND_NONE, OPERAND_REG, OPERAND_COLOR, OPERAND_ANY, OPERAND_PRED, OPERAND_SRC, OPERAND_CSRC,
    OPERAND_ASRC, OPERAND_PLANE, OPERAND_QUERY, OPERAND_BLEND, OPERAND_COMP, OPERAND_FORMAT, OPERAND_LABEL,
} operand_kind;

typedef enum opcode_unit {
    UNIT_MOVE, UNIT_COMPARE, UNIT_LOGIC, UNIT_INTEGER, UNIT_FLOAT, UNIT_BLEND, UNIT_MEMORY, UNIT_CONTROL
} opcode_unit;

typedef struct opcode_row {
    const char *name;
    operand_kind d, a, b, c;
    opcode_unit unit;
    int cycles;
    const char *meaning;
} opcode_row;

typedef struct format_row {
    const char *name;
    format_class class;
    int bits;  // storage a sample
    const char *meaning;
} format_row;

extern const opcode_row opcode_table[OPCODE_COUNT];
extern const format_row format_table[FORMAT_COUNT];

#define COMPARE_FUNCTION(name) COMPARE_##name,
typedef enum compare_function {
#include "states.def"
    COMPARE_FUNCTION_COUNT
} compare_function;
#define STENCIL_OPERATION(name) STENCIL_##name,
typedef enum stencil_operation {
#include "states.def"
    STENCIL_OPERATION_COUNT
} stencil_operation;
#define BLEND_FACTOR(name) FACTOR_##name,
typedef enum blend_factor {
#include "states.def"
    BLEND_FACTOR_COUNT
} blend_factor;
#define BLEND_EQUATION(name) EQUATION_##name,
typedef enum blend_equation {
#include "states.def"
    BLEND_EQUATION_COUNT
} blend_equation;

extern const char *const compare_function_names[COMPARE_FUNCTION_COUNT];
extern const char *const stencil_operation_names[STENCIL_OPERATION_COUNT];
extern const char *const blend_factor_names[BLEND_FACTOR_COUNT];
extern const char *const blend_equation_names[BLEND_EQUATION_COUNT];

// ---- Number formats ------------------------------------------------------------------------------------

// Depth in [0, 1], 0 nearest, to a code and back. A NaN depth is 0 and others are clamped first
// (D3D11.3 17.10: min and max drop a NaN). `reversed`: the device stored 1 - depth (a reversed depth
// buffer); the code still grows with distance. format: a DEPTH row.
uint32_t format_depth_to_code(format format, double depth, bool reversed);
// The codes of many depths, much faster than one by one.
void format_depths_to_codes(format format, const double *depth, uint32_t count, bool reversed, uint32_t *codes);
double format_code_to_depth(format format, uint32_t code, bool reversed);
uint32_t format_far_code(format format);  // the code of depth 1; depth 0 is code 0

// One colour component as it comes back after a store in a COLOR format.
float format_round_component(format format, float value);
float format_half_to_float(uint16_t half);             // exact
uint16_t format_float_to_half_toward_zero(float value);  // NaN to a quiet NaN; infinities stay

typedef struct blend_decl blend_decl;
// Blends one colour as `blend` does. `blended` is neither of the others.
void blend_color(const blend_decl *state, const float source[4], const float destination[4], float blended[4]);

// ---- Programs ------------------------------------------------------------------------------------------

enum {
    TILE_LANES = 64,
    REGISTER_COUNT = 16,    // r0..r15
    COLOR_COUNT = 8,        // c0..c7
    PREDICATE_COUNT = 8,    // p0..p7; p0 reads as "this fragment is active" and cannot be written
    CONSTANT_MAX = 32,
    PLANE_MAX = 32,
    QUERY_MAX = 8,
    BLEND_MAX = 32,
    KERNEL_MAX = 64,
    WORD_MAX = 256,         // instructions of one kernel
    STEP_MAX = 1024,
    NAME_SIZE = 64,         // bytes of a name with its NUL
    CLIP_MAX = 4,           // range clip conditions of a pass
    TARGET_MAX = 8,         // colour targets of a pass
};

// How many lanes a mask has. The builtin is a call on processors that need not have the instruction.
static inline uint32_t count_lanes(uint64_t lanes)
{
    lanes -= lanes >> 1 & UINT64_C(0x5555555555555555);
    lanes = (lanes & UINT64_C(0x3333333333333333)) + (lanes >> 2 & UINT64_C(0x3333333333333333));
    lanes = (lanes + (lanes >> 4)) & UINT64_C(0x0f0f0f0f0f0f0f0f);
    return (uint32_t)(lanes * UINT64_C(0x0101010101010101) >> 56);
}

// Source operand encoding, 6 bits.
enum {
    SOURCE_REGISTER = 0,    // 0..15
    SOURCE_COLOR = 16,      // 16..23
    SOURCE_FRAGMENT_COLOR = 24,   // the fragment's straight RGBA:          color
    SOURCE_FRAGMENT_PREMUL = 25,  // RGB times A, A:                        premul
    SOURCE_PRIMITIVE = 26,        // the fragment's primitive number:       primitive
    SOURCE_DEPTH = 27,            // the fragment's depth in the machine's depth format: z
    SOURCE_DEPTH_FORMAT = 28,     // 28.. : in the depth format of that row: z.z16, z.z24, z.z32f
    SOURCE_CONSTANT = 32,         // 32..63
};

// A decoded instruction. Fields d, a, b, c hold what the opcode's row says; `guard` a predicate, p0 = always.
typedef struct instruction {
    opcode op;
    uint8_t guard;
    bool guard_negated;
    uint8_t d, a, b, c;
} instruction;

uint32_t word_encode(instruction instruction);
// False if the word's opcode does not exist or an unused field is not zero.
bool word_decode(uint32_t word, instruction *instruction);

// A value that kernels or clears name; what depends on the machine is settled by bind_program.
typedef enum value_kind {
    VALUE_UINT,        // an integer, written 128
    VALUE_FLOAT,       // a float, written 0.5
    VALUE_NEAR,        // the code of depth 0
    VALUE_FAR,         // the code of depth 1, in the machine's depth format or a named one: far, far.z16
    VALUE_STENCIL_MAX, // largest value of the machine's stencil: stencil_max
    VALUE_BACKGROUND,  // clears only: the trace's background
    VALUE_RGBA,        // clears only: four floats
    VALUE_BATCH_NEAR,  // clears inside `batches` only: where the batch's depth range starts: batch_near
    VALUE_BATCH_FAR,   // and where the next one's starts; the far plane in the last: batch_far
} value_kind;

typedef struct value {
    value_kind kind;
    uint32_t bits;     // VALUE_UINT: the integer; VALUE_FLOAT: the float's bits
    int8_t format;     // VALUE_FAR: a DEPTH row, or -1 for the machine's
    float rgba[4];     // VALUE_RGBA
} value;

typedef enum plane_kind { PLANE_DEPTH, PLANE_RGBA, PLANE_STENCIL, PLANE_FORMAT } plane_kind;

typedef struct plane_decl {
    char name[NAME_SIZE];
    plane_kind kind;   // PLANE_FORMAT: declared with a format of formats.def, which it keeps
    format format;
    int line;
} plane_decl;

typedef struct query_decl { char name[NAME_SIZE]; int line; } query_decl;

struct blend_decl {
    char name[NAME_SIZE];
    struct { blend_equation equation; blend_factor source, destination; } rgb, alpha;
    bool composites;   // a fragment blended so counts as composited
    int line;
};

typedef enum bound_function { BOUND_less, BOUND_lequal, BOUND_equal, BOUND_gequal, BOUND_greater } bound_function;
extern const compare_function bound_compare[];  // by bound_function

typedef struct clip_decl { bound_function function; uint8_t plane[CLIP_MAX]; int plane_count; int line; } clip_decl;

// Fixed-function state of one geometry pass, as declared. Plane numbers index program.planes; -1: off.
typedef struct pass_decl {
    int shader;                           // kernel that runs first, for each fragment, on the shader cores
    uint8_t keep;                         // fragments for which this predicate of the shader is false are
    bool keep_negated;                    // discarded (or true, if negated); p0: none
    clip_decl clips[CLIP_MAX];            // fragment depth FUNCTION min(planes), read as textures; all must hold
    int clip_count;
    int depth_plane;
    compare_function depth_function;
    bool depth_write;
    int stencil_plane;
    compare_function stencil_function;
    uint8_t stencil_reference, stencil_mask, stencil_write_mask;
    stencil_operation stencil_fail, stencil_depth_fail, stencil_pass;
    struct { int plane; int blend; int source; } targets[TARGET_MAX];  // blend -1: replace; source: SOURCE_FRAGMENT_*
                                                                       // or the shader's c0..c6, SOURCE_COLOR + i
    int target_count;
    int query;
} pass_decl;

typedef struct kernel_decl {
    char name[NAME_SIZE];
    bool fullscreen;            // once a sample, no fragment inputs
    bool is_pass;               // declared as fixed-function state
    bool is_shader;             // run by passes: may read planes as textures, but not touch them
    pass_decl pass;
    uint32_t words[WORD_MAX];   // empty for a pass: bind_program lowers it for the machine
    int word_lines[WORD_MAX];   // source line of each word, 0 if it came from words
    int word_count;
    int line;
} kernel_decl;

typedef enum draw_class { CLASS_OPAQUE, CLASS_TRANSPARENT, CLASS_SORTED, CLASS_COUNT } draw_class;
enum { DRAW_OPAQUE = 1, DRAW_UNSORTED = 2, DRAW_SORTED = 4, DRAW_TRANSPARENT = DRAW_UNSORTED | DRAW_SORTED,
       DRAW_BATCH = 8 };  // transparent and sorted draws that reach into the depth range of the current batch
extern const char *const draw_class_names[CLASS_COUNT];  // opaque, transparent, sorted

typedef enum step_kind {
    STEP_CLEAR,       // plane = value at every sample
    STEP_COPY,        // plane = source plane at every sample
    STEP_SWAP,        // two planes change names: no storage moves
    STEP_DRAW,        // replay the draws of `classes` (DRAW_*) with the kernel: one geometry pass
    STEP_FULLSCREEN,  // run the kernel once a sample: one full-screen pass
    STEP_RESET,       // the query counts from 0 again
    STEP_REPEAT,      // `target`: index of its STEP_WHILE
    STEP_WHILE,       // if the query's count is above the limit, go on after `target`, its STEP_REPEAT
    STEP_IF,          // if it is not, go on after `target`, its STEP_END
    STEP_END,
    STEP_LIST,        // an A-buffer: one geometry pass keeps the fragments in front of plane `source` in a list of
                      // `entries` a sample, later ones are lost; one full-screen pass sorts each list by depth, ties in
                      // order of arrival, and blends it into `plane` front to back by blend state `kernel`
    STEP_BATCHES,     // runs what follows once for each batch of `entries` draws; `target`: index of its STEP_END_BATCHES
    STEP_END_BATCHES,
} step_kind;

typedef struct step {
    step_kind kind;
    uint8_t plane, source, kernel, query, classes;
    value value;
    uint32_t entries;
    uint16_t target;
    int line;
} step;

typedef struct program {
    char name[NAME_SIZE];
    plane_decl planes[PLANE_MAX];       int plane_count;
    query_decl queries[QUERY_MAX];      int query_count;
    blend_decl blends[BLEND_MAX];       int blend_count;
    value constants[CONSTANT_MAX];      int constant_count;
    kernel_decl kernels[KERNEL_MAX];    int kernel_count;
    step steps[STEP_MAX];               int step_count;
    uint64_t max_iterations;            // limit iterations N; 0: none declared
    double occlusion_ratio;             // limit occlusion_ratio R: a `while` goes on above R * samples
    int output_front, output_base;      // the image: front.rgb + front.a * base.rgb; front -1: base alone
} program;

// Assembles the text of one program; `file` is named in messages. On failure *program is NULL and
// each error was said as file:line:column with the line and a caret. Free with program_destroy.
status assemble_text(const char *file, const char *text, size_t size, const report *report, program **program);
// The same from a .rop file of at most 1 MiB.
status assemble_file(const char *path, const report *report, program **program);
// With values for the program's parameters (`param` lines); one that it does not declare is an error.
typedef struct parameter { char name[NAME_SIZE]; long value; } parameter;
status assemble_text_with(const char *file, const char *text, size_t size, const parameter *parameters,
                          int parameter_count, const report *report, program **program);
void program_destroy(program *program);  // NULL is fine

// Canonical text: assembling it and disassembling again gives the same bytes.
status disassemble_text(const program *program, FILE *out);

// The whole program as 32-bit words, and back; `*words` is freed with free(). Decoding trusts nothing.
status program_encode(const program *program, uint32_t **words, size_t *count);
status program_decode(const char *file, const uint32_t *words, size_t count, const report *report, program **program);

// ---- Verification against a machine --------------------------------------------------------------------

// What a machine's ROP can do; sim/ fills it from a machine file.
typedef struct rop_limits {
    const char *machine;         // for messages
    bool fixed_function;
    format depth_format, color_format;
    int stencil_bits;
    bool clip_interpolated;      // range clip on the depth as interpolated, not as stored
    uint32_t formats, opcodes;   // bit i: row i may be used
    int planes_max, bits_per_sample_max, color_targets_max, instructions_max;
    int list_entries_max;        // 0: the machine keeps no lists of fragments
} rop_limits;

// STATUS_OK if the program can run there; else each reason is said with the program's line and what the
// machine lacks. `file` is named in messages.
status verify_program(const program *program, const char *file, const rop_limits *limits, const report *report);
format plane_format(const plane_decl *plane, const rop_limits *limits);
int plane_bits(const plane_decl *plane, const rop_limits *limits);  // stencil planes: the machine's width

// ---- Execution -----------------------------------------------------------------------------------------

// A program bound to a machine: formats settled, passes lowered, words decoded for dispatch.
typedef struct bound_program bound_program;
status bind_program(const program *program, const rop_limits *limits, bool reversed_depth,
                    const float background[4], const report *report, bound_program **bound);
void bound_destroy(bound_program *bound);
// Lowered instructions of kernel k; word_count in *count. Valid as long as `bound`.
const instruction *bound_instructions(const bound_program *bound, int kernel, int *count);
// What a lowered instruction serves. Of each test's instructions, the first that writes a predicate decides it.
typedef enum pass_stage {
    STAGE_KERNEL,        // of a kernel, not of a pass
    STAGE_SHADER, STAGE_KEEP,  // the pass's shader; whether it discarded the fragment
    STAGE_CLIP,          // one test a clip of the pass, in their order
    STAGE_STENCIL_TEST, STAGE_DEPTH_TEST,
    STAGE_WRITE,         // stencil, depth, targets, query
} pass_stage;
pass_stage bound_stage(const bound_program *bound, int kernel, int word);
uint32_t bound_constant(const bound_program *bound, int index);
// As disassemble_text, with every pass as the kernel that it was lowered to. Assembles again, where a program may hold
// that many constants. `program` is the one that was bound.
status disassemble_bound(const program *program, const bound_program *bound, FILE *out);
format bound_plane_format(const bound_program *bound, int plane);
uint32_t bound_plane_mask(const bound_program *bound, int plane);      // value bits of a UINT plane
uint32_t bound_depth_formats(const bound_program *bound);  // bit f: some kernel reads the fragment's depth in format f
bool bound_reads(const bound_program *bound, int source);  // some kernel reads SOURCE_FRAGMENT_*, SOURCE_PRIMITIVE
// The value a clear writes: one word, or four float bit patterns already rounded to the plane's format.
void bound_clear_value(const bound_program *bound, const step *clear, uint32_t value[4]);
// What a plane without a clear holds at the start: zeros.

// A plane of one tile: 64 words; a colour plane: 4 x 64 (red first) of float bits, values as the format
// keeps them. Aligned to 64 bytes.
typedef uint32_t *tile_plane;

// What one dispatch did at an instruction, a bit a lane.
typedef struct lane_log {
    uint64_t active;    // had not skipped ahead
    uint64_t executed;  // of these, those whose guard held: what `counts` counts
    uint64_t outcome;   // what the predicate that it writes holds afterwards; 0 if it writes none
} lane_log;

// One batch: at most one fragment a lane. Arrays of 64, aligned to 4; lanes outside `lanes` are not used
// but must be readable. NULL where bound_depth_formats / bound_reads say the program does not look.
typedef struct batch {
    uint64_t lanes;
    const uint32_t *depth[FORMAT_COUNT];
    const float *rgba[4];
    const uint32_t *primitive;
    lane_log *log;  // NULL, or one entry for each of the kernel's instructions, which the dispatch fills
} batch;

// Runs kernel k over one batch. `planes[i]` is plane i of the tile. `counts[j]` grows by the number of
// lanes that executed instruction j: guard true, not skipped (a compare counts where its guard holds).
typedef void execute_kernel(const bound_program *bound, int kernel, const tile_plane *planes, const batch *batch,
                            uint64_t *counts);
// The implementation for vectors of `bytes` (16, 32 or 64; 0: the widest this processor has), or NULL if
// it was not built or the processor lacks it. All give the same bits.
execute_kernel *execute_select(int bytes);

// ---- One fragment, one instruction at a time (step.c) --------------------------------------------------

// The same meaning as execute_kernel's, for who wants to see each instruction. Slow.

// What arrives; a full-screen kernel has none of it (NULL).
typedef struct fragment_input {
    double depth;
    float rgba[4];  // straight
    uint32_t primitive;
} fragment_input;

// A fragment's registers while a kernel runs. Start with zeros: `fragment_state state = {0}`.
typedef struct fragment_state {
    uint32_t registers[REGISTER_COUNT];
    float colors[COLOR_COUNT][4];
    bool predicates[PREDICATE_COUNT];  // [0] is not kept: p0 is true
    int at;                            // next instruction
} fragment_state;

// What one instruction did. Scalars and predicates stand in [0]; float bits where the operand is a float or a colour.
typedef struct stepped {
    instruction instruction;
    int at;                        // its place in the kernel
    bool executed;                 // its guard held. If not, nothing below is set but a compare's false predicate
    uint32_t a[4], b[4];           // source operands: what was read; of ld and tex, a: the plane's value
    uint32_t before[4], after[4];  // what d held and holds: register, predicate (0 or 1), plane
} stepped;

// Executes the instruction at state->at of kernel k; false at the kernel's end. planes[i]: what plane i holds at this
// sample, one word or four.
bool step_instruction(const bound_program *bound, int kernel, const fragment_input *fragment, uint32_t (*planes)[4],
                      fragment_state *state, stepped *stepped);

#endif
