// The algorithm of Krishnan, Silva and Wei 2001, section 3: layers of primitives, nearest first.
//
// A layer's candidates are the primitives that the item buffer of all that remain shows. The depth complexity of the
// candidates, seen from behind, shows at each sample the farthest of them, which goes back if it is not the item there.
// As printed, it goes back only where more than one candidate is left at the sample; that lets a candidate stay whose
// last cover went back itself, because of another sample. docs/order.md has the smallest case and why this rule is
// exact.
#include "order.h"

#include <stdlib.h>
#include <string.h>

// Of a primitive, in `candidate`; 0: it is none.
enum { CANDIDATE = 1, GOES_BACK = 2 };

typedef struct ordering {
    const geometry *geometry;
    const passes *passes;
    const report *report;
    blocks blocks;
    uint8_t *remains, *candidate;  // by id
    const uint8_t *set;            // the one that passes run over
    subset *subset;
    uint32_t *layers;
    bool printed;
    order_result *result;
} ordering;

static status run_pass(ordering *o, pass pass, readback *readback)
{
    o->set = pass == PASS_ITEM ? o->remains : o->candidate;
    const status status = pass_run(o->passes, pass, subset_trace(o->subset), o->report, readback);
    if (status != STATUS_OK)
        return status;
    const uint64_t bytes = pass_sample_bytes(pass), active = blocks_active_samples(&o->blocks);
    const uint64_t all = geometry_sample_count(o->geometry);
    order_result *result = o->result;
    result->whole.bytes_read += bytes * all;
    result->whole.samples_scanned += all;
    result->blocks.bytes_read += bytes * active;
    result->blocks.samples_scanned += active;
    result->fragments_replayed += readback->result->fragments_replayed;
    *(pass == PASS_ITEM ? &result->item_passes : &result->complexity_passes) += 1;
    return STATUS_OK;
}

// ---- The item buffer: candidates -----------------------------------------------------------------------

static bool scan_item_block(ordering *o, uint32_t block, const uint32_t *item)
{
    const block_area area = blocks_area(&o->blocks, block);
    const uint64_t pitch = (uint64_t)o->blocks.width * o->blocks.samples;
    bool covered = false;
    for (uint32_t y = area.y0; y < area.y1; y++) {
        for (uint64_t s = y * pitch + area.x0, end = y * pitch + area.x1; s < end; s++) {
            if (item[s] >= o->geometry->id_count)  // no fragment
                continue;
            o->candidate[item[s]] = CANDIDATE;
            covered = true;
        }
    }
    return covered;
}

static void scan_item(ordering *o, const uint32_t *item)
{
    memset(o->candidate, 0, o->geometry->id_count);
    for (uint32_t b = 0; b < o->blocks.count; b++)
        if (o->blocks.active[b])
            o->blocks.active[b] = scan_item_block(o, b, item);
}

// ---- Depth complexity: who goes back -------------------------------------------------------------------

typedef struct findings {
    bool removed;
    bool unsettled;  // more may have to go back, which this pass did not show
} findings;

// One covered sample. `front`: its item, the nearest of all that remained. `seen`: the farthest candidate there.
static void judge_sample(ordering *o, uint32_t front, uint32_t seen, uint32_t count, findings *findings)
{
    if (front >= o->geometry->id_count || seen >= o->geometry->id_count)
        return;  // programs other than the shipped ones may leave anything
    if (count > 1 || (!o->printed && seen != front)) {
        o->candidate[seen] |= GOES_BACK;
        findings->removed = true;
    }
    // Of two candidates the farther goes back; the nearer is right only if it is the item.
    findings->unsettled |= count > 2 || (!o->printed && count == 2 && !o->candidate[front]);
}

static findings scan_complexity(ordering *o, const uint32_t *item, const readback *seen)
{
    findings findings = {false, false};
    const uint64_t pitch = (uint64_t)o->blocks.width * o->blocks.samples;
    for (uint32_t b = 0; b < o->blocks.count; b++) {
        if (!o->blocks.active[b])
            continue;
        const block_area area = blocks_area(&o->blocks, b);
        for (uint32_t y = area.y0; y < area.y1; y++)
            for (uint64_t s = y * pitch + area.x0, end = y * pitch + area.x1; s < end; s++)
                if (seen->count[s])
                    judge_sample(o, item[s], seen->item[s], seen->count[s], &findings);
    }
    return findings;
}

static void put_back(ordering *o)
{
    for (uint32_t i = 0; i < o->geometry->id_count; i++)
        if (o->candidate[i] & GOES_BACK)
            o->candidate[i] = 0;
}

// Leaves in `candidate` those that form the layer. Each turn but the last puts one back, so that it ends.
static status thin_out(ordering *o, const uint32_t *item)
{
    uint64_t passes = 0;
    for (findings findings = {true, true}; findings.removed && findings.unsettled;) {
        readback seen;
        const status status = run_pass(o, PASS_COMPLEXITY, &seen);
        if (status != STATUS_OK)
            return status;
        findings = scan_complexity(o, item, &seen);
        result_destroy(seen.result);
        put_back(o);
        passes++;
    }
    if (passes > o->result->complexity_passes_most)
        o->result->complexity_passes_most = passes;
    return STATUS_OK;
}

// ---- Layer by layer ------------------------------------------------------------------------------------

// Gives the candidates that are left the next layer; returns how many.
static uint32_t take_layer(ordering *o)
{
    uint32_t taken = 0;
    for (uint32_t i = 0; i < o->geometry->id_count; i++) {
        if (!o->candidate[i])
            continue;
        o->layers[i] = o->result->layer_count;
        o->remains[i] = 0;
        taken++;
    }
    return taken;
}

static status extract_one(ordering *o, uint32_t *taken)
{
    readback item;
    status status = run_pass(o, PASS_ITEM, &item);
    if (status != STATUS_OK)
        return status;
    scan_item(o, item.item);
    status = thin_out(o, item.item);
    result_destroy(item.result);
    *taken = status == STATUS_OK ? take_layer(o) : 0;
    return status;
}

static status extract_all(ordering *o)
{
    status status = STATUS_OK;
    const uint32_t total = o->geometry->id_count;
    for (uint32_t done = 0, taken = 1; status == STATUS_OK && taken && done < total; done += taken) {
        status = extract_one(o, &taken);
        o->result->layer_count += taken > 0;
        report_progress(o->report, "ordering primitives", done + taken, total);
    }
    return status;
}

status layers_extract(const geometry *geometry, const passes *passes, const order_options *options,
                      const report *report, uint32_t *layers, order_result *result)
{
    const uint32_t count = geometry->id_count;
    ordering o = {.geometry = geometry,
                  .passes = passes,
                  .report = report,
                  .layers = layers,
                  .printed = options->printed,
                  .result = result};
    o.remains = malloc(count + (size_t)1);
    o.candidate = malloc(count + (size_t)1);
    const bool good = o.remains && o.candidate && blocks_create(geometry->info, options->block_pixels, &o.blocks);
    status status = good ? subset_open(geometry, &o.set, report, &o.subset)
                         : report_error(report, STATUS_IO, "out of memory: %u primitives", count);
    if (status == STATUS_OK) {
        memset(o.remains, 1, count);
        for (uint32_t i = 0; i < count; i++)
            layers[i] = LAYER_NONE;
        status = extract_all(&o);
    }
    subset_close(o.subset);
    blocks_free(&o.blocks);
    free(o.remains);
    free(o.candidate);
    return status;
}
