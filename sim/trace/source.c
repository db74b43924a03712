// Calls in, runs of fragments out: a trace that lives in memory, behind the interface of those that lie in files.
//
// Nothing is checked here: the caller vouches for what its calls hand out, as a file's reader vouches for the file.
#include "form.h"

#include <stdlib.h>

static status source_next(void *self, fragments *run)
{
    const trace_source *source = self;
    return source->next(source->user, run);
}

static status source_rewind(void *self)
{
    const trace_source *source = self;
    return source->rewind(source->user);
}

static void source_select(void *self, const bounds *region)
{
    (void)self;
    (void)region;  // runs outside may be left out, and need not be
}

bool source_open(const trace_source *source, opened *opened)
{
    static const trace_form form = {source_next, source_rewind, source_select, NULL, free};
    trace_source *self = malloc(sizeof *self);
    if (!self)
        return false;
    *self = *source;
    opened->form = &form;
    opened->self = self;
    return true;
}
