// What the replay in order of arrival needs is set up here, and freed again.
#include "arrival.h"

#include <stdlib.h>
#include <string.h>

static const uint64_t DEFAULT_MEMORY = 4ull << 30;

static status refuse_memory(const arrival *a)
{
    return report_error(a->report, STATUS_IO, "out of memory: planes in order of arrival");
}

static const uint32_t *contents(void *user, int plane, uint32_t tile)
{
    skip_catch_up(user, tile);
    return arrival_plane(user, plane, tile);
}

static void describe_frame(arrival *a)
{
    const tiling *t = &a->tiling;
    a->frame = (frame){.width = t->image_width, .height = t->image_height, .samples = t->samples, .tile_width = t->tile_width,
                       .tile_height = t->tile_height, .columns = t->columns, .rows = t->rows, .tile_count = t->tile_count,
                       .quad_corners = t->quad_corners,
                       .plane_count = a->program->plane_count, .draw_count = trace_get_info(a->stamps->trace)->draw_count,
                       .contents = contents, .user = a};
    for (int i = 0; i < a->program->plane_count; i++) {
        memcpy(a->frame.plane_names[i], a->program->planes[i].name, NAME_SIZE);
        a->frame.plane_formats[i] = bound_plane_format(a->bound, i);
        a->frame.plane_bits[i] = format_table[a->frame.plane_formats[i]].bits;
    }
}

static stamp_request stamps_wanted(const program *program, const bound_program *bound, const machine *machine, const arrival_options *options)
{
    const uint32_t lists = list_depth_formats(program, bound);
    return (stamp_request){
        .depth_formats = bound_depth_formats(bound) | lists,
        .range_format = machine->depth_format,
        .color = lists || bound_reads(bound, SOURCE_FRAGMENT_COLOR) || bound_reads(bound, SOURCE_FRAGMENT_PREMUL),
        .primitive = bound_reads(bound, SOURCE_PRIMITIVE),
        .memory_bytes = options->memory_bytes ? options->memory_bytes : DEFAULT_MEMORY,
        .tiles = options->tiles,
        .region_pixels = options->region_pixels,
        .blocks = options->sampling && !options->region_pixels,
    };
}

static status find_request(const program *program, const machine *machine, const trace *trace, const arrival_options *options,
                           const report *report, stamp_request *request)
{
    const trace_info *info = trace_get_info(trace);
    rop_limits limits;
    bound_program *bound;
    machine_limits(machine, &limits);
    const status status = bind_program(program, &limits, info->reversed_depth, info->background, report, &bound);
    if (status != STATUS_OK)
        return status;
    *request = stamps_wanted(program, bound, machine, options);
    bound_destroy(bound);
    return STATUS_OK;
}

status stamps_read(const program *program, const machine *machine, trace *trace, const arrival_options *options, const report *report,
                   stamps **stamps)
{
    stamp_request request;
    *stamps = NULL;
    const status status = find_request(program, machine, trace, options, report, &request);
    return status == STATUS_OK ? stamps_make(trace, &request, report, stamps) : status;
}

bool stamps_fit(const stamps *stamps, const program *program, const machine *machine, const trace *trace, const arrival_options *options)
{
    const stamp_request *made = &stamps->request;
    stamp_request wanted;
    return stamps->trace == trace && find_request(program, machine, trace, options, NULL, &wanted) == STATUS_OK &&
           made->depth_formats == wanted.depth_formats && made->range_format == wanted.range_format && made->color == wanted.color &&
           made->primitive == wanted.primitive && made->memory_bytes == wanted.memory_bytes && made->tiles == wanted.tiles &&
           made->region_pixels == wanted.region_pixels && made->blocks == wanted.blocks;
}

static status take_stamps(arrival *a, trace *trace)
{
    a->stamps = a->options.stamps;
    a->owns_stamps = !a->stamps;
    if (!a->owns_stamps)
        return STATUS_OK;
    const stamp_request request = stamps_wanted(a->program, a->bound, a->machine, &a->options);
    return stamps_make(trace, &request, a->report, &a->stamps);
}

