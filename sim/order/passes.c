// The two ROP programs of the ordering, loaded once and run over changing subsets; their planes are what is read back.
#include "order.h"

#include <string.h>

enum { ID_BYTES = 4, STENCIL_BYTES = 1, PATH_SIZE = 4096 };

static const char *const program_names[PASS_COUNT] = {"item_buffer", "depth_complexity"};

static int find_plane(const program *program, const char *name)
{
    for (int i = 0; i < program->plane_count; i++)
        if (strcmp(program->planes[i].name, name) == 0)
            return i;
    return -1;
}

static status load_one(passes *p, pass pass, const rop_limits *limits, const report *report)
{
    char path[PATH_SIZE];
    status status = program_load(program_names[pass], report, path, sizeof path, &p->programs[pass]);
    if (status == STATUS_OK)
        status = verify_program(p->programs[pass], path, limits, report);
    if (status != STATUS_OK)
        return status;
    p->item_plane[pass] = find_plane(p->programs[pass], "item");
    if (pass == PASS_COMPLEXITY)
        p->count_plane = find_plane(p->programs[pass], "count");
    // A folder of programs given by the environment may hold others of that name.
    if (p->item_plane[pass] < 0 || p->count_plane < 0)
        return report_error(report, STATUS_REFUSED, "%s: has no plane 'item' or 'count' to read back", path);
    return STATUS_OK;
}

status passes_load(const machine *machine, int threads, const report *report, passes *p)
{
    *p = (passes){.machine = machine, .options = {.threads = threads, .occlusion_ratio = -1, .keep_planes = true}};
    rop_limits limits;
    machine_limits(machine, &limits);
    if (limits.stencil_bits < 2)
        return report_error(report, STATUS_REFUSED, "machine %s: a stencil of 1 bit cannot tell one fragment from two",
                            limits.machine);
    status status = STATUS_OK;
    for (pass pass = PASS_ITEM; pass < PASS_COUNT && status == STATUS_OK; pass++)
        status = load_one(p, pass, &limits, report);
    if (status != STATUS_OK)
        passes_free(p);
    return status;
}

void passes_free(passes *p)
{
    for (int i = 0; i < PASS_COUNT; i++) {
        program_destroy(p->programs[i]);
        p->programs[i] = NULL;
    }
}

status pass_run(const passes *p, pass pass, trace *trace, const report *report, readback *readback)
{
    memset(readback, 0, sizeof *readback);
    const status status = replay_run(p->programs[pass], p->machine, trace, &p->options, report, &readback->result);
    if (status != STATUS_OK)
        return status;
    readback->item = readback->result->plane_values[p->item_plane[pass]];
    if (pass == PASS_COMPLEXITY)
        readback->count = readback->result->plane_values[p->count_plane];
    return STATUS_OK;
}

uint64_t pass_sample_bytes(pass pass)
{
    return pass == PASS_ITEM ? ID_BYTES : ID_BYTES + STENCIL_BYTES;
}
