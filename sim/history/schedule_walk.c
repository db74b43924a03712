// The schedule and the outcomes of its conditions in; one sample's planes through all steps out, each told to a sink.
#include "history.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

typedef struct walker {
    history *history;
    const sink *sink;
    bool failed;
} walker;

// Calls a function of the sink, if it has one.
#define TELL(w, what, ...) \
    do { \
        if ((w)->sink->what) \
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
    return iteration_wanted(h) &&
           (!options->pass || options->pass == (options->iteration ? h->pass_in_iteration : h->pass));
}

static void clear(history *h, const step *step)
{
    uint32_t *plane = h->planes[step->plane];
    bound_clear_value(h->bound, step, plane);
    if (step->value.kind == VALUE_BATCH_NEAR)
        plane[0] = h->batches->batches[h->batch].near_code;
    else if (step->value.kind == VALUE_BATCH_FAR)
        plane[0] = h->batches->batches[h->batch].far_code;
}

static void transfer(walker *w, const step *step)
{
    history *h = w->history;
    uint32_t kept[4];
    switch (step->kind) {
    case STEP_CLEAR: clear(h, step); break;
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

// Opaque draws have no number: they are shown with all the rest or not at all.
static bool begin_pass(walker *w, const step *step, bool numbered)
{
    history *h = w->history;
    h->pass += numbered;
    h->pass_in_iteration += numbered;
    const bool wanted = pass_wanted(h) && (numbered || !h->options->pass);
    h->shown += wanted;
    if (wanted)
        TELL(w, pass, h, step);
    return wanted;
}

bool schedule_draws(const history *h, const step *step, uint64_t index)
{
    const sample_fragment *fragment = &h->fragments[index];
    if (step->classes == DRAW_BATCH)
        return h->batches->batches[h->batch].draws[fragment->draw];
    return step->classes >> fragment->class & 1;
}

static void draw(walker *w, const step *step)
{
    history *h = w->history;
    const bool wanted = begin_pass(w, step, step->classes != DRAW_OPAQUE);
    for (uint64_t i = 0; i < h->fragment_count; i++) {
        if (!schedule_draws(h, step, i))
            continue;
        observe_fragment(h, step->kernel, &h->fragments[i].input);
        if (wanted)
            TELL(w, fragment, h, i);
    }
    if (wanted)
        TELL(w, pass_end, h, step);
}

static void fullscreen(walker *w, const step *step)
{
    history *h = w->history;
    const bool wanted = begin_pass(w, step, true);
    observe_fragment(h, step->kernel, NULL);
    if (wanted) {
        TELL(w, fragment, h, UINT64_MAX);
        TELL(w, pass_end, h, step);
    }
}

// A geometry pass that keeps fragments, then a full-screen pass that blends them.
static void list(walker *w, const step *step)
{
    history *h = w->history;
    kept_list list = {calloc(h->fragment_count + 1, sizeof *list.kept), 0};
    if (!list.kept) {
        w->failed = true;
        return;
    }
    bool wanted = begin_pass(w, step, true);
    for (uint64_t i = 0; i < h->fragment_count; i++) {
        if (!schedule_draws(h, step, i))
            continue;
        fragment_keep(h, step, i, &list);
        if (wanted)
            TELL(w, fragment, h, i);
    }
    if (wanted)
        TELL(w, pass_end, h, step);
    kept_sort(&list);
    float color[4];
    memcpy(color, h->planes[step->plane], sizeof color);
    h->blending = true;
    wanted = begin_pass(w, step, true);
    for (uint64_t i = 0; i < list.count; i++) {
        kept_blend(h, step, list.kept[i].index, color);
        if (wanted)
            TELL(w, fragment, h, list.kept[i].index);
    }
    for (int c = 0; list.count && c < 4; c++)
        color[c] = format_round_component(bound_plane_format(h->bound, step->plane), color[c]);
    memcpy(h->planes[step->plane], color, sizeof color);
    if (wanted)
        TELL(w, pass_end, h, step);
    h->blending = false;
    free(list.kept);
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

static void begin_batch(walker *w)
{
    if (!w->history->options->iteration && !w->history->options->pass)
        TELL(w, batch, w->history);
}

// The batches of a `batches` step: they are kept in the order of these steps.
static const draw_batches *batches_of(const history *h, int at)
{
    int index = 0;
    for (int s = 0; s < at; s++)
        index += h->program->steps[s].kind == STEP_BATCHES;
    return &h->run->batches[index];
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
    case STEP_DRAW: draw(w, step); break;
    case STEP_FULLSCREEN: fullscreen(w, step); break;
    case STEP_LIST: list(w, step); break;
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
    case STEP_BATCHES:
        h->batches = batches_of(h, at);
        h->batch = 0;
        if (h->batches->count == 0)
            return step->target + 1;
        begin_batch(w);
        break;
    case STEP_END_BATCHES:
        if (h->batch + 1 < h->batches->count) {
            h->batch++;
            begin_batch(w);
            return step->target + 1;
        }
        h->batches = NULL;
        break;
    }
    return at + 1;
}

bool schedule_walk(history *h, const sink *sink)
{
    walker w = {h, sink, false};
    TELL(&w, begin, h);
    for (int at = 0; !w.failed && at < h->program->step_count;)
        at = run_step(&w, at);
    memcpy(h->before, h->planes, sizeof h->before);
    TELL(&w, end, h);
    return !w.failed;
}
