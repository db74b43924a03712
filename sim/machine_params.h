// The rows of params.def at run time: a key of a machine as text, its bounds, its place in `machine`.
// Shared by the machine's reader, printer and hash; nobody else needs it.
#ifndef ROPSIM_MACHINE_PARAMS_H
#define ROPSIM_MACHINE_PARAMS_H

#include "sim.h"

typedef enum param_kind {
    PARAM_KIND_INT,
    PARAM_KIND_BOOL,
    PARAM_KIND_FORMAT,
    PARAM_KIND_CHOICE,
    PARAM_KIND_SET
} param_kind;
typedef enum param_table_name { PARAM_TABLE_formats, PARAM_TABLE_opcodes } param_table_name;

typedef struct param_row {
    const char *key;
    param_kind kind;
    size_t offset;           // of the field in `machine`
    int64_t min, max;        // INT
    const char *unit;        // INT
    format_class class;      // FORMAT
    const char *words;       // CHOICE: separated by spaces
    param_table_name table;  // SET
    const char *meaning;
} param_row;

enum { PARAM_TEXT_SIZE = 1024 };  // fits every value, list of accepted words and reason

extern const param_row param_rows[];
extern const int param_count;

// The row of a key, or NULL.
const param_row *param_find(const char *key);
// The key that was perhaps meant, or NULL.
const char *param_nearest(const char *key);

// Reads a value as --set and machine files write it. False: `why` says what is wrong, what is accepted
// and what was perhaps meant, and the machine is as it was.
bool param_read(const param_row *row, const char *text, machine *machine, char why[PARAM_TEXT_SIZE]);
// Adds one element to a SET, which a caller empties first by param_empty.
bool param_add(const param_row *row, const char *element, machine *machine, char why[PARAM_TEXT_SIZE]);
void param_empty(const param_row *row, machine *machine);

// The value as machine files write it, and what the key accepts.
void param_write(const param_row *row, const machine *machine, char text[PARAM_TEXT_SIZE]);
void param_accepted(const param_row *row, char text[PARAM_TEXT_SIZE]);

#endif
