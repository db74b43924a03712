// `ropsim asm`: a program's text to words.
#include "command.h"

#include <stdlib.h>

enum { ROW_OUTPUT };
static const command_option options[] = {
    [ROW_OUTPUT] = {"output", 'o', "FILE", "the file of words; docs/isa.md says what lies where"},
    {0},
};

static status assemble(const char *name, const char *output)
{
    enum { PATH_SIZE = 4096 };
    char path[PATH_SIZE];
    program *program = NULL;
    uint32_t *words = NULL;
    size_t count = 0;
    status status = program_load(name, &command_report, path, sizeof path, &program);
    if (status != STATUS_OK)
        return status;
    status = program_encode(program, &words, &count);
    program_destroy(program);
    if (status != STATUS_OK)
        return report_error(&command_report, status, "%s: out of memory", path);
    status = program_save_words(output, words, count, &command_report);
    free(words);
    if (status == STATUS_OK)
        printf("%s: %zu words\n", output, count);
    return status;
}

int command_asm(int argc, char **argv)
{
    const char *name = NULL, *output = NULL;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == ROW_OUTPUT)
            output = line.value;
        else if (name)
            return (int)command_usage("asm", "one program at a time");
        else
            name = line.value;
    }
    if (!name || !output)
        return (int)command_usage("asm", "a program and -o FILE are wanted");
    return (int)assemble(name, output);
}
