// Program text, machine and trace to a result: what every command that replays has in common.
#include "command.h"

status command_load_program(const char *name, const machine *machine, program **program)
{
    enum { PATH_SIZE = 4096 };
    char path[PATH_SIZE];
    rop_limits limits;
    *program = NULL;
    status status = program_load(name, &command_report, path, sizeof path, program);
    if (status != STATUS_OK)
        return status;
    machine_limits(machine, &limits);
    status = verify_program(*program, path, &limits, &command_report);
    if (status != STATUS_OK) {
        program_destroy(*program);
        *program = NULL;
    }
    return status;
}

status command_replay(const char *name, const machine *machine, trace *trace, const run_options *options,
                      run_result **result)
{
    program *program = NULL;
    *result = NULL;
    status status = command_load_program(name, machine, &program);
    if (status == STATUS_OK)
        status = replay_run(program, machine, trace, options, &command_report, result);
    program_destroy(program);
    return status;
}
