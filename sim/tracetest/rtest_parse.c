// A test file in, its traces, cases and expectations out.
//
// A line `program` begins a case; the settings before the first program of a trace hold for all its programs, those
// before the first trace for the whole file. What comes between a trace and its first program is asked of the trace
// itself.
#include "rtest.h"

#include <stdlib.h>
#include <string.h>

typedef struct parser {
    rtest_file *file;
    rtest_text *text;
    rtest_settings settings, trace_settings;  // of the file, of the trace
    rtest_case *test;                         // the one that lines belong to; NULL: none yet
} parser;

static status refuse_memory(const parser *p)
{
    return report_error(p->text->report, STATUS_IO, "%s: out of memory", p->text->path);
}

static status want_words(const parser *p, int min, int max, const char *form)
{
    if (p->text->word_count < min)
        return rtest_refuse(p->text, 0, "something is missing; expected %s", form);
    if (p->text->word_count > max)
        return rtest_refuse(p->text, p->text->words[max].column, "`%.40s` is too much; expected %s",
                            p->text->words[max].text, form);
    return STATUS_OK;
}

static rtest_settings *current_settings(parser *p)
{
    if (p->test && p->test->program_count > 0)
        return &p->test->settings;
    return p->file->trace_count > 0 ? &p->trace_settings : &p->settings;
}

static status finish_case(parser *p)
{
    rtest_case *test = p->test;
    p->test = NULL;
    if (!test)
        return STATUS_OK;
    test->expectation_count = p->file->expectation_count - test->first_expectation;
    if (test->expectation_count > 0)
        return STATUS_OK;
    return report_error(p->text->report, STATUS_REFUSED,
                        "%s:%d:1: nothing is expected of this program; an `expect` line is missing", p->text->path,
                        test->line);
}

static status begin_case(parser *p)
{
    const status status = finish_case(p);
    if (status != STATUS_OK)
        return status;
    if (p->file->trace_count == 0)
        return rtest_refuse(p->text, 1, "`%s` before the first `trace`", p->text->words[0].text);
    rtest_case *test = rtest_add(&p->file->cases, &p->file->case_count, sizeof *test);
    if (!test)
        return refuse_memory(p);
    test->line = p->text->line;
    test->trace = p->file->trace_count - 1;
    test->settings = p->trace_settings;
    test->first_expectation = p->file->expectation_count;
    p->test = test;
    return STATUS_OK;
}

// A name in the line, or the lines up to `end WORD`.
static status take_source(parser *p, const char *word, rtest_source *source)
{
    source->line = p->text->line;
    source->name = NULL;
    if (p->text->word_count == 1)
        return rtest_take_section(p->text, word, &source->begin, &source->end);
    source->name = p->text->words[1].text;
    return STATUS_OK;
}

static status parse_trace(parser *p)
{
    status status = want_words(p, 1, 2, "trace FILE, or trace and lines up to `end trace`");
    if (status == STATUS_OK)
        status = finish_case(p);
    if (status != STATUS_OK)
        return status;
    rtest_source *trace = rtest_add(&p->file->traces, &p->file->trace_count, sizeof *trace);
    p->trace_settings = p->settings;
    return trace ? take_source(p, "trace", trace) : refuse_memory(p);
}

static status parse_program(parser *p)
{
    status status =
        want_words(p, 1, RTEST_PROGRAMS_MAX + 1, "program NAME..., or program and lines up to `end program`");
    if (status == STATUS_OK)
        status = begin_case(p);
    if (status != STATUS_OK)
        return status;
    rtest_case *test = p->test;
    if (p->text->word_count <= 2) {
        test->program_count = 1;
        return take_source(p, "program", &test->programs[0]);
    }
    for (int i = 1; i < p->text->word_count; i++)
        test->programs[test->program_count++] = (rtest_source){.name = p->text->words[i].text, .line = p->text->line};
    return STATUS_OK;
}

static status parse_replace(parser *p)
{
    const status status = want_words(p, 3, 3, "replace \"TEXT\" \"WITH\"");
    if (status != STATUS_OK)
        return status;
    if (!p->test || p->test->program_count == 0)
        return rtest_refuse(p->text, 1, "`replace` before a `program`: it changes the text of the one above it");
    if (p->test->replace_count == RTEST_REPLACE_MAX)
        return rtest_refuse(p->text, 1, "more than %d `replace` of one program", RTEST_REPLACE_MAX);
    if (!p->text->words[1].text[0])
        return rtest_refuse(p->text, p->text->words[1].column, "the text to replace is empty");
    rtest_unescape(p->text, 1);
    rtest_unescape(p->text, 2);
    p->test->replace[p->test->replace_count].what = p->text->words[1].text;
    p->test->replace[p->test->replace_count++].with = p->text->words[2].text;
    return STATUS_OK;
}

