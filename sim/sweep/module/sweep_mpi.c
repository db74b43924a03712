// Messages between ranks by MPI's C interface, version 2 and on.
//
// Sends are buffered (MPI_Bsend), since two ranks that send to each other must not wait for each other, and a rank that
// died takes nothing. Whoever looks for messages sleeps between two looks; a blocking MPI_Recv would keep a processor
// busy.
#include "sweep_mpi.h"

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>

enum { BUFFER_SIZE = 64 << 20 };

static int fail(int error, const char *call, char why[MPI_WHY_SIZE])
{
    char text[MPI_MAX_ERROR_STRING] = "unknown reason";
    int length = 0;
    MPI_Error_string(error, text, &length);
    snprintf(why, MPI_WHY_SIZE, "%s: %s", call, text);
    return 1;
}

static int start(int *rank, int *count, char why[MPI_WHY_SIZE])
{
    int error = MPI_Init(NULL, NULL);
    if (error != MPI_SUCCESS)
        return fail(error, "MPI_Init", why);
    MPI_Comm_set_errhandler(MPI_COMM_WORLD, MPI_ERRORS_RETURN);
    MPI_Comm_rank(MPI_COMM_WORLD, rank);
    MPI_Comm_size(MPI_COMM_WORLD, count);
    void *buffer = malloc(BUFFER_SIZE);  // of what is on its way; untouched pages cost nothing
    error = buffer ? MPI_Buffer_attach(buffer, BUFFER_SIZE) : MPI_ERR_NO_MEM;
    return error == MPI_SUCCESS ? 0 : fail(error, "MPI_Buffer_attach", why);
}

static int send(int to, int tag, const void *data, size_t size, char why[MPI_WHY_SIZE])
{
    const int error = MPI_Bsend(data, (int)size, MPI_BYTE, to, tag, MPI_COMM_WORLD);
    return error == MPI_SUCCESS ? 0 : fail(error, "MPI_Bsend", why);
}

static int take(int *from, int *tag, void *data, size_t room, size_t *size, char why[MPI_WHY_SIZE])
{
    MPI_Status status;
    int there = 0, bytes = 0;
    *from = -1;
    int error = MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status);
    if (error != MPI_SUCCESS)
        return fail(error, "MPI_Iprobe", why);
    if (!there)
        return 0;
    error = MPI_Recv(data, (int)room, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG, MPI_COMM_WORLD, &status);
    if (error != MPI_SUCCESS)
        return fail(error, "MPI_Recv", why);
    MPI_Get_count(&status, MPI_BYTE, &bytes);
    *from = status.MPI_SOURCE;
    *tag = status.MPI_TAG;
    *size = (size_t)bytes;
    return 0;
}

static void end(void)
{
    void *buffer;
    int size;
    MPI_Buffer_detach(&buffer, &size);
    free(buffer);
    MPI_Finalize();
}

static void end_all(int status)
{
    MPI_Abort(MPI_COMM_WORLD, status);
}

const mpi_functions ropsim_mpi_functions = {start, send, take, end, end_all};
