// `ropsim statistics`: the glossary of what the levels traffic and cycle count, as it stands in docs/statistics.md.
#include "command.h"

#include "../levels.h"

static const command_option options[] = {{0}};

int command_statistics(int argc, char **argv)
{
    command_line line = {.argc = argc, .argv = argv, .options = options};
    switch (command_next(&line)) {
    case COMMAND_END: return (int)statistics_print(stdout);
    case COMMAND_HELP: return STATUS_OK;
    case COMMAND_OPERAND: return (int)command_usage("statistics", "it takes no operand");
    default: return STATUS_USAGE;
    }
}
