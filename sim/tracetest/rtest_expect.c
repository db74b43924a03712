// A line `expect ...` in, an expectation out. What can be expected stands in expectations.def.
#include "rtest.h"

#include <string.h>

const expect_row expect_rows[EXPECT_KIND_COUNT] = {
#define EXPECT_COUNT(name, value, meaning) {#name, FORM_COUNT, "[RELATION] INTEGER", meaning},
#define EXPECT_FIGURE(name, value, meaning) {#name, FORM_FIGURE, "[RELATION] NUMBER", meaning},
#define EXPECT_FLAG(name, value, meaning) {#name, FORM_FLAG, "", meaning},
#define EXPECT_BYTES(name, field, meaning) {#name, FORM_BYTES, "PLANE [RELATION] INTEGER", meaning},
#define EXPECT_VALUES(name, arguments, meaning) {#name, FORM_VALUES, arguments, meaning},
#define EXPECT_TEXT(name, meaning) {#name, FORM_TEXT, "\"TEXT\"", meaning},
#include "expectations.def"
};

static bool word_is(const rtest_text *text, int word, const char *wanted)
{
    return word < text->word_count && strcmp(text->words[word].text, wanted) == 0;
}

static status find_kind(const rtest_text *text, int word, expect_kind *kind)
{
    const char *names[EXPECT_KIND_COUNT];
    if (word >= text->word_count)
        return rtest_refuse(text, 0, "what is expected is missing");
    for (int i = 0; i < EXPECT_KIND_COUNT; i++) {
        names[i] = expect_rows[i].name;
        *kind = (expect_kind)i;
        if (word_is(text, word, names[i]))
            return STATUS_OK;
    }
    const char *meant = nearest_word(text->words[word].text, names, EXPECT_KIND_COUNT);
    return rtest_refuse(text, text->words[word].column,
                        "nothing called `%.40s` can be expected; %s%s%s`ropsim test --expectations` lists all",
                        text->words[word].text, meant ? "did you mean `" : "", meant ? meant : "", meant ? "`? " : "");
}

static void parse_relation(const rtest_text *text, int *at, relation *relation)
{
    static const char *const words[] = {"=", "<", "<=", ">", ">="};
    for (int i = 0; i < 5; i++) {
        if (word_is(text, *at, words[i])) {
            *relation = (enum relation)i;
            ++*at;
            return;
        }
    }
}

static status parse_place(const rtest_text *text, int *at, expectation *e)
{
    uint64_t x = 0, y = 0;
    status status = rtest_read_uint(text, (*at)++, TRACE_SIZE_MAX - 1, &x);
    if (status == STATUS_OK)
        status = rtest_read_uint(text, (*at)++, TRACE_SIZE_MAX - 1, &y);
    e->x = (uint32_t)x;
    e->y = (uint32_t)y;
    return status;
}

static bool is_clause(const rtest_text *text, int at)
{
    return word_is(text, at, "sample") || word_is(text, at, "tolerance") || word_is(text, at, "after");
}

static status parse_values(const rtest_text *text, int *at, expectation *e)
{
    const bool plane = e->kind == EXPECT_plane;
    if (plane && *at < text->word_count)
        e->plane = text->words[(*at)++].text;
    status status = parse_place(text, at, e);
    while (status == STATUS_OK && *at < text->word_count && e->value_count < RTEST_VALUES_MAX &&
           !is_clause(text, *at)) {
        // far stands for depth 1 and near for depth 0, which every depth format holds exactly.
        e->figures[e->value_count] = text->words[*at];
        if (plane && word_is(text, *at, "far"))
            e->values[e->value_count] = 1;
        else if (!plane || !word_is(text, *at, "near"))
            status = rtest_read_double(text, *at, &e->values[e->value_count]);
        e->value_count++;
        ++*at;
    }
    if (status == STATUS_OK && !plane && e->value_count != 3)
        return rtest_refuse(text, 0, "a pixel has three values; expected expect pixel X Y  R G B");
    if (status == STATUS_OK && plane && e->value_count != 1 && e->value_count != 4)
        return rtest_refuse(
            text, 0, "a plane has one value, a colour plane four; expected expect plane NAME X Y  VALUE or R G B A");
    return status;
}

