// Memory for planes. Large ones ask for large pages: what visits blocks in the order of a mesh's triangles would miss the
// processor's table of pages at every other block.
#include "replay.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

uint32_t *storage_make(size_t words)
{
    enum { LARGE_PAGE = 2 << 20, LINE = 64 };
    const size_t bytes = words ? words * sizeof(uint32_t) : LINE, unit = bytes >= 2 * LARGE_PAGE ? LARGE_PAGE : LINE;
    const size_t whole = (bytes + unit - 1) / unit * unit;
    uint32_t *storage = aligned_alloc(unit, whole);
    if (!storage)
        return NULL;
#ifdef MADV_HUGEPAGE
    if (unit == LARGE_PAGE)
        madvise(storage, whole, MADV_HUGEPAGE);  // a wish: without it all is the same, only slower
#endif
    memset(storage, 0, whole);
    return storage;
}
