// How this process was started, from its environment alone: as one of several ranks, or by itself.
//
// Only the variables count that a launcher sets in each process that it starts. A shell inside a Slurm allocation has
// SLURM_NTASKS and SLURM_PROCID, too, but no step of several tasks: there, a plain `ropsim sweep` runs by itself.
#include "../sweeps.h"

#include <stdlib.h>
#include <string.h>

static const struct {
    const char *count, *ranks[3];  // the first rank that is set
} launchers[] = {
    {"OMPI_COMM_WORLD_SIZE", {"OMPI_COMM_WORLD_RANK"}},                   // Open MPI's mpirun
    {"PMI_SIZE", {"PMI_RANK"}},                                           // MPICH's mpirun, srun --mpi=pmi2
    {"SLURM_STEP_NUM_TASKS", {"PMIX_RANK", "PMI_RANK", "SLURM_PROCID"}},  // srun
};

static bool read_number(const char *name, int *number)
{
    const char *text = name ? getenv(name) : NULL;
    if (!text || !*text || strspn(text, "0123456789") != strlen(text) || strlen(text) > 9)
        return false;
    *number = atoi(text);
    return true;
}

sweep_launch sweep_get_launch(void)
{
    for (size_t i = 0; i < sizeof launchers / sizeof *launchers; i++) {
        sweep_launch launch;
        if (!read_number(launchers[i].count, &launch.count))
            continue;
        if (launch.count < 2)  // mpirun reaches other machines by srun, so what is set further down is not about us
            break;
        for (int k = 0; k < 3; k++) {
            if (read_number(launchers[i].ranks[k], &launch.rank) && launch.rank < launch.count)
                return launch;
        }
    }
    return (sweep_launch){.rank = 0, .count = 1};
}
