// Iterations that change nothing are counted instead of run.
//
// If the planes and query counts at the head of a loop's body are what they were one iteration before, the
// next iteration meets the same state; with the same outcomes of its conditions it does the same: the same
// instructions executed, the same counts added to the conditions, the same state at its end. So it is enough
// to add the last iteration's counts, as long as the outcomes ahead are known and the same.
#include "tile.h"
#include "write_log.h"

#include <string.h>

enum { NO_LOOP = -1, RESUMED = -2 };

void fixed_start(worker *w, const tile *tile)
{
    w->loop = NO_LOOP;
    w->noted_count = 0;
    w->has_snapshot = w->fixed = false;
    // A tile that waited counted nothing of its own: its next iterations are worth watching.
    if (tile->waiting)
        w->loop = RESUMED;
}

void fixed_enter(worker *w)
{
    if (w->loop != RESUMED)
        w->loop = NO_LOOP;
}

void fixed_note(worker *w, uint64_t count, uint64_t threshold, outcome outcome)
{
    if (w->noted_count < 0)
        return;
    if (w->noted_count == EVALUATION_MAX)
        w->noted_count = -1;
    else
        w->noted[w->noted_count++] = (noted){count, threshold, outcome};
}

static bool state_is_snapshot(const worker *w, const tile *tile)
{
    if (memcmp(tile->query, w->query_snapshot, sizeof tile->query) != 0)
        return false;
    const uint32_t *snapshot = w->snapshot;
    for (int i = 0; i < w->plan->program->plane_count; i++) {
        const uint32_t words = plane_words(w->plan, i);
        if (memcmp(w->planes[i], snapshot, words * sizeof *snapshot) != 0)
            return false;
        snapshot += words;
    }
    return true;
}

static void take_snapshot(worker *w, const tile *tile)
{
    uint32_t *snapshot = w->snapshot;
    for (int i = 0; i < w->plan->program->plane_count; i++) {
        const uint32_t words = plane_words(w->plan, i);
        memcpy(snapshot, w->planes[i], words * sizeof *snapshot);
        snapshot += words;
    }
    memcpy(w->query_snapshot, tile->query, sizeof tile->query);
    w->draws_before = tile->draws;
    memcpy(w->before, w->counts, w->count_total * sizeof *w->counts);
}

static bool was_idle(const worker *w)
{
    for (int i = 0; i < w->noted_count; i++)
        if (w->noted[i].count)
            return false;
    return true;
}

static bool outcomes_repeat(const worker *w, const tile *tile)
{
    for (int i = 0; i < w->noted_count; i++)
        if (global_ask(w->global, tile->evaluation + (uint64_t)i, w->noted[i].threshold) != w->noted[i].outcome)
            return false;
    return true;
}

static void count_iterations(worker *w, tile *tile)
{
    uint32_t *iterations = &tile->iterations[w->plan->repeat_index[w->loop]];
    while (*iterations + 1 < w->plan->max_iterations && outcomes_repeat(w, tile)) {
        for (int i = 0; i < w->noted_count; i++)
            if (!global_add(w->global, tile->evaluation++, w->noted[i].count))
                w->failed = true;
        for (uint32_t i = 0; i < w->count_total; i++)
            w->counts[i] += w->delta[i];
        if (w->plan->writes && w->bin)
            write_log_repeat(w->plan->writes, tile_number(w), tile->draws, w->draws_each);
        tile->draws += w->draws_each;
        ++*iterations;
    }
}

void fixed_head(worker *w, tile *tile, int loop)
{
    if (w->plan->stop_after_pass)
        return;  // every pass must be met
    const bool again = w->loop == loop && w->noted_count > 0;
    if (again && w->has_snapshot && state_is_snapshot(w, tile)) {
        w->fixed = true;
        w->draws_each = tile->draws - w->draws_before;
        for (uint32_t i = 0; i < w->count_total; i++)
            w->delta[i] = w->counts[i] - w->before[i];
    }
    if (again && w->fixed)
        count_iterations(w, tile);
    w->has_snapshot = w->loop == RESUMED || (again && was_idle(w));
    w->fixed = false;
    if (w->has_snapshot)
        take_snapshot(w, tile);
    w->loop = loop;
    w->noted_count = 0;
}
