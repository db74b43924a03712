// A line a pass; of many passes the longest, in the order in which they ran.
#include "detail_table.h"

#include <inttypes.h>

enum { PASSES_ALL = 40, PASSES_LONGEST = 10 };

// At the level traffic a pass is as long as it moves bytes.
static uint64_t pass_length(const detail_result *detail, uint64_t index)
{
    const pass_record *pass = &detail->passes[index];
    if (detail->level >= DETAIL_CYCLE)
        return pass->drained - pass->start;
    return pass->statistics.memory_bytes_read + pass->statistics.memory_bytes_written;
}

// The indices of the longest passes, rising. Of equally long ones the earlier are taken.
static int choose_longest(const detail_result *detail, uint64_t chosen[PASSES_LONGEST])
{
    int count = 0;
    for (uint64_t i = 0; i < detail->pass_count; i++) {
        int least = 0;
        for (int k = 1; k < count; k++)
            least = pass_length(detail, chosen[k]) <= pass_length(detail, chosen[least]) ? k : least;
        if (count == PASSES_LONGEST && pass_length(detail, i) <= pass_length(detail, chosen[least]))
            continue;
        if (count == PASSES_LONGEST) {
            for (int k = least; k + 1 < count; k++)
                chosen[k] = chosen[k + 1];
            count--;
        }
        chosen[count++] = i;
    }
    return count;
}

static void print_pass(const detail_result *detail, uint64_t index, FILE *out)
{
    const pass_record *pass = &detail->passes[index];
    const pass_info *info = &pass->info;
    char number[24] = "-", iteration[24] = "-";
    if (info->number > 0)
        snprintf(number, sizeof number, "%" PRIu64, info->number);
    if (info->iteration > 0)
        snprintf(iteration, sizeof iteration, "%" PRIu64, info->iteration);
    fprintf(out, "  %6s %9s  %-10s %-20s %12" PRIu64 " %12" PRIu64 " %12" PRIu64, number, iteration,
            pass_kind_names[info->kind], info->name, pass->statistics.fragments, pass->statistics.memory_bytes_read,
            pass->statistics.memory_bytes_written);
    if (detail->level >= DETAIL_CYCLE)
        fprintf(out, " %12" PRIu64 "  %s", pass_length(detail, index), clock_resource_names[pass->bound_by]);
    fputc('\n', out);
}

void detail_print_passes(const detail_result *detail, FILE *out)
{
    uint64_t longest[PASSES_LONGEST];
    const bool all = detail->pass_count <= PASSES_ALL;
    const uint64_t count = all ? detail->pass_count : (uint64_t)choose_longest(detail, longest);
    if (!all)
        fprintf(out, "\n  the %" PRIu64 " of %" PRIu64 " passes that %s", count, detail->pass_count,
                detail->level >= DETAIL_CYCLE ? "took longest" : "moved most bytes");
    fprintf(out, "\n  %6s %9s  %-10s %-20s %12s %12s %12s", "pass", "iteration", "kind", "name", "fragments",
            "bytes read", "written");
    if (detail->level >= DETAIL_CYCLE)
        fprintf(out, " %12s  %s", "cycles", "bound by");
    fputc('\n', out);
    for (uint64_t i = 0; i < count; i++)
        print_pass(detail, all ? i : longest[i], out);
}
