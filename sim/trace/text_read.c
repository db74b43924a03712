// The text form, read line by line: never more of the file than one buffer is in memory. Opening reads it all once, for
// the checks, the draws, the counts and the hash; later passes parse again and notice a file that changed.
#include "form.h"
#include "numbers.h"
#include "text_header.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct text_reader {
    const char *path;
    const report *report;
    int descriptor;
    trace_info *info;
    locale_t c_locale;
    lines lines;
    block block;
    bool held;      // the current line is still to be used
    bool checking;  // the first pass: draws are noted, not known
    uint32_t draws_begun, draw_room;
    uint64_t read;  // fragments of this pass
    content *content;
} text_reader;

static void text_close(void *self)
{
    text_reader *reader = self;
    close(reader->descriptor);
    if (reader->c_locale)
        freelocale(reader->c_locale);
    content_destroy(reader->content);
    free(reader);
}

static status refuse_changed(const text_reader *reader)
{
    return report_error(reader->report, STATUS_REFUSED, "%s: the file changed while it was being read", reader->path);
}

// Makes room for one more draw, at most TRACE_DRAWS_MAX.
static status grow_draws(text_reader *reader)
{
    trace_info *info = reader->info;
    if (info->draw_count < reader->draw_room)
        return STATUS_OK;
    if (info->draw_count == TRACE_DRAWS_MAX)
        return lines_refuse(&reader->lines, 1, "more than %d draws", TRACE_DRAWS_MAX);
    uint32_t room = reader->draw_room ? 2 * reader->draw_room : 16;
    trace_draw *draws = realloc(info->draws, room * sizeof *draws);
    if (!draws)
        return report_error(reader->report, STATUS_IO, "%s: no memory", reader->path);
    info->draws = draws;
    reader->draw_room = room;
    return STATUS_OK;
}

static status read_draw_line(text_reader *reader, trace_draw *draw)
{
    const lines *lines = &reader->lines;
    const word *words = lines->words;
    *draw = (trace_draw){0};
    status result = text_expect_words(lines, 3, 5, "draw NAME opaque|transparent|sorted [TRIANGLES VERTICES]");
    if (result == STATUS_OK && lines->word_count == 4)
        result = lines_refuse(lines, lines_end_column(lines), "triangles without vertices; expected both or none");
    if (result != STATUS_OK)
        return result;
    if (!draw_name_check(words[1].text, (size_t)words[1].length))
        return lines_refuse(lines, words[1].column, "the name of a draw is 1 to %d visible ASCII characters",
                            NAME_SIZE - 1);
    memcpy(draw->name, words[1].text, (size_t)words[1].length);
    int class = 0;
    while (class < CLASS_COUNT && strcmp(words[2].text, draw_class_names[class]) != 0)
        class ++;
    if (class == CLASS_COUNT)
        return lines_refuse(lines, words[2].column, "class '%.40s', expected opaque, transparent or sorted",
                            words[2].text);
    draw->class = (draw_class) class;
    if (lines->word_count == 5) {
        result = text_read_uint(lines, 3, UINT64_MAX, "the number of triangles", &draw->triangles);
        if (result == STATUS_OK)
            result = text_read_uint(lines, 4, UINT64_MAX, "the number of vertices", &draw->vertices);
    }
    return result;
}

static status begin_draw(text_reader *reader)
{
    trace_info *info = reader->info;
    if (!reader->checking)
        return reader->draws_begun++ < info->draw_count ? STATUS_OK : refuse_changed(reader);
    status result = grow_draws(reader);
    trace_draw draw;
    if (result == STATUS_OK)
        result = read_draw_line(reader, &draw);
    if (result != STATUS_OK)
        return result;
    if (info->draw_count > 0)
        content_add_draw(reader->content, &info->draws[info->draw_count - 1]);
    info->draws[info->draw_count++] = draw;
    reader->draws_begun++;
    return STATUS_OK;
}

