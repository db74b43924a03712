// What the MPI module offers: messages between the ranks of a sweep, as one table found by its name after dlopen.
//
// MPI brings dozens of shared libraries and would start threads, so a sweep opens it when mpirun started it, and the
// command does not link to it. Nothing here waits for another rank but `start` and `end`.
#ifndef ROPSIM_SWEEP_MPI_H
#define ROPSIM_SWEEP_MPI_H

#include <stddef.h>

enum { MPI_WHY_SIZE = 512 };

// Each returns 0, or not 0 with the reason in `why`.
typedef struct mpi_functions {
    // Once a process. Does not return if MPI itself cannot start: MPI says why and ends the ranks.
    int (*start)(int *rank, int *count, char why[MPI_WHY_SIZE]);
    // Copies the message; it arrives behind those that were sent to that rank before.
    int (*send)(int to, int tag, const void *data, size_t size, char why[MPI_WHY_SIZE]);
    // Takes a message if there is one; *from is -1 if not. One that is larger than `room` is a failure.
    int (*take)(int *from, int *tag, void *data, size_t room, size_t *size, char why[MPI_WHY_SIZE]);
    void (*end)(void);  // when every rank has called it
    // Ends all ranks at once, by force where need be, with that exit status. Does not return.
    void (*abort)(int status);
} mpi_functions;

extern const mpi_functions ropsim_mpi_functions;

#endif
