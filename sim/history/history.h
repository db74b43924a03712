// The history's parts, in the order in which data flows:
//
//   replay_run --> conditions of loops, final planes          trace --fragments_gather--> the sample's fragments
//       both --schedule_walk--> steps --observe_fragment--> events --> a sink: text, JSON or one plane's value
//
// One sample is run on its own, fragment after fragment and instruction after instruction (step_instruction); only the
// outcomes of `while` and `if` come from the replay, since they ask about all samples.
#ifndef ROPSIM_HISTORY_H
#define ROPSIM_HISTORY_H

#include "../sim.h"

enum { NEST_MAX = 64, VALUE_NAME_SIZE = CLIP_MAX * (NAME_SIZE + 2) + 8 };

// A value and how to show it: as a depth in a DEPTH format, as an integer in a UINT one, as a float in f32, as four
// floats in a COLOR one.
typedef struct named_value {
    char name[VALUE_NAME_SIZE];  // of the plane it came from, `z`, `near`; empty: the value says it all
    format format;
    uint32_t words[4];
} named_value;

typedef enum event_kind {
    EVENT_KEEP,  // the shader's verdict: discarded if it does not hold
    EVENT_CLIP,
    EVENT_STENCIL,
    EVENT_DEPTH,      // declared tests of a pass: left RELATION right
    EVENT_COMPARE,    // of a kernel or a shader: left RELATION right
    EVENT_WRITE,      // a plane: left before, right after
    EVENT_COUNT,      // query `query` counts the fragment
    EVENT_COMPOSITE,  // a blend state that composites was applied
    EVENT_LIST,       // the fragment came to a list: it holds if there was room
} event_kind;

typedef struct event {
    event_kind kind;
    bool holds;
    const char *relation;  // <, <=, =, !=, >=, >; always and never: without sides
    named_value left, right;
    int query;
} event;

typedef struct sample_fragment {
    uint32_t draw;
    draw_class class;
    fragment_input input;
} sample_fragment;

typedef struct history {
    const program *program;
    const bound_program *bound;
    const rop_limits *limits;
    const trace_info *info;
    const history_options *options;
    const run_result *run;
    const char *machine;
    uint32_t x, y, sample;
    sample_fragment *fragments;  // in raster order
    uint64_t fragment_count;

    // Where the walk stands.
    uint32_t planes[PLANE_MAX][4], before[PLANE_MAX][4];  // now; at the start of the step
    uint64_t queries[QUERY_MAX];                          // counted here since the last reset
    uint64_t iterations[NEST_MAX];                        // of the repeats that it is in, outermost first, from 1
    int nest;
    uint64_t pass, pass_in_iteration;  // numbers of the last pass; opaque draws have none
    uint64_t evaluation;               // conditions met so far
    bool blending;                     // in the second pass of a `list`
    const draw_batches *batches;       // of the `batches` step that it is in, NULL: none
    uint32_t batch;                    // of those, from 0
    uint64_t shown;                    // passes that options asked for
    event events[WORD_MAX];            // of one fragment: at most one an instruction
    int event_count;
} history;

// What is told of the walk, in its order. `user` is the sink's own; each function may be NULL.
typedef struct sink {
    void *user;
    void (*begin)(void *user, const history *history);
    void (*batch)(void *user, const history *history);      // its number: history->batch
    void (*iteration)(void *user, const history *history);  // its number: history->iterations[nest - 1]
    void (*transfer)(void *user, const history *history, const step *step);  // clear, copy, swap, reset: is done
    void (*pass)(void *user, const history *history, const step *step);      // a draw or a full-screen pass begins
    void (*fragment)(void *user, const history *history,
                     uint64_t index);  // index into fragments; UINT64_MAX: full-screen
    void (*pass_end)(void *user, const history *history, const step *step);
    void (*condition)(void *user, const history *history, const step *step, const condition_result *result);
    void (*end)(void *user, const history *history);
} sink;

// All fragments of the sample; freed by the caller (fragments_gather.c).
status fragments_gather(trace *trace, const report *report, history *history);
// Runs the schedule on the sample (schedule_walk.c). False: out of memory.
bool schedule_walk(history *history, const sink *sink);
bool schedule_draws(const history *history, const step *step, uint64_t index);  // whether a step draws the fragment
event *event_add(history *history, event_kind kind);                            // zeros, at the end of history->events
named_value value_named(const char *name, format format, uint32_t word);
// Runs a kernel for one fragment (NULL: full-screen) and fills history->events (observe.c).
void observe_fragment(history *history, int kernel, const fragment_input *fragment);

// A `list` step's list of one sample (fragment_keep.c): its fragments come in raster order, are sorted and blended.
typedef struct kept_fragment {
    uint32_t code;
    uint64_t index;
} kept_fragment;
typedef struct kept_list {
    kept_fragment *kept;
    uint64_t count;
} kept_list;  // kept: room for all fragments of the sample
void fragment_keep(history *history, const step *step, uint64_t index, kept_list *list);  // fills history->events
void kept_sort(kept_list *list);
// Blends a fragment over `color`, in float; fills history->events.
void kept_blend(history *history, const step *step, uint64_t index, float color[4]);

// The value of a plane, named after it (value.c).
named_value value_of_plane(const history *history, int plane, const uint32_t words[4]);
bool value_same(const named_value *a, const named_value *b);
// As text: "0.25", "0.25 (16384)" with the code of an integer depth format, "3", "(1 0 0 0.5)".
enum { VALUE_TEXT_SIZE = 96 };
void value_text(const history *history, const named_value *value, char text[VALUE_TEXT_SIZE]);
// Whether a pass reads or writes the plane.
bool value_touched(const history *history, const step *step, int plane);
const char *value_classes(int classes);  // of a draw, as the schedule says it
// The sample's colour as the replay resolves it.
void value_output(const history *history, float rgb[3]);

// Where a JSON object is being written, and whether the array that is open has an element already: a comma comes first.
typedef struct json_writer {
    FILE *out;
    bool steps, fragments;
} json_writer;
sink history_text_sink(FILE *out);
sink history_json_sink(json_writer *writer);  // which lives as long as the sink

#endif
