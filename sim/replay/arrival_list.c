// An A-buffer in order of arrival: each sample's list is appended to in one geometry pass; one full-screen pass reads it,
// sorts it and blends it.
//
// Charged as a kernel of one slot a quad that appends; at the end, of the longest list of each quad: a slot an entry to read,
// one to blend, and one for each step of a merge sort.
#include "arrival.h"

#include <stdlib.h>
#include <string.h>

static uint32_t entry_bytes(const arrival *a, const step *step)
{
    const format depth = bound_plane_format(a->bound, step->source), color = bound_plane_format(a->bound, step->plane);
    return (uint32_t)(format_table[depth].bits + format_table[color].bits) / 8;
}

static bool keep(arrival *a, uint64_t place, uint32_t code, const stamp_chunk *chunk, uint64_t at)
{
    if (a->entry_count == a->entry_capacity) {
        const uint64_t capacity = a->entry_capacity ? 2 * a->entry_capacity : 65536;
        list_entry *grown = realloc(a->entries, capacity * sizeof *grown);
        if (!grown)
            return false;
        a->entries = grown;
        a->entry_capacity = capacity;
    }
    list_entry *entry = &a->entries[a->entry_count++];
    *entry = (list_entry){.place = place, .order = a->entry_count, .code = code};
    for (int c = 0; c < 4; c++)
        entry->rgba[c] = chunk->rgba[c][at];
    return true;
}

static status append_stamp(arrival *a, const step *step, const stamp_chunk *chunk, const stamp_record *record)
{
    const uint32_t *codes = chunk->codes[bound_plane_format(a->bound, step->source)];
    const uint32_t *before = arrival_plane(a, a->plane_at[step->source], record->tile);
    stamp stamp = {.tile = record->tile, .draw = record->draw, .begins_primitive = record->begins_primitive,
                   .lanes = record->lanes, .shaded = record->lanes, .alive = record->lanes,
                   .passed = record->lanes, .accesses = a->accesses, .access_count = 1};
    uint32_t kept = 0;
    for (uint64_t left = record->lanes; left; left &= left - 1) {
        const uint32_t lane = (uint32_t)__builtin_ctzll(left);
        const uint64_t at = stamp_place_of(chunk, record, lane);
        const uint32_t code = codes[at];
        const uint64_t place = (uint64_t)record->tile * TILE_LANES + lane;
        if (code == 0 || code >= before[lane])  // on the near plane, or behind what is opaque
            continue;
        if (a->list_lengths[place] >= step->entries)
            continue;
        a->list_lengths[place]++;
        kept++;
        if (!keep(a, place, code, chunk, at))
            return report_error(a->report, STATUS_IO, "out of memory: lists of fragments");
    }
    stamp.quads = stamp.quads_shaded = stamp.quads_passed = quads_of(a, record->lanes);
    stamp.kernel_slots = stamp.quads;
    stamp.list_bytes = kept * entry_bytes(a, step);
    a->accesses[0] = (plane_access){a->plane_at[step->source], ACCESS_DEPTH, record->lanes, 0};
    return a->sink->stamp(a->sink->user, &stamp);
}

static int by_sample_and_depth(const void *a, const void *b)
{
    const list_entry *x = a, *y = b;
    if (x->place != y->place)
        return x->place < y->place ? -1 : 1;
    if (x->code != y->code)
        return x->code < y->code ? -1 : 1;
    return x->order < y->order ? -1 : 1;
}

// Blends the entries of a block's samples, in float, rounded once at the end.
static uint64_t blend_block(arrival *a, const step *step, uint32_t tile, const list_entry **entry, const list_entry *end)
{
    float *const plane = (float *)(void *)arrival_plane(a, a->plane_at[step->plane], tile);
    const format format = bound_plane_format(a->bound, step->plane);
    uint64_t lanes = 0;
    while (*entry < end && (*entry)->place / TILE_LANES == tile) {
        const uint64_t place = (*entry)->place;
        const uint32_t lane = (uint32_t)(place % TILE_LANES);
        float color[4], blended[4];
        for (int c = 0; c < 4; c++)
            color[c] = plane[c * TILE_LANES + lane];
        for (; *entry < end && (*entry)->place == place; ++*entry) {
            const float *rgba = (*entry)->rgba;
            const float source[4] = {rgba[0] * rgba[3], rgba[1] * rgba[3], rgba[2] * rgba[3], rgba[3]};
            blend_color(&a->program->blends[step->kernel], source, color, blended);
            memcpy(color, blended, sizeof blended);
        }
        for (int c = 0; c < 4; c++)
            plane[c * TILE_LANES + lane] = format_round_component(format, color[c]);
        lanes |= 1ull << lane;
    }
    return lanes;
}

