// The schedule and the outcomes of its conditions in; one sample's planes through all steps out, each told to a sink.
#include "history.h"

#include <assert.h>
#include <string.h>

typedef struct walker {
    history *history;
    const sink *sink;
} walker;

// Calls a function of the sink, if it has one.
#define TELL(w, what, ...)                             \
    do {                                               \
        if ((w)->sink->what)                           \
            (w)->sink->what((w)->sink->user, __VA_ARGS__); \
    } while (0)

// Whether options ask for what lies in this iteration; of passes, for this one.
static bool iteration_wanted(const history *h)
{
    const uint64_t wanted = h->options->iteration;
    return !wanted || (h->nest > 0 && h->iterations[0] == wanted);
}

static bool pass_wanted(const history *h)
{
    const history_options *options = h->options;
    return iteration_wanted(h) && (!options->pass || options->pass == (options->iteration ? h->pass_in_iteration : h->pass));
}

static void transfer(walker *w, const step *step)
{
    history *h = w->history;
    uint32_t kept[4];
    switch (step->kind) {
    case STEP_CLEAR: bound_clear_value(h->bound, step, h->planes[step->plane]); break;
    case STEP_COPY: memcpy(h->planes[step->plane], h->planes[step->source], sizeof h->planes[0]); break;
    case STEP_SWAP:
        memcpy(kept, h->planes[step->plane], sizeof kept);
        memcpy(h->planes[step->plane], h->planes[step->source], sizeof kept);
        memcpy(h->planes[step->source], kept, sizeof kept);
        break;
    default: h->queries[step->query] = 0;
    }
    if (iteration_wanted(h) && !h->options->pass)
        TELL(w, transfer, h, step);
}

static void pass(walker *w, const step *step)
{
    history *h = w->history;
    const bool numbered = step->kind == STEP_FULLSCREEN || step->classes != DRAW_OPAQUE;
    h->pass += numbered;
    h->pass_in_iteration += numbered;
    const bool wanted = pass_wanted(h) && (numbered || !h->options->pass);
    h->shown += wanted;
    if (wanted)
        TELL(w, pass, h, step);
    if (step->kind == STEP_FULLSCREEN) {
        observe_fragment(h, step->kernel, NULL);
        if (wanted)
            TELL(w, fragment, h, UINT64_MAX);
    }
    for (uint64_t i = 0; step->kind == STEP_DRAW && i < h->fragment_count; i++) {
        if (!(step->classes >> h->fragments[i].class & 1))
            continue;
        observe_fragment(h, step->kernel, &h->fragments[i].input);
        if (wanted)
            TELL(w, fragment, h, i);
    }
    if (wanted)
        TELL(w, pass_end, h, step);
}

static void begin_iteration(walker *w)
{
    history *h = w->history;
    h->iterations[h->nest - 1]++;
    if (h->nest == 1)
        h->pass_in_iteration = 0;
    if (iteration_wanted(h) && !h->options->pass)
        TELL(w, iteration, h);
}

// Whether a `while` or `if` holds, over the whole image.
static bool condition(walker *w, const step *step)
{
    history *h = w->history;
    assert(h->evaluation < h->run->condition_count);
    const condition_result *result = &h->run->conditions[h->evaluation++];
    if (iteration_wanted(h) && !h->options->pass)
        TELL(w, condition, h, step, result);
    return result->holds;
}

// Runs one step; returns where the schedule goes on.
static int run_step(walker *w, int at)
{
    history *h = w->history;
    const step *step = &h->program->steps[at];
    memcpy(h->before, h->planes, sizeof h->before);
    switch (step->kind) {
    case STEP_CLEAR:
    case STEP_COPY:
    case STEP_SWAP:
    case STEP_RESET: transfer(w, step); break;
    case STEP_DRAW:
    case STEP_FULLSCREEN: pass(w, step); break;
    case STEP_REPEAT:
        assert(h->nest < NEST_MAX);
        h->iterations[h->nest++] = 0;
        begin_iteration(w);
        break;
    case STEP_WHILE:
        if (condition(w, step)) {
            begin_iteration(w);
            return step->target + 1;  // behind its `repeat`
        }
        h->nest--;
        break;
    case STEP_IF:
        if (!condition(w, step))
            return step->target + 1;
        break;
    case STEP_END: break;
    }
    return at + 1;
}

void schedule_walk(history *h, const sink *sink)
{
    walker w = {h, sink};
    TELL(&w, begin, h);
    for (int at = 0; at < h->program->step_count;)
        at = run_step(&w, at);
    TELL(&w, end, h);
}
