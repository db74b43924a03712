// The command: finds the sub-command, runs it, exits with its status. The only place that prints messages.
#include "command.h"

#include <string.h>
#include <time.h>
#include <unistd.h>

typedef struct command_row {
    const char *name, *arguments, *summary;
    int (*run)(int argc, char **argv);
} command_row;

static const command_row commands[] = {
#define COMMAND(name, arguments, summary) {#name, arguments, summary, command_##name},
#include "commands.def"
#undef COMMAND
};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

// What the progress line and messages need to remember between two calls.
typedef struct progress_line {
    bool wanted, visible, silent;
    struct timespec last;
} progress_line;

static void erase_progress(progress_line *line)
{
    if (line->visible)
        fputs("\r\033[K", stderr);
    line->visible = false;
}

static void say(void *user, severity severity, const char *text)
{
    static const char *const titles[] = {"error: ", "warning: ", ""};
    progress_line *line = user;
    if (line->silent)
        return;
    erase_progress(line);
    fprintf(stderr, "ropsim: %s%s\n", titles[severity], text);
}

static void show_progress(void *user, const char *what, uint64_t done, uint64_t total)
{
    progress_line *line = user;
    struct timespec now;
    if (!line->wanted)
        return;
    if (done >= total) {
        erase_progress(line);
        return;
    }
    clock_gettime(CLOCK_MONOTONIC, &now);
    long milliseconds = (now.tv_sec - line->last.tv_sec) * 1000 + (now.tv_nsec - line->last.tv_nsec) / 1000000;
    if (milliseconds < 100)  // faster than this nobody reads
        return;
    line->last = now;
    fprintf(stderr, "\r\033[K%s: %3.0f %%", what, 100.0 * (double)done / (double)total);
    fflush(stderr);
    line->visible = true;
}

static progress_line progress;
const report command_report = {.say = say, .progress = show_progress, .user = &progress};

// Only ours: what libraries have to say on stderr stays.
bool command_silence(void)
{
    progress.silent = true;
    progress.wanted = false;
    return freopen("/dev/null", "w", stdout) != NULL;
}

static void print_help(FILE *out)
{
    fputs("ropsim: a simulator of a rasterizer whose ROP is programmable\n\n"
          "usage: ropsim [--progress] COMMAND ...\n\n",
          out);
    for (int i = 0; i < COMMAND_COUNT; i++)
        fprintf(out, "  %-9s %s\n", commands[i].name, commands[i].summary);
    fputs("\n  --help, --version, and `ropsim COMMAND --help` for options, defaults and units\n"
          "  --progress    show progress although stderr is not a terminal\n\n"
          "Exit codes: 0 done, 1 the input was refused or a check failed, 2 usage, 3 input or output failed.\n",
          out);
}

static status refuse_command(const char *name)
{
    const char *names[COMMAND_COUNT];
    for (int i = 0; i < COMMAND_COUNT; i++)
        names[i] = commands[i].name;
    const char *meant = nearest_word(name, names, COMMAND_COUNT);
    return report_error(&command_report, STATUS_USAGE, "there is no command `%s`; %s%s%s`ropsim --help` lists all",
                        name, meant ? "did you mean `" : "", meant ? meant : "", meant ? "`? " : "");
}

// A result that did not reach stdout (a full disk, a closed pipe) is a failure, whatever the command thinks.
static int finish_output(int result)
{
    bool lost = fflush(stdout) != 0 || ferror(stdout);
    if (lost && result == STATUS_OK)
        return (int)report_error(&command_report, STATUS_IO, "standard output cannot be written");
    return result;
}

int main(int argc, char **argv)
{
    int first = 1;
    progress.wanted = isatty(STDERR_FILENO);
    for (; first < argc && strcmp(argv[first], "--progress") == 0; first++)
        progress.wanted = true;
    if (first >= argc) {
        print_help(stderr);
        return STATUS_USAGE;
    }
    const char *name = argv[first];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        print_help(stdout);
        return finish_output(STATUS_OK);
    }
    if (strcmp(name, "--version") == 0) {
        puts("ropsim " ROPSIM_VERSION);
        return finish_output(STATUS_OK);
    }
    for (int i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(commands[i].name, name) == 0) {
            int result = finish_output(commands[i].run(argc - first, argv + first));
            erase_progress(&progress);
            return result;
        }
    }
    return (int)refuse_command(name);
}
