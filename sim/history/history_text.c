// The walk in, lines for a terminal out: a paragraph a pass, an entry a fragment, wrapped at 98 columns.
#include "history.h"

#include <inttypes.h>
#include <stdarg.h>
#include <string.h>

enum { COLUMNS = 98, ITEM_SIZE = 2 * VALUE_NAME_SIZE + 2 * VALUE_TEXT_SIZE + 64 };

// A line that is filled item by item.
typedef struct line {
    FILE *out;
    size_t column, indent;
    bool started;
} line;

static line line_start(FILE *out, size_t indent, const char *head)
{
    fputs(head, out);
    return (line){out, strlen(head), indent, false};
}

PRINTF_LIKE(2, 3)
static void line_item(line *line, const char *format, ...)
{
    char text[ITEM_SIZE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    const size_t length = strlen(text);
    if (line->started) {
        fputc(';', line->out);
        if (line->column + 2 + length > COLUMNS) {
            fprintf(line->out, "\n%*s", (int)line->indent, "");
            line->column = line->indent;
        } else {
            fputc(' ', line->out);
            line->column += 2;
        }
    }
    fputs(text, line->out);
    line->column += length;
    line->started = true;
}

static void line_end(line *line)
{
    fputc('\n', line->out);
}

static const char *plural(uint64_t count)
{
    return count == 1 ? "" : "s";
}

static void begin(void *user, const history *h)
{
    FILE *out = user;
    fprintf(out, "%s on %s%s%s: pixel %u, %u, sample %u\n", h->program->name, h->machine,
            h->options->trace_name ? ", " : "", h->options->trace_name ? h->options->trace_name : "", h->x, h->y,
            h->sample);
    fprintf(out, "%" PRIu64 " fragment%s in raster order%s\n", h->fragment_count, plural(h->fragment_count),
            h->fragment_count ? ": number, depth, straight red green blue alpha, primitive, draw" : "");
    for (uint64_t i = 0; i < h->fragment_count; i++) {
        const sample_fragment *f = &h->fragments[i];
        const trace_draw *draw = &h->info->draws[f->draw];
        char rgba[64];
        snprintf(rgba, sizeof rgba, "%.6g %.6g %.6g %.6g", (double)f->input.rgba[0], (double)f->input.rgba[1],
                 (double)f->input.rgba[2], (double)f->input.rgba[3]);
        fprintf(out, "  #%-5" PRIu64 " %-12.9g %-28s %-8u %s (%s)\n", i + 1, f->input.depth, rgba, f->input.primitive,
                draw->name, draw_class_names[draw->class]);
    }
}

static void draw_batch_begin(void *user, const history *h)
{
    fprintf(user, "\nbatch %u of %u\n", h->batch + 1, h->batches->count);
}

static void iteration(void *user, const history *h)
{
    FILE *out = user;
    fputs("\niteration ", out);
    for (int i = 0; i < h->nest; i++)
        fprintf(out, "%s%" PRIu64, i ? "." : "", h->iterations[i]);
    fputc('\n', out);
}

static void change(line *line, const named_value *before, const named_value *after, const history *h)
{
    char from[VALUE_TEXT_SIZE], to[VALUE_TEXT_SIZE];
    value_text(h, before, from);
    value_text(h, after, to);
    if (value_same(before, after))
        line_item(line, "%s = %s", after->name, to);
    else
        line_item(line, "%s %s -> %s", after->name, from, to);
}

static void plane_change(line *line, const history *h, int plane)
{
    const named_value before = value_of_plane(h, plane, h->before[plane]),
                      after = value_of_plane(h, plane, h->planes[plane]);
    change(line, &before, &after, h);
}

static void transfer(void *user, const history *h, const step *step)
{
    const plane_decl *planes = h->program->planes;
    char head[3 * NAME_SIZE];
    switch (step->kind) {
    case STEP_CLEAR: snprintf(head, sizeof head, "clear    "); break;
    case STEP_COPY: snprintf(head, sizeof head, "copy     from %s: ", planes[step->source].name); break;
    case STEP_SWAP: snprintf(head, sizeof head, "swap     "); break;
    default: fprintf(user, "reset    %s\n", h->program->queries[step->query].name); return;
    }
    line line = line_start(user, 9, head);
    plane_change(&line, h, step->plane);
    if (step->kind == STEP_SWAP && step->source != step->plane)
        plane_change(&line, h, step->source);
    line_end(&line);
}

static bool has_fragment(const history *h, const step *step)
{
    for (uint64_t i = 0; i < h->fragment_count; i++)
        if (schedule_draws(h, step, i))
            return true;
    return false;
}

static void pass(void *user, const history *h, const step *step)
{
    FILE *out = user;
    const plane_decl *planes = h->program->planes;
    if (step->kind == STEP_FULLSCREEN || step->classes != DRAW_OPAQUE) {
        fprintf(out, "\npass %" PRIu64, h->pass);
        if (h->nest)
            fprintf(out, " (iteration %" PRIu64 ", its pass %" PRIu64 ")", h->iterations[0], h->pass_in_iteration);
        fputs(": ", out);
    } else {
        fputc('\n', out);
    }
    if (step->kind == STEP_FULLSCREEN)
        fprintf(out, "fullscreen %s\n", h->program->kernels[step->kernel].name);
    else if (step->kind == STEP_LIST && h->blending)
        fprintf(out, "blend the list into %s with %s, nearest first\n", planes[step->plane].name,
                h->program->blends[step->kernel].name);
    else if (step->kind == STEP_LIST)
        fprintf(out, "list %s before %s, at most %u%s\n", value_classes(step->classes), planes[step->source].name,
                step->entries, has_fragment(h, step) ? "" : ": no fragment here");
    else
        fprintf(out, "draw %s with %s%s\n", value_classes(step->classes), h->program->kernels[step->kernel].name,
                has_fragment(h, step) ? "" : ": no fragment here");
}

static void test(line *line, const history *h, const event *event)
{
    static const char *const titles[] = {
        [EVENT_KEEP] = "shader keeps it", [EVENT_CLIP] = "clip ", [EVENT_STENCIL] = "stencil ",
        [EVENT_DEPTH] = "depth ",         [EVENT_COMPARE] = "",
    };
    const char *verdict = event->holds ? "yes" : "no", *title = titles[event->kind];
    char left[VALUE_TEXT_SIZE], right[VALUE_TEXT_SIZE];
    value_text(h, &event->left, left);
    value_text(h, &event->right, right);
    if (event->kind == EVENT_KEEP || strlen(event->relation) > 2)
        line_item(line, "%s%s: %s", title, event->relation, verdict);
    else
        line_item(line, "%s%s%s%s %s %s%s%s: %s", title, event->left.name, *event->left.name ? " " : "", left,
                  event->relation, event->right.name, *event->right.name ? " " : "", right, verdict);
}

static void fragment(void *user, const history *h, uint64_t index)
{
    char head[32];
    if (index == UINT64_MAX)
        snprintf(head, sizeof head, "  ");
    else
        snprintf(head, sizeof head, "  #%-4" PRIu64 " ", index + 1);
    line line = line_start(user, index == UINT64_MAX ? 2 : 8, head);
    for (int i = 0; i < h->event_count; i++) {
        const event *event = &h->events[i];
        switch (event->kind) {
        case EVENT_WRITE: change(&line, &event->left, &event->right, h); break;
        case EVENT_COUNT: line_item(&line, "counts in %s", h->program->queries[event->query].name); break;
        case EVENT_COMPOSITE: line_item(&line, "composited"); break;
        case EVENT_LIST: line_item(&line, event->holds ? "kept in the list" : "lost: the list is full"); break;
        default: test(&line, h, event);
        }
    }
    if (!h->event_count)
        line_item(&line, "nothing tested or written");
    line_end(&line);
}

static void pass_end(void *user, const history *h, const step *step)
{
    if (step->kind != STEP_FULLSCREEN && !h->blending && !has_fragment(h, step))
        return;
    line line = line_start(user, 8, "  after ");
    for (int p = 0; p < h->program->plane_count; p++)
        if (value_touched(h, step, p))
            plane_change(&line, h, p);
    if (!line.started)
        line_item(&line, "no plane is touched");
    line_end(&line);
}

static void condition(void *user, const history *h, const step *step, const condition_result *result)
{
    FILE *out = user;
    const bool is_while = step->kind == STEP_WHILE;
    fprintf(out, "\n%s %s: %" PRIu64 " here, %" PRIu64 " over the image: %s\n", is_while ? "while" : "if",
            h->program->queries[step->query].name, h->queries[step->query], result->count,
            is_while        ? result->holds ? "again" : "ends"
            : result->holds ? "yes"
                            : "no");
}

static void end(void *user, const history *h)
{
    FILE *out = user;
    if (h->options->pass || h->options->iteration)
        return;
    float rgb[3];
    value_output(h, rgb);
    line line = line_start(out, 8, "\nat the end ");
    for (int p = 0; p < h->program->plane_count; p++)
        plane_change(&line, h, p);
    line_end(&line);
    fprintf(out, "colour %.7g %.7g %.7g\n", (double)rgb[0], (double)rgb[1], (double)rgb[2]);
}

sink history_text_sink(FILE *out)
{
    return (sink){out, begin, draw_batch_begin, iteration, transfer, pass, fragment, pass_end, condition, end};
}
