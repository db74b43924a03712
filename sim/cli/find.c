// A machine as a user names it, with every --set on top.
#include "command.h"

#include "../levels.h"

status command_find_machine(const char *name, int argc, char **argv, const command_option *options, int set_row,
                            machine *machine)
{
    command_line line = {.argc = argc, .argv = argv, .options = options};
    status status = machine_load(name ? name : COMMAND_DEFAULT_MACHINE, &command_report, machine);
    for (int option; status == STATUS_OK && (option = command_next(&line)) != COMMAND_END;) {
        if (option == set_row)
            status = machine_set(machine, line.value, &command_report);
    }
    return status == STATUS_OK ? machine_check(machine, &command_report) : status;
}
