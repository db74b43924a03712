// The two forms of a trace behind one reader and one writer: what binary and text must each provide.
#ifndef ROPSIM_TRACE_FORM_H
#define ROPSIM_TRACE_FORM_H

#include "block.h"

// A reader of one form. `info` is filled when it is opened; draws are freed by trace_close.
typedef struct trace_form {
    status (*next)(void *self, fragments *fragments);
    status (*rewind)(void *self);
    void (*select)(void *self, const bounds *region);
    void (*places)(void *self, bool only);  // NULL: always whole fragments
    void (*close)(void *self);
} trace_form;

typedef struct opened {
    const trace_form *form;
    void *self;
} opened;

// Both take over the descriptor, also on failure.
status binary_open(const char *path, int descriptor, const report *report, trace_info *info, opened *opened);
status text_open(const char *path, int descriptor, const report *report, trace_info *info, opened *opened);
// False: memory ran out.
bool source_open(const trace_source *source, opened *opened);

// A writer of one form: draws come in order, blocks between begin_draw and end_draw, all checked and counted already.
typedef struct writer_form {
    bool (*begin_draw)(void *self, const trace_draw *draw);
    bool (*block)(void *self, const block *block, const uint8_t digest[DIGEST_BYTES]);
    bool (*end_draw)(void *self, const trace_draw *draw);
    bool (*finish)(void *self, const uint8_t hash[DIGEST_BYTES]);
    void (*destroy)(void *self);
} writer_form;

typedef struct created {
    const writer_form *form;
    void *self;
} created;

// Write the header to `file`. False: memory ran out.
bool binary_create(FILE *file, const trace_info *info, created *created);
bool text_create(FILE *file, const trace_info *info, created *created);

#endif