static status make_planes(arrival *a)
{
    const uint32_t tiles = a->tiling.tile_count;
    a->storage_of_tile = malloc((size_t)tiles * sizeof *a->storage_of_tile);
    if (!a->storage_of_tile)
        return refuse_memory(a);
    for (uint32_t t = 0; t < tiles; t++)
        a->storage_of_tile[t] = a->stamps->touched[t] ? a->storage_count++ : UINT32_MAX;
    const size_t tile_bytes = (size_t)a->plan.tile_words * sizeof(uint32_t);
    a->storage = storage_make((size_t)a->storage_count * a->plan.tile_words);
    a->empty_storage = storage_make(a->plan.tile_words);
    a->empty_before = malloc(tile_bytes + 1);
    a->ranges = calloc(tiles, sizeof *a->ranges);
    a->counts = calloc((size_t)a->plan.count_total + 1, sizeof *a->counts);
    a->log = calloc(2 * WORD_MAX, sizeof *a->log);
    a->pack.words = storage_make(a->plan.tile_words);
    for (int i = 0; i < a->program->plane_count; i++)
        a->pack.planes[i] = a->pack.words + a->plan.plane_offset[i];
    a->lanes_of_columns = aligned_alloc(64, COLUMNS_MAX * TILE_LANES * sizeof *a->lanes_of_columns);
    const bool good = a->storage && a->empty_storage && a->empty_before && a->ranges && a->counts && a->log && a->pack.words && a->lanes_of_columns;
    if (good)
        memset(a->lanes_of_columns, 0, COLUMNS_MAX * TILE_LANES * sizeof *a->lanes_of_columns);
    return good ? STATUS_OK : refuse_memory(a);
}

// Blocks in order of regions, and by rows within each.
static status order_frame(arrival *a)
{
    const uint32_t tiles = a->tiling.tile_count;
    const uint32_t regions = stamps_region(a->stamps, tiles - 1) + 1;
    uint32_t *starts = calloc((size_t)regions + 1, sizeof *starts);
    a->frame_order = malloc((size_t)tiles * sizeof *a->frame_order);
    if (starts && a->frame_order) {
        for (uint32_t t = 0; t < tiles; t++)
            starts[stamps_region(a->stamps, t) + 1]++;
        for (uint32_t r = 0; r < regions; r++)
            starts[r + 1] += starts[r];
        for (uint32_t t = 0; t < tiles; t++)
            a->frame_order[starts[stamps_region(a->stamps, t)]++] = t;
    }
    free(starts);
    return starts && a->frame_order ? STATUS_OK : refuse_memory(a);
}

status arrival_create(const program *program, const machine *machine, trace *trace, const run_result *function,
                      const arrival_options *options, const report *report, arrival **result)
{
    const trace_info *info = trace_get_info(trace);
    arrival *a = calloc(1, sizeof *a);
    *result = NULL;
    if (!a)
        return report_error(report, STATUS_IO, "out of memory");
    a->program = program;
    a->machine = machine;
    a->function = function;
    a->report = report;
    a->options = *options;
    machine_limits(machine, &a->limits);
    tiling_init(&a->tiling, info);
    status status = bind_program(program, &a->limits, info->reversed_depth, info->background, report, &a->bound);
    if (status == STATUS_OK)
        status = plan_make(&a->plan, program, a->bound, report);
    if (status == STATUS_OK && !(a->execute = execute_select(options->vector_bytes)))
        status = report_error(report, STATUS_USAGE, "vectors of %d bytes: this processor or build has none", options->vector_bytes);
    if (status == STATUS_OK)
        status = kernel_use_find(program, a->bound, machine, report, a->uses);
    if (status == STATUS_OK)
        status = take_stamps(a, trace);
    if (status == STATUS_OK)
        status = make_planes(a);
    if (status == STATUS_OK && options->sampling)
        status = skip_make(a);
    if (status == STATUS_OK && options->sampling)
        status = warm_make(a);
    if (status == STATUS_OK && options->region_pixels)
        status = order_frame(a);
    if (status == STATUS_OK)
        describe_frame(a);
    if (status == STATUS_OK)
        *result = a;
    else
        arrival_destroy(a);
    return status;
}

void arrival_destroy(arrival *a)
{
    if (!a)
        return;
    for (int k = 0; k < KERNEL_MAX; k++)
        free(a->uses[k].accesses);
    bound_destroy(a->bound);
    if (a->owns_stamps)
        stamps_destroy(a->stamps);
    free(a->storage_of_tile);
    free(a->storage);
    free(a->empty_storage);
    free(a->empty_before);
    free(a->frame_order);
    free(a->counts);
    free(a->log);
    free(a->lanes_of_columns);
    free(a->pack.words);
    free(a->entries);
    free(a->ranges);
    skip_free(a);
    warm_free(a);
    free(a);
}

const frame *arrival_frame(const arrival *a)
{
    return &a->frame;
}
