// What a user calls by name: shipped programs and machines, or files by path.
#include "command.h"

#include <string.h>

status command_program_path(const char *name, char *path, size_t size)
{
    enum { PROGRAMS_MAX = 128 };
    size_t length = strlen(name);
    bool is_path = strpbrk(name, "/.") != NULL;  // no shipped program has a dot in its name
    if (is_path && length < size) {
        snprintf(path, size, "%s", name);
        return STATUS_OK;
    }
    char file[NAME_SIZE + 8], names[PROGRAMS_MAX][NAME_SIZE];
    snprintf(file, sizeof file, "%.*s.rop", NAME_SIZE - 1, name);
    if (length < NAME_SIZE && data_path("programs", file, path, size) == STATUS_OK)
        return STATUS_OK;
    const char *words[PROGRAMS_MAX];
    int count = data_names("programs", ".rop", names, PROGRAMS_MAX);
    for (int i = 0; i < count; i++)
        words[i] = names[i];
    const char *meant = nearest_word(name, words, (size_t)count);
    return report_error(&command_report, STATUS_REFUSED,
                        "no program is called `%s`%s%s%s; give a stem of programs/ or the path of a file", name,
                        meant ? "; did you mean `" : "", meant ? meant : "", meant ? "`?" : "");
}

status command_find_machine(const char *name, int argc, char **argv, const command_option *options, int set_row,
                            machine *machine)
{
    command_line line = {.argc = argc, .argv = argv, .options = options};
    status status = machine_load(name ? name : COMMAND_DEFAULT_MACHINE, &command_report, machine);
    for (int option; status == STATUS_OK && (option = command_next(&line)) != COMMAND_END;) {
        if (option == set_row)
            status = machine_set(machine, line.value, &command_report);
    }
    return status;
}
