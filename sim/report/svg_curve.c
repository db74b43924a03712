// Passes against bits a sample as a plot: plain SVG, one shape and one colour a trace, a line along each trace's best
// programs.
//
// Programs stand where their bits are, under numbers that are spread so that they do not touch; the key beside the plot
// names them. No text is rotated: not every viewer turns it the same way. Shapes are outlines of different sizes, so
// that traces which take as many passes as others are seen around each other.
#include "../sim.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

enum {
    WIDTH = 1180,
    HEIGHT_LEAST = 640,
    LEFT = 60,
    RIGHT = 750,
    TOP = 80,
    BOTTOM = 580,
    KEY = RIGHT + 30,
    LINE = 20,
    SLOT = 19,
    SHAPES = 8
};

// Okabe and Ito's colours, which most people can tell apart, the darker ones.
static const char *const colors[SHAPES] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                           "#000000", "#e69f00", "#56b4e9", "#7f5539"};

typedef struct plot {
    const trade_curve *curve;
    FILE *file;
    double bits_least, bits_most;
    int doublings;  // passes at the top: 2 to this
} plot;

static double at_bits(const plot *plot, double bits)
{
    return LEFT + (RIGHT - LEFT) * (bits - plot->bits_least) / (plot->bits_most - plot->bits_least);
}

static double at_passes(const plot *plot, uint64_t passes)
{
    return BOTTOM - (BOTTOM - TOP) * log2((double)(passes > 0 ? passes : 1)) / plot->doublings;
}

static void text(FILE *file, double x, double y, const char *attributes, const char *words)
{
    fprintf(file, "<text x=\"%.1f\" y=\"%.1f\" %s>", x, y, attributes);
    for (; *words; words++) {
        switch (*words) {
        case '&': fputs("&amp;", file); break;
        case '<': fputs("&lt;", file); break;
        case '>': fputs("&gt;", file); break;
        default: fputc(*words, file);
        }
    }
    fputs("</text>\n", file);
}

// The range of the axes: bits to whole multiples of a step that gives six to twelve marks.
static int choose_axes(plot *plot)
{
    const trade_curve *c = plot->curve;
    uint32_t least = UINT32_MAX, most = 0;
    uint64_t passes = 2;
    for (int i = 0; i < c->program_count; i++) {
        if (!c->programs[i].runs)
            continue;
        least = c->programs[i].bits < least ? c->programs[i].bits : least;
        most = c->programs[i].bits > most ? c->programs[i].bits : most;
        for (int k = 0; k < c->trace_count; k++)
            passes = c->passes[i * c->trace_count + k] > passes ? c->passes[i * c->trace_count + k] : passes;
    }
    least = least > most ? most : least;
    int step = 16;
    while ((most - least) / (uint32_t)step > 10)
        step *= 2;
    plot->bits_least = floor((double)least / step - 0.5) * step;
    plot->bits_most = ceil((double)most / step + 0.5) * step;
    plot->doublings = (int)ceil(log2((double)passes));
    return step;
}

static void draw_axes(const plot *plot, int step)
{
    char words[32];
    for (int i = 0; i <= plot->doublings; i++) {
        const double y = at_passes(plot, (uint64_t)1 << i);
        fprintf(plot->file, "<path d=\"M%d %.1fH%d\" stroke=\"#ddd\"/>\n", LEFT, y, RIGHT);
        snprintf(words, sizeof words, "%" PRIu64, (uint64_t)1 << i);
        text(plot->file, LEFT - 8, y + 4, "text-anchor=\"end\"", words);
    }
    for (double bits = plot->bits_least; bits <= plot->bits_most; bits += step) {
        const double x = at_bits(plot, bits);
        fprintf(plot->file, "<path d=\"M%.1f %dv6\" stroke=\"#444\"/>\n", x, BOTTOM);
        snprintf(words, sizeof words, "%.0f", bits);
        text(plot->file, x, BOTTOM + 20, "text-anchor=\"middle\"", words);
    }
    fprintf(plot->file, "<path d=\"M%d %dV%dH%d\" stroke=\"#444\" fill=\"none\"/>\n", LEFT, TOP, BOTTOM, RIGHT);
    text(plot->file, (LEFT + RIGHT) / 2.0, BOTTOM + 46, "text-anchor=\"middle\"", "bits a sample, all planes");
    text(plot->file, LEFT - 40, TOP - 14, "", "geometry passes");
}

// Their numbers stand above the plot, at least a slot apart, with a line down to where the bits are.
static void draw_programs(const plot *plot, double *slots)
{
    const trade_curve *c = plot->curve;
    double next = LEFT;
    for (int i = 0; i < c->program_count; i++) {
        const double x = at_bits(plot, c->programs[i].bits);
        slots[i] = x > next ? x : next;
        next = slots[i] + (c->programs[i].runs ? SLOT : 0);
    }
    double limit = RIGHT;
    for (int i = c->program_count - 1; i >= 0; i--) {
        slots[i] = slots[i] < limit ? slots[i] : limit;
        limit = slots[i] - (c->programs[i].runs ? SLOT : 0);
    }
    for (int i = 0; i < c->program_count; i++) {
        char words[16];
        if (!c->programs[i].runs)
            continue;
        fprintf(plot->file,
                "<path d=\"M%.1f %dL%.1f %dV%d\" stroke=\"#bbb\" stroke-dasharray=\"2 3\" fill=\"none\"/>\n", slots[i],
                TOP - 22, at_bits(plot, c->programs[i].bits), TOP - 6, BOTTOM);
        snprintf(words, sizeof words, "%d", i + 1);
        text(plot->file, slots[i], TOP - 26, "text-anchor=\"middle\"", words);
    }
}