static status read_fragment(text_reader *reader)
{
    const lines *lines = &reader->lines;
    const trace_info *info = reader->info;
    block *block = &reader->block;
    uint32_t i = block->count;
    int words = info->samples > 1 ? 10 : 9;
    uint64_t x = 0, y = 0, primitive = 0, sample = 0;
    status result = reader->draws_begun > 0
                        ? STATUS_OK
                        : lines_refuse(lines, 1, "a fragment before the first `draw NAME CLASS` line");
    if (result == STATUS_OK)
        result = text_expect_words(lines, words, words,
                                   info->samples > 1 ? "f X Y DEPTH R G B A PRIMITIVE SAMPLE"
                                                     : "f X Y DEPTH R G B A PRIMITIVE");
    if (result == STATUS_OK)
        result = text_read_uint(lines, 1, info->width - 1, "x", &x);
    if (result == STATUS_OK)
        result = text_read_uint(lines, 2, info->height - 1, "y", &y);
    if (result == STATUS_OK && info->depth_bits == 64)
        result = text_read_double(lines, 3, reader->c_locale, info->nonfinite, "the depth", &block->depth[i]);
    if (result == STATUS_OK && info->depth_bits == 32) {
        float depth = 0;
        result = text_read_float(lines, 3, reader->c_locale, info->nonfinite, "the depth", &depth);
        block->depth[i] = (double)depth;
    }
    static const char *const names[4] = {"red", "green", "blue", "alpha"};
    for (int c = 0; result == STATUS_OK && c < 4; c++)
        result = text_read_float(lines, 4 + c, reader->c_locale, info->nonfinite, names[c], &block->rgba[c][i]);
    if (result == STATUS_OK)
        result = text_read_uint(lines, 8, UINT32_MAX, "the primitive", &primitive);
    if (result == STATUS_OK && words == 10)
        result = text_read_uint(lines, 9, info->samples - 1, "the sample", &sample);
    block->x[i] = (uint16_t)x;
    block->y[i] = (uint16_t)y;
    block->primitive[i] = (uint32_t)primitive;
    block->sample[i] = (uint8_t)sample;
    block->count += result == STATUS_OK;
    return result;
}

// Fills the block with fragments of one draw; leaves it empty at the end of the file.
static status read_block(text_reader *reader)
{
    lines *lines = &reader->lines;
    block *block = &reader->block;
    block->count = 0;
    while (block->count < BLOCK_MAX) {
        status result = reader->held ? STATUS_OK : lines_next(lines);
        reader->held = false;
        if (result != STATUS_OK)
            return result;
        if (lines->word_count == 0) {
            reader->held = true;  // stay at the end
            break;
        }
        const word *name = &lines->words[0];
        if (strcmp(name->text, "f") == 0) {
            result = read_fragment(reader);
        } else if (strcmp(name->text, "draw") == 0) {
            reader->held = block->count > 0;
            if (reader->held)
                break;
            result = begin_draw(reader);
        } else {
            result = lines_refuse(lines, name->column, "'%.40s', expected f or draw", name->text);
        }
        if (result != STATUS_OK)
            return result;
    }
    reader->read += block->count;
    return STATUS_OK;
}

static status text_next(void *self, fragments *fragments)
{
    text_reader *reader = self;
    status result = read_block(reader);
    if (result != STATUS_OK)
        return result;
    uint64_t expected = reader->info->fragment_count;
    if (reader->read > expected || (reader->block.count == 0 && reader->read != expected))
        return refuse_changed(reader);
    block_view(&reader->block, reader->draws_begun - 1, fragments);
    return STATUS_OK;
}

static status text_rewind(void *self)
{
    text_reader *reader = self;
    trace_info again = {0};
    reader->draws_begun = 0;
    reader->read = 0;
    lines_begin(&reader->lines, reader->path, reader->descriptor, reader->report);
    status result = text_header_read(&reader->lines, reader->c_locale, &again);
    reader->held = true;
    return result;
}

static void text_select(void *self, const bounds *region)
{
    (void)self;
    (void)region;  // there is no index: every run comes
}

static const trace_form text_form = {text_next, text_rewind, text_select, NULL, text_close};

// The pass that learns the draws, the counts and the hash.
static status check_all(text_reader *reader)
{
    trace_info *info = reader->info;
    uint8_t digest[DIGEST_BYTES];
    reader->checking = true;
    status result = read_block(reader);
    while (result == STATUS_OK && reader->block.count > 0) {
        info->draws[info->draw_count - 1].fragments += reader->block.count;
        content_digest(reader->content, &reader->block, digest);
        content_add_digest(reader->content, digest);
        result = read_block(reader);
    }
    if (result != STATUS_OK)
        return result;
    if (info->draw_count > 0)
        content_add_draw(reader->content, &info->draws[info->draw_count - 1]);
    content_end(reader->content, digest);
    content_hex(digest, info->hash);
    info->fragment_count = reader->read;
    reader->checking = false;
    return STATUS_OK;
}

status text_open(const char *path, int descriptor, const report *report, trace_info *info, opened *opened)
{
    text_reader *reader = calloc(1, sizeof *reader);
    if (!reader) {
        close(descriptor);
        return report_error(report, STATUS_IO, "%s: no memory", path);
    }
    reader->path = path;
    reader->report = report;
    reader->descriptor = descriptor;
    reader->info = info;
    reader->c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    lines_begin(&reader->lines, path, descriptor, report);
    status result = reader->c_locale ? text_header_read(&reader->lines, reader->c_locale, info)
                                     : report_error(report, STATUS_IO, "%s: no memory", path);
    reader->held = true;
    if (result == STATUS_OK && !(reader->content = content_create(info)))
        result = report_error(report, STATUS_IO, "%s: no memory", path);
    if (result == STATUS_OK)
        result = check_all(reader);
    if (result == STATUS_OK)
        result = text_rewind(reader);
    if (result != STATUS_OK) {
        text_close(reader);
        return result;
    }
    *opened = (struct opened){&text_form, reader};
    return STATUS_OK;
}
