// The order as lines for other programs, and what it took as lines for people.
#include "order.h"

#include <inttypes.h>

status order_write(const order_result *result, const char *path, const report *report)
{
    aside *aside = NULL;
    FILE *file = NULL;
    const status status = aside_open(path, report, &aside, &file);
    if (status != STATUS_OK)
        return status;
    for (uint64_t i = 0; i < result->place_counts[PLACE_LAYER]; i++) {
        const order_primitive *p = &result->primitives[i];
        fprintf(file, "%" PRIu32 " %" PRIu32, p->primitive, p->layer);
        if (result->several_draws)
            fprintf(file, " %" PRIu32, p->draw);
        putc('\n', file);
    }
    return aside_finish(aside);  // also notices what could not be written
}

// The first of the primitives of that place, as `7` or, where numbers are not unique, `7 of draw 2`.
static void print_some(const order_result *result, order_place place, FILE *out)
{
    enum { SHOWN = 10 };
    uint64_t at = 0;
    for (order_place before = PLACE_LAYER; before < place; before++)
        at += result->place_counts[before];
    const uint64_t count = result->place_counts[place], shown = count < SHOWN ? count : SHOWN;
    for (uint64_t i = 0; i < shown; i++) {
        const order_primitive *p = &result->primitives[at + i];
        fprintf(out, "%s%" PRIu32, i ? ", " : ": ", p->primitive);
        if (result->several_draws)
            fprintf(out, " of draw %" PRIu32, p->draw);
    }
    fprintf(out, "%s\n", shown < count ? ", ..." : "");
}

static void print_place(const order_result *result, order_place place, const char *what, FILE *out)
{
    fprintf(out, "  %-25s %" PRIu64, what, result->place_counts[place]);
    print_some(result, place, out);
}

static void print_counts(const char *what, order_counts counts, FILE *out)
{
    fprintf(out, "  %-25s %" PRIu64 " bytes read back, %" PRIu64 " samples scanned\n", what, counts.bytes_read,
            counts.samples_scanned);
}

status order_print(const order_result *result, FILE *out)
{
    fprintf(out, "primitives                  %" PRIu64 "\n", result->primitive_count);
    fprintf(out, "  %-25s %" PRIu64 " in %" PRIu32 " layers\n", "in order", result->place_counts[PLACE_LAYER],
            result->layer_count);
    print_place(result, PLACE_CYCLE, "on a cycle", out);
    print_place(result, PLACE_BEHIND, "behind a cycle", out);
    print_place(result, PLACE_NOWHERE, "without a fragment", out);
    if (result->nowhere_unnamed)
        fprintf(out, "  %-25s %" PRIu64 " more, which cannot be named\n", "", result->nowhere_unnamed);
    fprintf(out,
            "passes                      %" PRIu64 " item buffer, %" PRIu64 " depth complexity (at most %" PRIu64
            " a layer)\n",
            result->item_passes, result->complexity_passes, result->complexity_passes_most);
    fprintf(out, "  %-25s %" PRIu64 " replayed, of %" PRIu64 " in the trace\n", "fragments", result->fragments_replayed,
            result->fragments);
    print_counts("whole image", result->whole, out);
    if (result->block_pixels) {
        char what[NAME_SIZE];
        snprintf(what, sizeof what, "%" PRIu32 " x %" PRIu32 " blocks", result->block_pixels, result->block_pixels);
        print_counts(what, result->blocks, out);
    }
    fprintf(out, "against the trace's depths  %" PRIu64 " of %" PRIu64 " neighbours out of order\n",
            result->pairs_wrong, result->pairs);
    fprintf(out, "seconds                     %.3f\n", result->wall_seconds);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
