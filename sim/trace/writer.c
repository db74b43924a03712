// The public writer: cuts what is appended into blocks, checks and counts them, and hands them to a form.
#include "form.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct trace_writer {
    const report *report;
    char *path;
    aside *aside;  // the file: NULL once it is in place
    FILE *file;    // the aside's
    trace_info info;
    created created;
    content *content;
    block *block;
    trace_draw draw;
    bool drawing;
    uint32_t draw_count;
    status failed;  // the first failure; everything after it returns the same
};

static void writer_free(trace_writer *writer)
{
    if (writer->created.form)
        writer->created.form->destroy(writer->created.self);
    aside_discard(writer->aside);
    content_destroy(writer->content);
    free(writer->block);
    free(writer->path);
    free(writer);
}

static bool ends_with(const char *path, const char *ending)
{
    size_t length = strlen(path), size = strlen(ending);
    return length >= size && strcmp(path + length - size, ending) == 0;
}

status trace_create(const char *path, const trace_info *info, const report *report, trace_writer **result)
{
    *result = NULL;
    trace_info copy = *info;
    copy.draws = NULL;
    copy.draw_count = 0;
    if (copy.samples <= TRACE_SAMPLES_MAX)
        memset(copy.sample_positions[copy.samples], 0,
               (TRACE_SAMPLES_MAX - copy.samples) * sizeof *copy.sample_positions);
    char why[WHY_SIZE];
    if (!info_check(&copy, why))
        return report_error(report, STATUS_REFUSED, "%s: %s", path, why);
    trace_writer *writer = calloc(1, sizeof *writer);
    if (!writer)
        return report_error(report, STATUS_IO, "%s: no memory", path);
    *writer = (trace_writer){.report = report, .info = copy};
    writer->path = strdup(path);
    writer->content = content_create(&copy);
    writer->block = calloc(1, sizeof *writer->block);
    status status = writer->path && writer->content && writer->block
                        ? aside_open(path, report, &writer->aside, &writer->file)
                        : report_error(report, STATUS_IO, "%s: no memory", path);
    if (status == STATUS_OK &&
        !(ends_with(path, ".rtxt") ? text_create : binary_create)(writer->file, &writer->info, &writer->created))
        status = report_error(report, STATUS_IO, "%s: no memory or no space", path);
    if (status != STATUS_OK) {
        writer_free(writer);
        return status;
    }
    *result = writer;
    return STATUS_OK;
}

static status fail(trace_writer *writer, status status, const char *why)
{
    if (writer->failed == STATUS_OK)
        writer->failed = report_error(writer->report, status, "%s: %s", writer->path, why);
    return writer->failed;
}

static status fail_to_write(trace_writer *writer)
{
    return fail(writer, STATUS_IO, "cannot be written: no space or no memory");
}

// A name from elsewhere, a mesh's path for instance, becomes one the text form can hold.
static void clean_name(const char *name, char clean[NAME_SIZE])
{
    size_t length = strnlen(name, NAME_SIZE - 1);
    for (size_t i = 0; i < length; i++)
        clean[i] = name[i] <= ' ' || name[i] > '~' || name[i] == '#' ? '_' : name[i];
    clean[length] = 0;
}

status trace_begin_draw(trace_writer *writer, const char *name, draw_class class)
{
    if (writer->failed != STATUS_OK)
        return writer->failed;
    if (writer->drawing || !name[0] || (unsigned)class >= CLASS_COUNT)
        return fail(writer, STATUS_USAGE,
                    writer->drawing ? "a draw begins inside a draw" : "a draw without a name or class");
    if (writer->draw_count == TRACE_DRAWS_MAX)
        return fail(writer, STATUS_REFUSED, "more than 65536 draws");
    writer->draw = (trace_draw){.class = class};
    clean_name(name, writer->draw.name);
    writer->drawing = true;
    if (!writer->created.form->begin_draw(writer->created.self, &writer->draw))
        return fail_to_write(writer);
    return STATUS_OK;
}

