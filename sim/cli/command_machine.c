// `ropsim machine`: the resolved machine as a machine file, the shipped ones, or the page of keys.
#include "command.h"

enum { ROW_SET, ROW_LIST, ROW_KEYS };
static const command_option options[] = {
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key; may be repeated"},
    [ROW_LIST] = {"list", 0, NULL, "names of the shipped machines"},
    [ROW_KEYS] = {"keys", 0, NULL, "every key with what it accepts, as a Markdown table"},
    {0},
};

static int list_machines(void)
{
    enum { MACHINES_MAX = 64 };
    char names[MACHINES_MAX][NAME_SIZE];
    int count = data_names("machines", ".yaml", names, MACHINES_MAX);
    if (count == 0)
        return (int)report_error(&command_report, STATUS_IO,
                                 "no machines folder found; ROPSIM_DATA may name its parent");
    for (int i = 0; i < count; i++)
        puts(names[i]);
    return STATUS_OK;
}

int command_machine(int argc, char **argv)
{
    const char *name = NULL;
    bool list = false, keys = false;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        switch (option) {
        case COMMAND_HELP: return STATUS_OK;
        case COMMAND_ERROR: return STATUS_USAGE;
        case COMMAND_OPERAND:
            if (name)
                return (int)command_usage("machine", "one machine at a time");
            name = line.value;
            break;
        case ROW_LIST: list = true; break;
        case ROW_KEYS: keys = true; break;
        default: break;
        }
    }
    if (list)
        return list_machines();
    if (keys)
        return (int)machine_print_keys(stdout);
    machine machine;
    status result = command_find_machine(name, argc, argv, options, ROW_SET, &machine);
    if (result == STATUS_OK)
        result = machine_print(&machine, stdout);
    return (int)result;
}
