// Blocks to lines. A draw's triangles and vertices are known at its end only and stand on its first line, so that line
// is written with room for them; hence the blanks at its end.
#include "form.h"
#include "numbers.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { COUNTS_ROOM = 42 };  // a blank and 20 digits, twice

typedef struct text_writer {
    FILE *file;
    trace_info info;
    locale_t c_locale;
    off_t counts;  // where the current draw's counts go
} text_writer;

static void text_writer_destroy(void *self)
{
    text_writer *writer = self;
    freelocale(writer->c_locale);
    free(writer);
}

static bool write_header(const text_writer *writer)
{
    const trace_info *info = &writer->info;
    FILE *file = writer->file;
    fprintf(file, "ropsim-trace 1%s\nsize %u %u\n", info->nonfinite ? " nonfinite" : "", info->width, info->height);
    if (info->samples != 1)
        fprintf(file, "samples %u\n", info->samples);
    trace_info standard = {.samples = info->samples};
    trace_standard_positions(&standard);
    if (memcmp(standard.sample_positions, info->sample_positions, sizeof standard.sample_positions) != 0) {
        fprintf(file, "positions");
        for (uint32_t s = 0; s < info->samples; s++)
            fprintf(file, " %d %d", info->sample_positions[s][0], info->sample_positions[s][1]);
        fprintf(file, "\n");
    }
    fprintf(file, "background");
    for (int c = 0; c < 4; c++) {
        char text[NUMBER_SIZE];
        number_write_float(info->background[c], text);
        fprintf(file, " %s", text);
    }
    fprintf(file, "\n%s%s", info->reversed_depth ? "depth reversed\n" : "",
            info->depth_bits == 32 ? "depth_bits 32\n" : "");
    return !ferror(file);
}

static bool text_begin_draw(void *self, const trace_draw *draw)
{
    text_writer *writer = self;
    fprintf(writer->file, "draw %s %s", draw->name, draw_class_names[draw->class]);
    writer->counts = ftello(writer->file);
    fprintf(writer->file, "%*s\n", COUNTS_ROOM, "");
    return writer->counts >= 0 && !ferror(writer->file);
}

static bool text_block(void *self, const block *block, const uint8_t digest[DIGEST_BYTES])
{
    (void)digest;
    text_writer *writer = self;
    locale_t before = uselocale(writer->c_locale);
    for (uint32_t i = 0; i < block->count; i++) {
        char depth[NUMBER_SIZE], rgba[4][NUMBER_SIZE];
        if (writer->info.depth_bits == 32)
            number_write_float((float)block->depth[i], depth);
        else
            number_write_double(block->depth[i], depth);
        for (int c = 0; c < 4; c++)
            number_write_float(block->rgba[c][i], rgba[c]);
        fprintf(writer->file, "f %u %u %s  %s %s %s %s  %u", block->x[i], block->y[i], depth, rgba[0], rgba[1], rgba[2],
                rgba[3], block->primitive[i]);
        if (writer->info.samples > 1)
            fprintf(writer->file, " %u", block->sample[i]);
        putc('\n', writer->file);
    }
    uselocale(before);
    return !ferror(writer->file);
}

static bool text_end_draw(void *self, const trace_draw *draw)
{
    text_writer *writer = self;
    if (draw->triangles == 0 && draw->vertices == 0)
        return true;
    if (fseeko(writer->file, writer->counts, SEEK_SET) != 0)
        return false;
    fprintf(writer->file, " %" PRIu64 " %" PRIu64, draw->triangles, draw->vertices);
    return fseeko(writer->file, 0, SEEK_END) == 0 && !ferror(writer->file);
}

static bool text_finish(void *self, const uint8_t hash[DIGEST_BYTES])
{
    (void)hash;
    return !ferror(((text_writer *)self)->file);
}

static const writer_form text_writer_form = {text_begin_draw, text_block, text_end_draw, text_finish,
                                             text_writer_destroy};

bool text_create(FILE *file, const trace_info *info, created *created)
{
    text_writer *writer = calloc(1, sizeof *writer);
    locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (!writer || !c_locale) {
        free(writer);
        if (c_locale)
            freelocale(c_locale);
        return false;
    }
    *writer = (text_writer){.file = file, .info = *info, .c_locale = c_locale};
    locale_t before = uselocale(c_locale);
    bool written = write_header(writer);
    uselocale(before);
    if (!written) {
        text_writer_destroy(writer);
        return false;
    }
    *created = (struct created){&text_writer_form, writer};
    return true;
}
