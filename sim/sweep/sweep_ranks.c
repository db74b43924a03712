// The ranks of a sweep: starts MPI by its module, sends and takes messages, lets all end.
#include "sweep_ranks.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BEAT_SECONDS = 1, WHY_SIZE = 4096 };

double ranks_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Open MPI would say so, too, in words about its own configuration.
static status check_launcher(const report *report, const sweep_launch *launch)
{
    if (getenv("OMPI_COMM_WORLD_SIZE") || getenv("PMI_RANK") || getenv("PMIX_RANK"))
        return STATUS_OK;
    return report_error(report, STATUS_REFUSED,
                        "srun started %d tasks without MPI; start them by `srun --mpi=pmix` or by mpirun, or start "
                        "one task with --jobs",
                        launch->count);
}

status sweep_ranks_open(const report *report, int silence, sweep_ranks **ranks)
{
    char why[WHY_SIZE];
    const sweep_launch launch = sweep_get_launch();
    *ranks = NULL;
    const status status = check_launcher(report, &launch);
    if (status != STATUS_OK)
        return status;
    void *module = module_open("ropsim_mpi.so", why, sizeof why);
    const mpi_functions *mpi = module ? dlsym(module, "ropsim_mpi_functions") : NULL;
    if (!mpi)
        return report_error(report, STATUS_REFUSED,
                            "a sweep was started as %d ranks, but MPI is not built in (%s); install libopenmpi-dev and "
                            "build again, or start one process with --jobs",
                            launch.count, module ? dlerror() : why);
    sweep_ranks *new = calloc(1, sizeof *new);
    if (!new)
        return report_error(report, STATUS_IO, "out of memory");
    *new = (sweep_ranks){.mpi = mpi, .report = report};
    new->silence = silence < SWEEP_SILENCE_MIN ? SWEEP_SILENCE_MIN : silence;
    if (mpi->start(&new->rank, &new->count, why) != 0) {
        free(new);
        return report_error(report, STATUS_IO, "MPI does not start: %s", why);
    }
    if (new->count != launch.count || new->rank != launch.rank) {
        const int rank = new->rank, count = new->count;
        mpi->end();
        free(new);
        return report_error(report, STATUS_REFUSED,
                            "this process was started as rank %d of %d, but MPI takes it for rank %d of %d; use the "
                            "mpirun of the MPI that ropsim was built with, or srun --mpi=pmix",
                            launch.rank, launch.count, rank, count);
    }
    *ranks = new;
    return STATUS_OK;
}

status ranks_send(sweep_ranks *ranks, int to, rank_tag tag, const void *data, size_t size)
{
    char why[MPI_WHY_SIZE];
    if (ranks->mpi->send(to, (int)tag, data, size, why) == 0)
        return STATUS_OK;
    return report_error(ranks->report, STATUS_IO, "a message to rank %d: %s", to, why);
}

status ranks_take(sweep_ranks *ranks, int *from, rank_tag *tag, rank_message *message)
{
    char why[MPI_WHY_SIZE];
    int number = 0;
    size_t size = 0;
    if (ranks->mpi->take(from, &number, message, sizeof *message, &size, why) != 0)
        return report_error(ranks->report, STATUS_IO, "a message of another rank: %s", why);
    *tag = (rank_tag)number;
    return STATUS_OK;
}

bool ranks_beat_is_due(sweep_ranks *ranks)
{
    const double now = ranks_now();
    if (now - ranks->beat < BEAT_SECONDS)
        return false;
    ranks->beat = now;
    return true;
}

void ranks_end(sweep_ranks *ranks)
{
    char why[MPI_WHY_SIZE];
    for (int rank = 1; !ranks->ended && rank < ranks->count; rank++)
        ranks->mpi->send(rank, TAG_END, NULL, 0, why);  // one that takes nothing any more has ended
    ranks->ended = true;
}

void sweep_ranks_close(sweep_ranks *ranks, status status)
{
    if (!ranks)
        return;
    if (ranks->rank == 0)
        ranks_end(ranks);
    if (ranks->lost > 0)
        ranks->mpi->abort((int)status);  // who was given up would be waited for, perhaps for ever
    if (ranks->rank == 0 || status == STATUS_OK)
        ranks->mpi->end();
    free(ranks);
}
