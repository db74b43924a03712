// `ropsim isa`: the instruction set's tables as Markdown, as they stand in docs/isa.md.
#include "command.h"

enum { ROW_OPCODES, ROW_FORMATS };
static const command_option options[] = {
    [ROW_OPCODES] = {"opcodes", 0, NULL, "every opcode with its operands, as a Markdown table"},
    [ROW_FORMATS] = {"formats", 0, NULL, "every number format, as a Markdown table"},
    {0},
};

static const char *operand_text(operand_kind kind)
{
    static const char *const texts[] = {
        "",      "r",     "c",          "r or c",       "p",    "value", "colour", "value or colour", "plane",
        "query", "blend", "r, g, b, a", "depth format", "label"};
    return texts[kind];
}

static void print_opcodes(void)
{
    static const char *const units[] = {"move", "compare", "logic", "integer", "float", "blend", "memory", "control"};
    puts("| code | opcode | d | a | b | c | unit | slots | meaning |\n|---|---|---|---|---|---|---|---|---|");
    for (int i = 0; i < OPCODE_COUNT; i++) {
        const opcode_row *row = &opcode_table[i];
        printf("| %d | `%s` | %s | %s | %s | %s | %s | %d | %s |\n", i, row->name, operand_text(row->d),
               operand_text(row->a), operand_text(row->b), operand_text(row->c), units[row->unit], row->cycles,
               row->meaning);
    }
}

static void print_formats(void)
{
    static const char *const classes[] = {"depth", "unsigned integer", "float", "colour"};
    puts("| code | format | class | bits a sample | meaning |\n|---|---|---|---|---|");
    for (int i = 0; i < FORMAT_COUNT; i++)
        printf("| %d | `%s` | %s | %d | %s |\n", i, format_table[i].name, classes[format_table[i].class],
               format_table[i].bits, format_table[i].meaning);
}

int command_isa(int argc, char **argv)
{
    bool opcodes = false, formats = false;
    command_line line = {.argc = argc, .argv = argv, .options = options};
    for (int option; (option = command_next(&line)) != COMMAND_END;) {
        if (option == COMMAND_HELP)
            return STATUS_OK;
        if (option == COMMAND_ERROR)
            return STATUS_USAGE;
        if (option == COMMAND_OPERAND)
            return (int)command_usage("isa", "it takes no operand");
        *(option == ROW_OPCODES ? &opcodes : &formats) = true;
    }
    if (opcodes || !formats)
        print_opcodes();
    if (opcodes == formats)
        putchar('\n');
    if (formats || !opcodes)
        print_formats();
    return STATUS_OK;
}
