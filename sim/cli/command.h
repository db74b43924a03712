// The command's parts: one file a sub-command, one row of commands.def each.
#ifndef ROPSIM_COMMAND_H
#define ROPSIM_COMMAND_H

#include "../sim.h"

// Each takes its own name as argv[0] and returns the process's exit code (a `status`).
#define COMMAND(name, arguments, summary) int command_##name(int argc, char **argv);
#include "commands.def"
#undef COMMAND

// Messages to stderr, progress to stderr when it is a terminal or when --progress was given.
extern const report command_report;

#endif