static void make_nan_canonical(block *block)
{
    const uint64_t wide = CANONICAL_NAN_DOUBLE;
    const uint32_t narrow = CANONICAL_NAN_FLOAT;
    for (uint32_t i = 0; i < block->count; i++) {
        if (isnan(block->depth[i]))
            memcpy(&block->depth[i], &wide, sizeof wide);
        for (int c = 0; c < 4; c++)
            if (isnan(block->rgba[c][i]))
                memcpy(&block->rgba[c][i], &narrow, sizeof narrow);
    }
}

static status write_block(trace_writer *writer)
{
    block *block = writer->block;
    if (writer->info.nonfinite)
        make_nan_canonical(block);
    char why[WHY_SIZE], message[WHY_SIZE + NAME_SIZE + 64];
    if (!block_check(&writer->info, block, why)) {
        snprintf(message, sizeof message, "draw %s, after %llu fragments: %s", writer->draw.name,
                 (unsigned long long)writer->draw.fragments, why);
        return fail(writer, STATUS_REFUSED, message);
    }
    uint8_t digest[DIGEST_BYTES];
    content_digest(writer->content, block, digest);
    content_add_digest(writer->content, digest);
    writer->draw.fragments += block->count;
    if (!writer->created.form->block(writer->created.self, block, digest))
        return fail_to_write(writer);
    block->count = 0;
    return STATUS_OK;
}

status trace_append(trace_writer *writer, const fragments *fragments)
{
    if (writer->failed != STATUS_OK)
        return writer->failed;
    if (!writer->drawing)
        return fail(writer, STATUS_USAGE, "fragments outside a draw");
    block *block = writer->block;
    for (uint32_t done = 0; done < fragments->count;) {
        uint32_t at = block->count, count = fragments->count - done;
        if (count > BLOCK_MAX - at)
            count = BLOCK_MAX - at;
        memcpy(block->x + at, fragments->x + done, count * sizeof *block->x);
        memcpy(block->y + at, fragments->y + done, count * sizeof *block->y);
        memcpy(block->sample + at, fragments->sample + done, count);
        memcpy(block->depth + at, fragments->depth + done, count * sizeof *block->depth);
        for (int c = 0; c < 4; c++)
            memcpy(block->rgba[c] + at, fragments->rgba[c] + done, count * sizeof *block->rgba[c]);
        memcpy(block->primitive + at, fragments->primitive + done, count * sizeof *block->primitive);
        block->count += count;
        done += count;
        if (block->count == BLOCK_MAX && write_block(writer) != STATUS_OK)
            return writer->failed;
    }
    return STATUS_OK;
}

status trace_end_draw(trace_writer *writer, uint64_t triangles, uint64_t vertices)
{
    if (writer->failed != STATUS_OK)
        return writer->failed;
    if (!writer->drawing)
        return fail(writer, STATUS_USAGE, "a draw ends that did not begin");
    if (writer->block->count > 0 && write_block(writer) != STATUS_OK)
        return writer->failed;
    writer->draw.triangles = triangles;
    writer->draw.vertices = vertices;
    writer->drawing = false;
    writer->draw_count++;
    content_add_draw(writer->content, &writer->draw);
    if (!writer->created.form->end_draw(writer->created.self, &writer->draw))
        return fail_to_write(writer);
    return STATUS_OK;
}

status trace_finish(trace_writer *writer, char hex[33])
{
    if (writer->failed == STATUS_OK && writer->drawing)
        fail(writer, STATUS_USAGE, "a draw did not end");
    uint8_t hash[DIGEST_BYTES];
    content_end(writer->content, hash);
    content_hex(hash, hex);
    if (writer->failed == STATUS_OK && !writer->created.form->finish(writer->created.self, hash))
        fail_to_write(writer);
    status result = writer->failed;
    if (result == STATUS_OK) {
        result = aside_finish(writer->aside);
        writer->aside = NULL;
    }
    writer_free(writer);
    return result;
}

void trace_abandon(trace_writer *writer)
{
    if (writer)
        writer_free(writer);
}
