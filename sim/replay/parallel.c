// A count in, calls from several threads out: each thread takes the next index when it is free. And the clock that times them.
#include "replay.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <time.h>

enum { THREAD_MAX = 256 };

typedef struct job {
    void (*body)(void *context, int thread, uint32_t i);
    void *context;
    uint32_t count;
    atomic_uint next, thread;
} job;

static void *work(void *pointer)
{
    job *job = pointer;
    const int thread = (int)atomic_fetch_add(&job->thread, 1);
    for (uint32_t i; (i = atomic_fetch_add(&job->next, 1)) < job->count;)
        job->body(job->context, thread, i);
    return NULL;
}

int parallel_default(void)
{
    cpu_set_t set;
    const int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    return count < 1 ? 1 : count > THREAD_MAX ? THREAD_MAX : count;
}

void parallel_for(int threads, uint32_t count, void (*body)(void *context, int thread, uint32_t i), void *context)
{
    job job = {.body = body, .context = context, .count = count};
    pthread_t started[THREAD_MAX];
    int started_count = 0;
    // A thread that cannot be started is no error: the others do its share.
    while (started_count < threads - 1 && started_count < THREAD_MAX &&
           pthread_create(&started[started_count], NULL, work, &job) == 0)
        started_count++;
    work(&job);
    for (int i = 0; i < started_count; i++)
        pthread_join(started[i], NULL);
}

double seconds_now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}
