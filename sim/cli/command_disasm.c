// `ropsim disasm`: a program, in words or as text, to canonical text; on request with passes lowered to instructions.
#include "command.h"

enum { ROW_LOWERED, ROW_MACHINE, ROW_SET };
static const command_option options[] = {
    [ROW_LOWERED] = {"lowered", 0, NULL, "print each pass as the instructions that it stands for on the machine"},
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE",
                     "for --lowered: shipped machine or .yaml file; default " COMMAND_DEFAULT_MACHINE},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "for --lowered: change one key of the machine; may be repeated"},
    {0},
};

static status print_lowered(const program *program, const char *path, const machine *machine)
{
    static const float background[4] = {0};
    rop_limits limits;
    bound_program *bound = NULL;
    machine_limits(machine, &limits);
    status status = verify_program(program, path, &limits, &command_report);
    if (status == STATUS_OK)
        status = bind_program(program, &limits, false, background, &command_report, &bound);
    if (status == STATUS_OK)
        status = disassemble_bound(program, bound, stdout);
    bound_destroy(bound);
    return status;
}

int command_disasm(int argc, char **argv)
{
    enum { PATH_SIZE = 4096 };
    const char *name = NULL, *machine_name = NULL;
    bool lowered = false, machine_given = false;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        switch (option) {
        case COMMAND_HELP: return STATUS_OK;
        case COMMAND_ERROR: return STATUS_USAGE;
        case COMMAND_OPERAND:
            if (name)
                return (int)command_usage("disasm", "one program at a time");
            name = line.value;
            break;
        case ROW_LOWERED: lowered = true; break;
        case ROW_MACHINE:
            machine_name = line.value;
            machine_given = true;
            break;
        default: machine_given = true; break;
        }
    }
    if (!name)
        return (int)command_usage("disasm", "a program is wanted");
    if (machine_given && !lowered)
        return (int)command_usage("disasm", "--machine and --set belong to --lowered");
    char path[PATH_SIZE];
    machine machine;
    program *program = NULL;
    status status = lowered ? command_find_machine(machine_name, argc, argv, options, ROW_SET, &machine) : STATUS_OK;
    if (status == STATUS_OK)
        status = program_load(name, &command_report, path, sizeof path, &program);
    if (status == STATUS_OK)
        status = lowered ? print_lowered(program, path, &machine) : disassemble_text(program, stdout);
    program_destroy(program);
    return (int)status;
}
