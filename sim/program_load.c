// A program as a user names it, assembled: the stem of a shipped one or a path, then its parameters.
#include "program_file.h"

#include <string.h>
#include <sys/stat.h>

enum { PROGRAMS_MAX = 128, PARAMETERS_MAX = 16, NUMBER_SIZE = 16 };

static status find_program(const char *name, const report *report, char *path, size_t size)
{
    char file[NAME_SIZE + 8], names[PROGRAMS_MAX][NAME_SIZE];
    const size_t length = strlen(name);
    if (strpbrk(name, "/.")) {  // no shipped program has a dot in its name
        if (length >= size)
            return report_error(report, STATUS_REFUSED, "the path of a program is longer than %zu bytes", size - 1);
        memcpy(path, name, length + 1);
        return STATUS_OK;
    }
    snprintf(file, sizeof file, "%.*s.rop", NAME_SIZE - 1, name);
    if (length < NAME_SIZE && data_path("programs", file, path, size) == STATUS_OK)
        return STATUS_OK;
    struct stat found;
    if (length < size && stat(name, &found) == 0 && S_ISREG(found.st_mode)) {
        memcpy(path, name, length + 1);
        return STATUS_OK;
    }
    const char *words[PROGRAMS_MAX];
    const int count = data_names("programs", ".rop", names, PROGRAMS_MAX);
    for (int i = 0; i < count; i++)
        words[i] = names[i];
    const char *meant = nearest_word(name, words, (size_t)count);
    return report_error(report, STATUS_REFUSED,
                        "no program is called `%s`%s%s%s; give a stem of programs/ or the path of a file", name,
                        meant ? "; did you mean `" : "", meant ? meant : "", meant ? "`?" : "");
}

// NAME=VALUE, the value a decimal integer.
static bool read_parameter(const char *text, size_t length, parameter *parameter)
{
    const char *equals = memchr(text, '=', length);
    const size_t name_length = equals ? (size_t)(equals - text) : 0, digits = equals ? length - name_length - 1 : 0;
    if (!name_length || name_length >= NAME_SIZE || digits < 1 || digits > 9 || strspn(equals + 1, "0123456789") < digits)
        return false;
    memcpy(parameter->name, text, name_length);
    parameter->name[name_length] = 0;
    parameter->value = 0;
    for (size_t i = 0; i < digits; i++)
        parameter->value = 10 * parameter->value + (equals[1 + i] - '0');
    return true;
}

status program_load(const char *words, const report *report, char *path, size_t size, program **program)
{
    *program = NULL;
    parameter parameters[PARAMETERS_MAX];
    int count = 0;
    char name[4096];
    const char *comma = strchr(words, ',');
    const size_t name_length = comma ? (size_t)(comma - words) : strlen(words);
    if (name_length >= sizeof name)
        return report_error(report, STATUS_REFUSED, "the name of a program is longer than %zu bytes", sizeof name - 1);
    memcpy(name, words, name_length);
    name[name_length] = 0;
    while (comma) {
        const char *start = comma + 1;
        comma = strchr(start, ',');
        const size_t length = comma ? (size_t)(comma - start) : strlen(start);
        if (count == PARAMETERS_MAX || !read_parameter(start, length, &parameters[count]))
            return report_error(report, STATUS_REFUSED,
                                "`%.*s` is not a parameter; accepted: PROGRAM[,NAME=INTEGER...], at most %d of them",
                                (int)length, start, PARAMETERS_MAX);
        count++;
    }
    const status status = find_program(name, report, path, size);
    return status == STATUS_OK ? program_read(path, parameters, count, report, program) : status;
}
