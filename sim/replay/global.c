// Conditions over all tiles, settled while the tiles run at their own pace.
//
// Evaluation k is the k-th condition in the order of the schedule: the same for all tiles, since its outcome
// is. Its count only grows, so "above the threshold" can be known before all tiles have got there, but "not"
// only after. Counts lie in blocks that never move, so that threads read them without a lock.
#include "replay.h"

#include <pthread.h>
#include <stdlib.h>

enum { BLOCK_SIZE = 4096, BLOCK_COUNT = 65536 };

typedef struct evaluation {
    _Atomic uint64_t count;
    atomic_bool closed;
} evaluation;

struct global {
    _Atomic(evaluation *) blocks[BLOCK_COUNT];
    pthread_mutex_t growing;
};

global *global_create(void)
{
    global *global = calloc(1, sizeof *global);
    if (global)
        pthread_mutex_init(&global->growing, NULL);
    return global;
}

void global_destroy(global *global)
{
    if (!global)
        return;
    for (int i = 0; i < BLOCK_COUNT; i++)
        free(atomic_load(&global->blocks[i]));
    pthread_mutex_destroy(&global->growing);
    free(global);
}

static evaluation *find(global *global, uint64_t k)
{
    if (k / BLOCK_SIZE >= BLOCK_COUNT)
        return NULL;
    evaluation *block = atomic_load_explicit(&global->blocks[k / BLOCK_SIZE], memory_order_acquire);
    return block ? block + k % BLOCK_SIZE : NULL;
}

static evaluation *find_or_make(global *global, uint64_t k)
{
    if (k / BLOCK_SIZE >= BLOCK_COUNT)
        return NULL;
    if (!find(global, k)) {
        pthread_mutex_lock(&global->growing);
        if (!find(global, k))
            atomic_store_explicit(&global->blocks[k / BLOCK_SIZE], calloc(BLOCK_SIZE, sizeof(evaluation)), memory_order_release);
        pthread_mutex_unlock(&global->growing);
    }
    return find(global, k);
}

bool global_add(global *global, uint64_t k, uint64_t count)
{
    evaluation *evaluation = find_or_make(global, k);
    if (evaluation && count)
        atomic_fetch_add_explicit(&evaluation->count, count, memory_order_relaxed);
    return evaluation;
}

outcome global_ask(global *global, uint64_t k, uint64_t threshold)
{
    evaluation *evaluation = find(global, k);
    if (!evaluation)
        return OUTCOME_UNKNOWN;
    if (atomic_load_explicit(&evaluation->count, memory_order_relaxed) > threshold)
        return OUTCOME_TRUE;
    return atomic_load_explicit(&evaluation->closed, memory_order_relaxed) ? OUTCOME_FALSE : OUTCOME_UNKNOWN;
}

void global_close(global *global, uint64_t k)
{
    evaluation *evaluation = find_or_make(global, k);
    if (evaluation)
        atomic_store_explicit(&evaluation->closed, true, memory_order_relaxed);
}

uint64_t global_count(global *global, uint64_t k)
{
    evaluation *evaluation = find(global, k);
    return evaluation ? atomic_load_explicit(&evaluation->count, memory_order_relaxed) : 0;
}
