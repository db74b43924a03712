// The words of a sub-command by a table of options: the same table parses and prints the help.
//
// Names are never abbreviated: a script that works today must not break by an option added tomorrow.
#include "command.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { OPTIONS_MAX = 64 };

static const char *const command_texts[][3] = {
#define COMMAND(name, arguments, summary) {#name, arguments, summary},
#include "commands.def"
#undef COMMAND
    {NULL, NULL, NULL},
};

static void print_help(const command_line *line)
{
    for (int i = 0; command_texts[i][0]; i++) {
        if (strcmp(command_texts[i][0], line->argv[0]) == 0)
            printf("usage: ropsim %s %s\n\n%s\n\n", command_texts[i][0], command_texts[i][1], command_texts[i][2]);
    }
    for (const command_option *option = line->options; option->name; option++) {
        char left[NAME_SIZE];
        snprintf(left, sizeof left, "%s%c%s--%s%s%s", option->letter ? "-" : "", option->letter ? option->letter : ' ',
                 option->letter ? ", " : "   ", option->name, option->argument ? " " : "",
                 option->argument ? option->argument : "");
        printf("  %-30s %s\n", left, option->help);
    }
    printf("  %-30s %s\n", "    --help", "print this");
}

static int error_unknown(const command_line *line, const char *word)
{
    const char *names[OPTIONS_MAX];
    size_t count = 0;
    char name[NAME_SIZE];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(word + 2, "="), word + 2);
    for (const command_option *option = line->options; option->name && count < OPTIONS_MAX; option++)
        names[count++] = option->name;
    const char *meant = word[1] == '-' ? nearest_word(name, names, count) : NULL;
    report_error(&command_report, STATUS_USAGE, "%s has no option `%s`; %s%s%s`ropsim %s --help` lists all",
                 line->argv[0], word, meant ? "did you mean `--" : "", meant ? meant : "", meant ? "`? " : "",
                 line->argv[0]);
    return COMMAND_ERROR;
}

// The row that a word names; `attached` becomes a value that follows within the word, or NULL.
static const command_option *find_option(const command_line *line, const char *word, const char **attached)
{
    for (const command_option *option = line->options; option->name; option++) {
        size_t length = strlen(option->name);
        *attached = NULL;
        if (word[1] == '-' && strncmp(word + 2, option->name, length) == 0) {
            const char *rest = word + 2 + length;
            if (*rest == '=')
                *attached = rest + 1;
            if (*rest == '=' || *rest == 0)
                return option;
        } else if (word[1] != '-' && word[1] == option->letter) {
            if (word[2])
                *attached = word + 2;
            return option;
        }
    }
    return NULL;
}

int command_next(command_line *line)
{
    if (line->index + 1 >= line->argc)
        return COMMAND_END;
    const char *word = line->argv[++line->index];
    if (line->operands_only || word[0] != '-' || word[1] == 0) {
        line->value = word;
        return COMMAND_OPERAND;
    }
    if (strcmp(word, "--") == 0) {
        line->operands_only = true;
        return command_next(line);
    }
    if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        print_help(line);
        return COMMAND_HELP;
    }
    const command_option *option = find_option(line, word, &line->value);
    if (!option)
        return error_unknown(line, word);
    if (!option->argument && line->value) {
        report_error(&command_report, STATUS_USAGE, "--%s takes no value", option->name);
        return COMMAND_ERROR;
    }
    if (option->argument && !line->value) {
        if (line->index + 1 >= line->argc) {
            report_error(&command_report, STATUS_USAGE, "--%s wants %s after it: %s", option->name, option->argument,
                         option->help);
            return COMMAND_ERROR;
        }
        line->value = line->argv[++line->index];
    }
    return (int)(option - line->options);
}

bool command_uint(const char *option, const char *text, uint64_t min, uint64_t max, uint64_t *value)
{
    size_t digits = strspn(text, "0123456789");
    errno = 0;
    unsigned long long number = strtoull(text, NULL, 10);
    if (digits > 0 && !text[digits] && errno == 0 && number >= min && number <= max) {
        *value = number;
        return true;
    }
    report_error(&command_report, STATUS_USAGE, "--%s is `%s`, but must be an integer from %llu to %llu", option, text,
                 (unsigned long long)min, (unsigned long long)max);
    return false;
}

bool command_double(const char *option, const char *text, double min, double max, double *value)
{
    char *end = NULL;
    double number = strtod(text, &end);
    if (end != text && !*end && isfinite(number) && number >= min && number <= max) {
        *value = number;
        return true;
    }
    report_error(&command_report, STATUS_USAGE, "--%s is `%s`, but must be a number from %g to %g", option, text, min,
                 max);
    return false;
}

bool command_threads(const char *value, int *threads)
{
    uint64_t number = 0;
    if (!command_uint("threads", value, 0, COMMAND_THREADS_MAX, &number))
        return false;
    *threads = (int)number;
    return true;
}

bool command_memory(const char *value, uint64_t *bytes)
{
    uint64_t mebibytes = 0;
    if (!command_uint("memory", value, 1, UINT64_MAX >> 20, &mebibytes))
        return false;
    *bytes = mebibytes << 20;
    return true;
}

status command_usage(const char *command, const char *why)
{
    return report_error(&command_report, STATUS_USAGE, "%s; `ropsim %s --help` tells more", why, command);
}