// A quad works as long as the longest list of its samples: n entries to read and blend, n log2 n steps to sort.
static uint32_t resolve_slots(const arrival *a, uint32_t tile)
{
    const tiling *t = &a->tiling;
    uint32_t slots = 0;
    for (uint32_t y = 0; y < t->tile_height; y += 2) {
        for (uint32_t x = 0; x < t->tile_width; x += 2) {
            uint32_t most = 0, log = 0;
            for (uint32_t i = 0; i < 4 * t->samples; i++) {
                const uint32_t pixel = i / t->samples, px = x + (pixel & 1), py = y + (pixel >> 1);
                const uint32_t length = a->list_lengths[(uint64_t)tile * TILE_LANES + ((py << t->shift_x) + px) * t->samples + i % t->samples];
                most = length > most ? length : most;
            }
            while (1u << log < most)
                log++;
            slots += most * (2 + log);
        }
    }
    return slots;
}

static status resolve(arrival *a, const step *step)
{
    const kernel_use use = {.free_kernel = true};
    status status = begin_pass(a, PASS_FULLSCREEN, "resolve", true, step, &use);
    a->plan_of_phases.whole = true;  // entries are gone through in order
    const list_entry *entry = a->entries, *end = a->entries + a->entry_count;
    if (a->entry_count)
        qsort(a->entries, a->entry_count, sizeof *a->entries, by_sample_and_depth);
    for (uint32_t tile = 0; status == STATUS_OK && tile < a->tiling.tile_count; tile++) {
        const list_entry *first = entry;
        const uint64_t lanes = blend_block(a, step, tile, &entry, end), valid = tiling_valid_lanes(&a->tiling, tile);
        stamp stamp = {.tile = tile, .draw = UINT32_MAX, .lanes = valid, .shaded = valid, .alive = valid, .passed = valid,
                       .accesses = a->accesses, .access_count = lanes ? 1 : 0};
        if (a->options.tiles && !a->options.tiles[tile])
            continue;
        stamp.quads = stamp.quads_shaded = stamp.quads_passed = quads_of(a, valid);
        stamp.list_bytes = (uint32_t)(entry - first) * entry_bytes(a, step);
        stamp.kernel_slots = resolve_slots(a, tile);
        a->accesses[0] = (plane_access){a->plane_at[step->plane], ACCESS_COLOR, lanes, lanes};
        stamp_phase phase;
        status = phases_next(a, false, &phase);
        if (status == STATUS_OK)
            status = a->sink->stamp(a->sink->user, &stamp);
    }
    return status == STATUS_OK ? a->sink->end_pass(a->sink->user) : status;
}

status arrival_list(arrival *a, const step *step)
{
    const kernel_use use = {.free_kernel = true, .shader_operations = (uint32_t)a->machine->shader_operations_per_fragment};
    a->entry_count = 0;
    a->list_lengths = calloc((size_t)a->tiling.tile_count * TILE_LANES, sizeof *a->list_lengths);
    if (!a->list_lengths)
        return report_error(a->report, STATUS_IO, "out of memory: lists of fragments");
    status status = begin_pass(a, PASS_DRAW, "list", true, step, &use);
    a->plan_of_phases.whole = true;  // it is no kernel that could be run without being looked at
    if (status == STATUS_OK)
        status = each_stamp(a, step, append_stamp);
    if (status == STATUS_OK)
        status = a->sink->end_pass(a->sink->user);
    if (status == STATUS_OK)
        status = resolve(a, step);
    free(a->list_lengths);
    a->list_lengths = NULL;
    return status;
}