static status parse_machine(parser *p)
{
    const status status = want_words(p, 2, 2, "machine NAME|FILE.yaml");
    if (status == STATUS_OK)
        current_settings(p)->machine = p->text->words[1].text;
    return status;
}

static status parse_set(parser *p)
{
    rtest_settings *settings = current_settings(p);
    const status status = want_words(p, 2, 2, "set KEY=VALUE");
    if (status != STATUS_OK)
        return status;
    if (settings->set_count == RTEST_SET_MAX)
        return rtest_refuse(p->text, 1, "more than %d `set`", RTEST_SET_MAX);
    settings->set[settings->set_count++] = p->text->words[1].text;
    return STATUS_OK;
}

static status parse_number(parser *p, uint64_t max, uint64_t *value)
{
    const status status = want_words(p, 2, 2, "one integer");
    return status == STATUS_OK ? rtest_read_uint(p->text, 1, max, value) : status;
}

static status parse_max_iterations(parser *p)
{
    return parse_number(p, UINT64_MAX, &current_settings(p)->max_iterations);
}

static status parse_threads(parser *p)
{
    return parse_number(p, 64, &current_settings(p)->threads);
}

static status parse_vector_bytes(parser *p)
{
    return parse_number(p, 64, &current_settings(p)->vector_bytes);
}

static status parse_occlusion_ratio(parser *p)
{
    double *ratio = &current_settings(p)->occlusion_ratio;
    status status = want_words(p, 2, 2, "occlusion_ratio R");
    if (status == STATUS_OK)
        status = rtest_read_double(p->text, 1, ratio);
    if (status == STATUS_OK && !(*ratio >= 0 && *ratio <= 1))
        return rtest_refuse(p->text, p->text->words[1].column, "the occlusion ratio is a number from 0 to 1");
    return status;
}

static status parse_expect(parser *p)
{
    status status = p->test ? STATUS_OK : begin_case(p);
    if (status != STATUS_OK)
        return status;
    expectation *expectation = rtest_add(&p->file->expectations, &p->file->expectation_count, sizeof *expectation);
    if (!expectation)
        return refuse_memory(p);
    status = rtest_parse_expectation(p->text, expectation);
    if (status == STATUS_OK && p->test->program_count == 0 && expectation->kind != EXPECT_error)
        return rtest_refuse(p->text, 1, "before a `program` only `expect error` of the trace can stand");
    return status;
}

static const struct {
    const char *word;
    status (*parse)(parser *);
} keywords[] = {
    {"trace", parse_trace},
    {"program", parse_program},
    {"replace", parse_replace},
    {"machine", parse_machine},
    {"set", parse_set},
    {"max_iterations", parse_max_iterations},
    {"occlusion_ratio", parse_occlusion_ratio},
    {"threads", parse_threads},
    {"vector_bytes", parse_vector_bytes},
    {"expect", parse_expect},
};
enum { KEYWORD_COUNT = sizeof keywords / sizeof keywords[0] };

static status parse_line(parser *p)
{
    const char *names[KEYWORD_COUNT];
    const char *word = p->text->words[0].text;
    for (int i = 0; i < KEYWORD_COUNT; i++) {
        if (strcmp(word, keywords[i].word) == 0)
            return keywords[i].parse(p);
        names[i] = keywords[i].word;
    }
    const char *meant = nearest_word(word, names, KEYWORD_COUNT);
    return rtest_refuse(p->text, p->text->words[0].column, "`%.40s` begins no line of a test%s%s%s", word,
                        meant ? "; did you mean `"
                              : ": expected trace, program, replace, machine, set, max_iterations, "
                                "occlusion_ratio, threads, vector_bytes or expect",
                        meant ? meant : "", meant ? "`?" : "");
}

status rtest_parse(const char *path, const report *report, rtest_file *file)
{
    *file = (rtest_file){0};
    parser p = {.file = file, .text = &file->text, .settings = {.occlusion_ratio = -1, .threads = 1}};
    status status = rtest_load(path, report, &file->text);
    while (status == STATUS_OK) {
        status = rtest_next_line(&file->text);
        if (status != STATUS_OK || file->text.word_count == 0)
            break;
        status = parse_line(&p);
    }
    if (status == STATUS_OK)
        status = finish_case(&p);
    if (status == STATUS_OK && file->case_count == 0)
        return rtest_refuse(&file->text, 1,
                            "the file expects nothing: a `trace`, a `program` and an `expect` line are missing");
    return status;
}

void rtest_free(rtest_file *file)
{
    rtest_unload(&file->text);
    free(file->traces);
    free(file->cases);
    free(file->expectations);
    *file = (rtest_file){0};
}