static void draw_shape(FILE *file, int trace, double x, double y)
{
    const int shape = trace % SHAPES;
    const double r = 4 + 0.8 * (trace % 6);
    fprintf(file, "<path fill=\"none\" stroke-width=\"1.8\" stroke=\"%s\" d=\"", colors[shape]);
    switch (shape) {
    case 0:
        fprintf(file, "M%.1f %.1fa%.1f %.1f 0 1 0 %.1f 0a%.1f %.1f 0 1 0 %.1f 0z", x - r, y, r, r, 2 * r, r, r, -2 * r);
        break;
    case 1: fprintf(file, "M%.1f %.1fh%.1fv%.1fh%.1fz", x - r, y - r, 2 * r, 2 * r, -2 * r); break;
    case 2: fprintf(file, "M%.1f %.1fl%.1f %.1fh%.1fz", x, y - r, r, 2 * r, -2 * r); break;
    case 3: fprintf(file, "M%.1f %.1fl%.1f %.1fl%.1f %.1fl%.1f %.1fz", x, y - r, r, r, -r, r, -r, -r); break;
    case 4: fprintf(file, "M%.1f %.1fv%.1fM%.1f %.1fh%.1f", x, y - r, 2 * r, x - r, y, 2 * r); break;
    case 5:
        fprintf(file, "M%.1f %.1fl%.1f %.1fM%.1f %.1fl%.1f %.1f", x - r, y - r, 2 * r, 2 * r, x - r, y + r, 2 * r,
                -2 * r);
        break;
    case 6: fprintf(file, "M%.1f %.1fl%.1f %.1fh%.1fz", x, y + r, r, -2 * r, -2 * r); break;
    default: fprintf(file, "M%.1f %.1fh%.1f", x - r, y, 2 * r);
    }
    fputs("\"/>\n", file);
}

static void draw_trace(const plot *plot, int trace)
{
    const trade_curve *c = plot->curve;
    double last = 0;
    bool started = false;
    // Programs come in order of bits, so the best ones' passes only fall.
    fprintf(plot->file, "<path fill=\"none\" stroke=\"%s\" stroke-opacity=\"0.6\" stroke-width=\"1.5\" d=\"",
            colors[trace % SHAPES]);
    for (int i = 0; i < c->program_count; i++) {
        if (!curve_is_best(c, i, trace))
            continue;
        const double x = at_bits(plot, c->programs[i].bits), y = at_passes(plot, c->passes[i * c->trace_count + trace]);
        if (started)
            fprintf(plot->file, "H%.1fV%.1f", x, y);
        else
            fprintf(plot->file, "M%.1f %.1f", x, y);
        last = x;
        started = true;
    }
    if (started && last < RIGHT)
        fprintf(plot->file, "H%d", RIGHT);
    fputs("\"/>\n", plot->file);
    for (int i = 0; i < c->program_count; i++)
        if (c->programs[i].runs)
            draw_shape(plot->file, trace, at_bits(plot, c->programs[i].bits),
                       at_passes(plot, c->passes[i * c->trace_count + trace]));
}

// Shapes of traces, then numbers of programs.
static void draw_key(const plot *plot)
{
    const trade_curve *c = plot->curve;
    char words[320];
    double y = TOP - 20;
    for (int i = 0; i < c->trace_count; i++, y += LINE) {
        draw_shape(plot->file, i, KEY + 6, y - 4);
        text(plot->file, KEY + 26, y, "", c->traces[i].label);
    }
    text(plot->file, KEY, y + 6, "font-size=\"11\"", "Lines: fewest passes of the exact programs of so many bits.");
    y += 2 * LINE;
    for (int i = 0; i < c->program_count; i++) {
        const curve_program *p = &c->programs[i];
        if (!p->runs)
            continue;
        snprintf(words, sizeof words, "%d", i + 1);
        text(plot->file, KEY + 16, y, "text-anchor=\"end\"", words);
        snprintf(words, sizeof words, "%s%s", p->name, p->exact ? "" : " (not exact)");
        text(plot->file, KEY + 26, y, "", words);
        y += LINE;
    }
}

status curve_write_svg(const trade_curve *curve, const char *path, const report *report)
{
    plot plot = {.curve = curve};
    aside *aside;
    double *slots = calloc((size_t)curve->program_count + 1, sizeof *slots);
    if (!slots)
        return report_error(report, STATUS_IO, "%s: out of memory", path);
    const status status = aside_open(path, report, &aside, &plot.file);
    if (status != STATUS_OK) {
        free(slots);
        return status;
    }
    const int step = choose_axes(&plot), key = TOP + LINE * (curve->trace_count + curve->program_count + 2);
    const int height = key > HEIGHT_LEAST ? key : HEIGHT_LEAST;
    fprintf(plot.file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
            "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n"
            "<title>Geometry passes against bits a sample</title>\n<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n",
            WIDTH, height, WIDTH, height, WIDTH, height);
    draw_axes(&plot, step);
    draw_programs(&plot, slots);
    for (int i = 0; i < curve->trace_count; i++)
        draw_trace(&plot, i);
    draw_key(&plot);
    fputs("</svg>\n", plot.file);
    free(slots);
    return aside_finish(aside);
}
