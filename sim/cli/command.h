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
// From now on this process prints nothing; false if that cannot be had.
bool command_silence(void);

// One option of a sub-command. A table of them, ended by a row without a name, gives parser and --help.
typedef struct command_option {
    const char *name;      // "threads", given as --threads N or --threads=N
    char letter;           // 'o' for -o as well; 0: none
    const char *argument;  // "N"; NULL: a switch
    const char *help;      // what it does, its unit, its default
} command_option;

// A walk over a sub-command's words:
//
//   command_line line = {.argc = argc, .argv = argv, .options = table};
//   for (int option; (option = command_next(&line)) != COMMAND_END;)
//       option is a row of the table or COMMAND_OPERAND, line.value its text; or COMMAND_HELP (help was
//       printed: return STATUS_OK) or COMMAND_ERROR (was said: return STATUS_USAGE)
enum { COMMAND_END = -1, COMMAND_OPERAND = -2, COMMAND_HELP = -3, COMMAND_ERROR = -4 };
typedef struct command_line {
    int argc;
    char **argv;
    const command_option *options;
    int index;  // of the last word taken
    const char *value;
    bool operands_only;  // after --
} command_line;
int command_next(command_line *line);

// Strict readers of an option's value; false after saying what is accepted.
bool command_uint(const char *option, const char *text, uint64_t min, uint64_t max, uint64_t *value);
bool command_double(const char *option, const char *text, double min, double max, double *value);

// --threads N and --memory MIB, which several commands have.
bool command_threads(const char *value, int *threads);
bool command_memory(const char *value, uint64_t *bytes);

// Says that the words are off, names `ropsim COMMAND --help`, returns STATUS_USAGE.
status command_usage(const char *command, const char *why);

#define COMMAND_DEFAULT_MACHINE "programmable"
enum { COMMAND_THREADS_MAX = 1024 };

// The machine `name` (NULL: the default) with every --set of the words on top; `set_row` is --set's row. Keys that
// contradict each other are refused.
status command_find_machine(const char *name, int argc, char **argv, const command_option *options, int set_row,
                            machine *machine);

// Assembles the program and verifies it against the machine. Free with program_destroy.
status command_load_program(const char *name, const machine *machine, program **program);
// The same, and replays the trace. Free with result_destroy.
status command_replay(const char *name, const machine *machine, trace *trace, const run_options *options,
                      run_result **result);

#endif
