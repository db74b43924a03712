// Speed over layer peeling against slots a clock as a plot: plain SVG, a panel a subject, a colour a program.
//
// Both axes are logarithmic. Solid lines: guarded instructions take a slot; dashed: none. In the card's formats.
#include "papers_time.h"

#include <inttypes.h>
#include <math.h>

enum {
    PANEL_WIDTH = 340,
    PANEL_HEIGHT = 250,
    COLUMNS = 3,
    LEFT = 46,
    TOP = 30,
    RIGHT = 12,
    BOTTOM = 34,
    KEY_LINE = 18
};

// Okabe and Ito's colours, the darker ones.
static const char *const colors[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00"};
enum { LINE_COLORS = sizeof colors / sizeof *colors };

typedef struct panel {
    FILE *file;
    double x, y;       // of its upper left corner
    double low, high;  // speeds, as powers of two
} panel;

static double at_slots(const panel *p, int slots)
{
    return p->x + LEFT + (PANEL_WIDTH - LEFT - RIGHT) * slots / (double)(PAPER_SLOTS_COUNT - 1);
}

static double at_speed(const panel *p, double speed)
{
    const double share = (log2(speed) - p->low) / (p->high - p->low);
    return p->y + PANEL_HEIGHT - BOTTOM - (PANEL_HEIGHT - TOP - BOTTOM) * share;
}

static void widen(panel *p, double speed)
{
    p->low = floor(log2(speed)) < p->low ? floor(log2(speed)) : p->low;
    p->high = ceil(log2(speed)) > p->high ? ceil(log2(speed)) : p->high;
}

static void choose_range(panel *p, const paper_gain *gain)
{
    p->low = 0;
    p->high = 1;
    widen(p, gain->peel[0].seconds / gain->coherent[0].seconds);
    for (int g = 0; g < PAPER_GAIN_GUARDS; g++)
        for (int k = 0; k < PAPER_GAINER_COUNT; k++)
            for (int s = 0; s < PAPER_SLOTS_COUNT; s++)
                widen(p, gain->peel[0].seconds / paper_gain_seconds(gain->times[0][g][k], s));
}

static void draw_axes(const panel *p, const char *title)
{
    const double right = p->x + PANEL_WIDTH - RIGHT, bottom = p->y + PANEL_HEIGHT - BOTTOM;
    for (double power = p->low; power <= p->high; power++) {
        const double y = at_speed(p, exp2(power));
        fprintf(p->file, "<path d=\"M%.1f %.1fH%.1f\" stroke=\"%s\"/>\n", p->x + LEFT, y, right,
                power == 0 ? "#777" : "#ddd");
        fprintf(p->file, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n", p->x + LEFT - 6, y + 4,
                exp2(power));
    }
    for (int s = 0; s < PAPER_SLOTS_COUNT; s++)
        fprintf(p->file, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%" PRId64 "</text>\n", at_slots(p, s),
                bottom + 18, paper_slots[s]);
    fprintf(p->file, "<text x=\"%.1f\" y=\"%.1f\" font-weight=\"bold\">%s</text>\n", p->x + LEFT, p->y + TOP - 10,
            title);
}

static void draw_lines(const panel *p, const paper_gain *gain)
{
    for (int k = 0; k < PAPER_GAINER_COUNT; k++) {
        for (int g = 0; g < PAPER_GAIN_GUARDS; g++) {
            fprintf(p->file, "<path fill=\"none\" stroke-width=\"1.8\" stroke=\"%s\"%s d=\"", colors[k % LINE_COLORS],
                    g ? " stroke-dasharray=\"5 3\"" : "");
            for (int s = 0; s < PAPER_SLOTS_COUNT; s++)
                fprintf(p->file, "%s%.1f %.1f", s ? "L" : "M", at_slots(p, s),
                        at_speed(p, gain->peel[0].seconds / paper_gain_seconds(gain->times[0][g][k], s)));
            fputs("\"/>\n", p->file);
        }
    }
    const double a = at_speed(p, gain->peel[0].seconds / gain->coherent[0].seconds);
    fprintf(p->file, "<path d=\"M%.1f %.1fH%.1f\" stroke=\"#222\" stroke-dasharray=\"1 3\" stroke-width=\"2\"/>\n",
            at_slots(p, 0), a, at_slots(p, PAPER_SLOTS_COUNT - 1));
}

static void draw_key(FILE *file, double y)
{
    for (int k = 0; k < PAPER_GAINER_COUNT; k++, y += KEY_LINE)
        fprintf(file,
                "<path d=\"M%d %.1fh26\" stroke-width=\"1.8\" stroke=\"%s\"/>\n<text x=\"%d\" y=\"%.1f\">%s</text>\n",
                LEFT, y - 4, colors[k % LINE_COLORS], LEFT + 34, y, paper_gainers[k].words);
    fprintf(file,
            "<text x=\"%d\" y=\"%.1f\">Across: slots a clock. Up: times faster than layer_peel (1: as fast). Dotted: "
            "coherent_layer_peel_a. Solid: a guarded instruction takes a slot; dashed: none.</text>\n",
            LEFT, y + 4);
}

status paper_gain_svg(const paper_gains *gains, const char *path)
{
    aside *aside;
    panel panel;
    const int columns = gains->count < COLUMNS ? gains->count : COLUMNS, rows = (gains->count + columns - 1) / columns;
    const int width = columns * PANEL_WIDTH > 900 ? columns * PANEL_WIDTH : 900;
    const int height = rows * PANEL_HEIGHT + KEY_LINE * (PAPER_GAINER_COUNT + 2);
    const status status = aside_open(path, &command_report, &aside, &panel.file);
    if (status != STATUS_OK)
        return status;
    fprintf(panel.file,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"%d\" viewBox=\"0 0 %d %d\" "
            "font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<title>What a programmable ROP would "
            "gain</title>\n<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n",
            width, height, width, height, width, height);
    for (int i = 0; i < gains->count; i++) {
        panel.x = i % columns * PANEL_WIDTH;
        panel.y = (double)(i / columns) * PANEL_HEIGHT;
        choose_range(&panel, &gains->gains[i]);
        draw_axes(&panel, gains->gains[i].label);
        draw_lines(&panel, &gains->gains[i]);
    }
    draw_key(panel.file, rows * PANEL_HEIGHT + KEY_LINE);
    fputs("</svg>\n", panel.file);
    return aside_finish(aside);
}