static status parse_after(const rtest_text *text, int at, expectation *e)
{
    if (word_is(text, at, "pass"))
        e->moment.kind = MOMENT_PASS;
    else if (word_is(text, at, "iteration"))
        e->moment.kind = MOMENT_ITERATION;
    else
        return rtest_refuse(text, at < text->word_count ? text->words[at].column : 0,
                            "expected after pass N or after iteration N");
    const status status = rtest_read_uint(text, at + 1, UINT64_MAX, &e->moment.number);
    if (status == STATUS_OK && e->moment.number == 0)
        return rtest_refuse(text, text->words[at + 1].column, "passes and iterations are counted from 1");
    return status;
}

static status parse_clauses(const rtest_text *text, int at, expectation *e)
{
    status status = STATUS_OK;
    const bool values = expect_rows[e->kind].form == FORM_VALUES;
    const bool tolerates = values || expect_rows[e->kind].form == FORM_FIGURE;
    while (status == STATUS_OK && at < text->word_count) {
        uint64_t sample = 0;
        if (values && word_is(text, at, "sample")) {
            status = rtest_read_uint(text, at + 1, TRACE_SAMPLES_MAX - 1, &sample);
            e->sample = (uint32_t)sample;
            e->has_sample = true;
            at += 2;
        } else if (tolerates && word_is(text, at, "tolerance")) {
            status = rtest_read_double(text, at + 1, &e->tolerance);
            if (status == STATUS_OK && !(e->tolerance >= 0))
                return rtest_refuse(text, text->words[at + 1].column, "a tolerance is not negative");
            e->has_tolerance = true;
            at += 2;
        } else if (word_is(text, at, "after") && expect_rows[e->kind].form != FORM_TEXT) {
            status = parse_after(text, at + 1, e);
            at += 3;
        } else {
            return rtest_refuse(text, text->words[at].column, "`%.40s` is too much here", text->words[at].text);
        }
    }
    return status;
}

static status parse_form(const rtest_text *text, int *at, expectation *e)
{
    switch (expect_rows[e->kind].form) {
    case FORM_BYTES:
        if (*at >= text->word_count)
            return rtest_refuse(text, 0, "the name of a plane is missing");
        e->plane = text->words[(*at)++].text;
        // fall through
    case FORM_COUNT:
        parse_relation(text, at, &e->relation);
        e->figures[0] = *at < text->word_count ? text->words[*at] : (rtest_word){0};
        return rtest_read_uint(text, (*at)++, UINT64_MAX, &e->count);
    case FORM_FIGURE:
        parse_relation(text, at, &e->relation);
        e->value_count = 1;
        e->figures[0] = *at < text->word_count ? text->words[*at] : (rtest_word){0};
        return rtest_read_double(text, (*at)++, &e->values[0]);
    case FORM_VALUES: return parse_values(text, at, e);
    case FORM_TEXT:
        if (*at >= text->word_count || !text->words[*at].text[0])
            return rtest_refuse(text, 0, "a text in quotes is missing");
        e->text = text->words[(*at)++].text;
        return STATUS_OK;
    case FORM_FLAG: break;
    }
    return STATUS_OK;
}

status rtest_parse_expectation(rtest_text *text, expectation *e)
{
    int at = 1;
    e->line = text->line;
    e->negated = word_is(text, at, "not");
    at += e->negated;
    status status = find_kind(text, at, &e->kind);
    if (status == STATUS_OK && e->negated && expect_rows[e->kind].form != FORM_FLAG)
        return rtest_refuse(text, text->words[1].column, "`not` stands before exact and limit_reached only");
    at++;
    if (status == STATUS_OK)
        status = parse_form(text, &at, e);
    return status == STATUS_OK ? parse_clauses(text, at, e) : status;
}
