// `ropsim verify`: whether a program runs on a machine and if not, why not; or a table of programs and machines.
#include "command.h"

#include <string.h>

enum { ROW_MACHINE, ROW_SET };
static const command_option options[] = {
    [ROW_MACHINE] = {"machine", 0, "NAME|FILE",
                     "shipped machine or .yaml file; without it: a table of all shipped machines"},
    [ROW_SET] = {"set", 0, "KEY=VALUE", "change one key of the machine, in a table of each; may be repeated"},
    {0},
};

enum { PATH_SIZE = 4096, NAMES_MAX = 128, MACHINES_MAX = 16 };

static status verify_one(const char *name, const machine *machine)
{
    char path[PATH_SIZE];
    program *program = NULL;
    rop_limits limits;
    status status = program_load(name, &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    machine_limits(machine, &limits);
    status = verify_program(program, path, &limits, &command_report);
    if (status == STATUS_OK)
        printf("%s runs on %s\n", program->name, machine->name);
    program_destroy(program);
    return status;
}

static status print_row(const char *name, const machine *machines, int machine_count)
{
    char path[PATH_SIZE];
    program *program = NULL;
    status status = program_load(name, &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    printf("| %s |", program->name);
    for (int i = 0; i < machine_count; i++) {
        rop_limits limits;
        machine_limits(&machines[i], &limits);
        printf(" %s |", verify_program(program, path, &limits, NULL) == STATUS_OK ? "runs" : "no");
    }
    putchar('\n');
    program_destroy(program);
    return STATUS_OK;
}

// One program, or all that are shipped, against all shipped machines.
static status print_table(const char *name, int argc, char **argv)
{
    char machine_names[MACHINES_MAX][NAME_SIZE], program_names[NAMES_MAX][NAME_SIZE];
    machine machines[MACHINES_MAX];
    const int machine_count = data_names("machines", ".yaml", machine_names, MACHINES_MAX);
    const int program_count = name ? 1 : data_names("programs", ".rop", program_names, NAMES_MAX);
    if (machine_count == 0 || program_count == 0)
        return report_error(&command_report, STATUS_IO,
                            "no programs or machines found; ROPSIM_DATA may name the parent of their folders");
    for (int i = 0; i < machine_count; i++) {
        status status = command_find_machine(machine_names[i], argc, argv, options, ROW_SET, &machines[i]);
        if (status != STATUS_OK)
            return status;
    }
    printf("| program |");
    for (int i = 0; i < machine_count; i++)
        printf(" %s |", machine_names[i]);
    printf("\n|---|");
    for (int i = 0; i < machine_count; i++)
        printf("---|");
    putchar('\n');
    status result = STATUS_OK;
    for (int i = 0; i < program_count; i++) {
        status status = print_row(name ? name : program_names[i], machines, machine_count);
        result = result == STATUS_OK ? status : result;
    }
    return result;
}

int command_verify(int argc, char **argv)
{
    const char *name = NULL, *machine_name = NULL;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        switch (option) {
        case COMMAND_HELP: return STATUS_OK;
        case COMMAND_ERROR: return STATUS_USAGE;
        case COMMAND_OPERAND:
            if (name)
                return (int)command_usage("verify", "one program at a time");
            name = line.value;
            break;
        case ROW_MACHINE: machine_name = line.value; break;
        default: break;
        }
    }
    if (!machine_name)
        return (int)print_table(name, argc, argv);
    if (!name)
        return (int)command_usage("verify", "a program is wanted");
    machine machine;
    status status = command_find_machine(machine_name, argc, argv, options, ROW_SET, &machine);
    return status == STATUS_OK ? (int)verify_one(name, &machine) : (int)status;
}
