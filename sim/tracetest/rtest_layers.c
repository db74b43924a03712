// A line of a test's trace that stands for many fragments:
//
//   layers COUNT [sorted | reversed | shuffled [seed S] | blocks B] [alpha A] [color R G B] [between NEAR FAR] [at X Y]
//   [sample S]
//
// Layer i of COUNT, from 0 at the front, lies at depth NEAR + (FAR - NEAR) (i + 1) / (COUNT + 1), has primitive i, and
// the colour i / COUNT, 1 - i / COUNT, i mod 2 unless told, so that layers in a wrong order show. The orders are those
// of `scene:sheets`: blocks of B layers, the farthest block first, each in order; shuffled by Fisher and Yates over
// SplitMix64.
#include "rtest.h"

#include <stdlib.h>
#include <string.h>

enum { LAYERS_MAX = 100000 };

typedef struct layers {
    uint64_t count, seed, block, x, y, sample;
    double alpha, color[3], near, far;
    bool reversed, shuffled, has_color, has_sample;
} layers;

static uint64_t next_random(uint64_t *state)
{
    uint64_t z = *state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static uint64_t random_below(uint64_t *state, uint64_t bound)
{
    const uint64_t limit = UINT64_MAX - UINT64_MAX % bound;
    uint64_t value = next_random(state);
    while (value >= limit)
        value = next_random(state);
    return value % bound;
}

static status read_doubles(const rtest_text *text, int *at, double *values, int count)
{
    status status = STATUS_OK;
    for (int i = 0; status == STATUS_OK && i < count; i++)
        status = rtest_read_double(text, (*at)++, &values[i]);
    return status;
}

static status parse_option(const rtest_text *text, int *at, layers *layers)
{
    const int word = (*at)++;
    const char *name = text->words[word].text;
    status status = STATUS_OK;
    if (strcmp(name, "sorted") == 0)
        return STATUS_OK;
    if (strcmp(name, "reversed") == 0 || strcmp(name, "shuffled") == 0) {
        layers->reversed = name[0] == 'r';
        layers->shuffled = name[0] == 's';
    } else if (strcmp(name, "seed") == 0) {
        return rtest_read_uint(text, (*at)++, UINT64_MAX, &layers->seed);
    } else if (strcmp(name, "blocks") == 0) {
        status = rtest_read_uint(text, (*at)++, LAYERS_MAX, &layers->block);
        if (status == STATUS_OK && layers->block == 0)
            return rtest_refuse(text, text->words[word + 1].column, "a block has at least one layer");
    } else if (strcmp(name, "alpha") == 0) {
        return read_doubles(text, at, &layers->alpha, 1);
    } else if (strcmp(name, "color") == 0) {
        layers->has_color = true;
        return read_doubles(text, at, layers->color, 3);
    } else if (strcmp(name, "between") == 0) {
        status = read_doubles(text, at, &layers->near, 1);
        return status == STATUS_OK ? read_doubles(text, at, &layers->far, 1) : status;
    } else if (strcmp(name, "at") == 0) {
        status = rtest_read_uint(text, (*at)++, TRACE_SIZE_MAX, &layers->x);
        return status == STATUS_OK ? rtest_read_uint(text, (*at)++, TRACE_SIZE_MAX, &layers->y) : status;
    } else if (strcmp(name, "sample") == 0) {
        layers->has_sample = true;
        return rtest_read_uint(text, (*at)++, TRACE_SAMPLES_MAX, &layers->sample);
    } else {
        return rtest_refuse(
            text, text->words[word].column,
            "`%.40s`, expected sorted, reversed, shuffled, seed, blocks, alpha, color, between, at or sample", name);
    }
    return status;
}

static void fill_order(const layers *layers, uint32_t *order)
{
    const uint32_t count = (uint32_t)layers->count, block = (uint32_t)layers->block;
    uint64_t state = layers->seed;
    uint32_t next = 0;
    for (uint32_t i = 0; i < count; i++)
        order[i] = layers->reversed ? count - 1 - i : i;
    for (uint32_t first = (count - 1) / (block ? block : count) * block; block && next < count; first -= block)
        for (uint32_t i = first; i < first + block && i < count; i++)
            order[next++] = i;
    for (uint32_t i = count; layers->shuffled && i > 1; i--) {
        const uint32_t j = (uint32_t)random_below(&state, i), swapped = order[i - 1];
        order[i - 1] = order[j];
        order[j] = swapped;
    }
}

static void write_layer(const layers *layers, uint32_t i, FILE *out)
{
    const double part = (double)i / (double)layers->count;
    const double own[3] = {part, 1 - part, i % 2};
    const double *color = layers->has_color ? layers->color : own;
    const double depth = layers->near + (layers->far - layers->near) * (i + 1.0) / ((double)layers->count + 1.0);
    fprintf(out, "f %d %d %.17g %.9g %.9g %.9g %.9g %u", (int)layers->x, (int)layers->y, depth, color[0], color[1],
            color[2], layers->alpha, i);
    if (layers->has_sample)
        fprintf(out, " %d", (int)layers->sample);
    fputc('\n', out);
}

status rtest_layers_write(const rtest_text *text, FILE *out, int *line_count)
{
    layers layers = {.alpha = 0.5, .near = 0, .far = 1};
    status status = rtest_read_uint(text, 1, LAYERS_MAX, &layers.count);
    for (int at = 2; status == STATUS_OK && at < text->word_count;)
        status = parse_option(text, &at, &layers);
    *line_count = (int)layers.count;
    if (status != STATUS_OK || layers.count == 0)
        return status;
    uint32_t *order = malloc(layers.count * sizeof *order);
    if (!order)
        return report_error(text->report, STATUS_IO, "%s: out of memory", text->path);
    fill_order(&layers, order);
    for (uint32_t i = 0; i < layers.count; i++)
        write_layer(&layers, order[i], out);
    free(order);
    return STATUS_OK;
}
