// A run's result as a short table for people.
#include "../sim.h"

#include <inttypes.h>
#include <string.h>

static void print_planes(const run_result *result, FILE *out)
{
    fprintf(out, "\n  %-20s %-8s %14s %14s %14s %14s\n", "plane", "format", "bytes read", "written", "cleared",
            "by textures");
    for (int i = 0; i < result->plane_count; i++) {
        const plane_result *plane = &result->planes[i];
        fprintf(out, "  %-20s %-8s %14" PRIu64 " %14" PRIu64 " %14" PRIu64 " %14" PRIu64 "\n", plane->name,
                format_table[plane->format].name, plane->bytes_read, plane->bytes_written, plane->bytes_cleared,
                plane->texture_bytes_read);
    }
}

static void print_error(const run_result *result, FILE *out)
{
    const error_result *error = &result->error;
    if (!result->error_known) {
        fputs("  error               not computed\n", out);
        return;
    }
    fprintf(out, "  error               %s: at most %.3g, rmse %.3g, psnr %.2f dB, %" PRIu64 " samples wrong\n",
            error->exact ? "exact" : "not exact", error->max_abs, error->rmse, error->psnr_db, error->samples_wrong);
}

status result_print(const run_result *result, FILE *out)
{
    fprintf(out, "%s on %s, %u x %u pixels, %u %s a pixel\n", result->program, result->machine, result->width,
            result->height, result->samples, result->samples == 1 ? "sample" : "samples");
    fprintf(out, "  geometry passes     %" PRIu64 " (transparent %" PRIu64 ", sorted %" PRIu64 ")\n",
            result->geometry_passes, result->passes_by_class[CLASS_TRANSPARENT], result->passes_by_class[CLASS_SORTED]);
    fprintf(out, "  full-screen passes  %" PRIu64 "\n", result->fullscreen_passes);
    fprintf(out, "  iterations          %" PRIu64 "%s\n", result->iterations,
            result->iteration_limit_reached ? ", stopped at the limit" : "");
    fprintf(out, "  fragments           %" PRIu64 " in the trace, %" PRIu64 " replayed, %" PRIu64 " composited\n",
            result->fragments_in_trace, result->fragments_replayed, result->fragments_composited);
    if (result->has_list)
        fprintf(out, "  lists               %" PRIu64 " fragments kept in %" PRIu64 " bytes, %" PRIu64 " lost\n",
                result->list_kept, result->list_kept * result->list_entry_bytes, result->list_lost);
    print_error(result, out);
    fprintf(out, "  replay              %.3f s, %.1f million fragments a second\n", result->wall_seconds,
            result->fragments_per_second / 1e6);
    print_planes(result, out);
    return ferror(out) ? STATUS_IO : STATUS_OK;
}
