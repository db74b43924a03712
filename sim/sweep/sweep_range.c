// Ranges of integers in a sweep file: every integer, or by a step, or by a factor.
//
// Both ends belong to the range. A step or factor that misses HIGH is refused: whoever wrote HIGH wants it run.
#include "sweep_file.h"

#include <string.h>

enum { DIGITS_MAX = 18 };  // always fit an int64_t

// Decimal digits with a sign perhaps; what follows, or NULL.
static const char *read_integer(const char *text, int64_t *number)
{
    const bool negative = *text == '-';
    const char *digits = text + negative;
    const size_t count = strspn(digits, "0123456789");
    if (count == 0 || count > DIGITS_MAX)
        return NULL;
    *number = 0;
    for (size_t i = 0; i < count; i++)
        *number = 10 * *number + digits[i] - '0';
    if (negative)
        *number = -*number;
    return digits + count;
}

static bool read_parts(const char *text, sweep_range *range)
{
    const char *rest = read_integer(text, &range->low);
    rest = rest && strncmp(rest, "..", 2) == 0 ? read_integer(rest + 2, &range->high) : NULL;
    if (!rest)
        return false;
    range->by_factor = *rest == '*';
    range->by = 1;
    if (*rest == '+' || *rest == '*')
        rest = read_integer(rest + 1, &range->by);
    return rest && !*rest;
}

int64_t sweep_range_next(const sweep_range *range, int64_t number)
{
    return range->by_factor ? number * range->by : number + range->by;
}

// A word of digits, signs and two dots. A value of a machine key has none.
static bool is_meant(const char *text)
{
    const char *dots = strstr(text, "..");
    return dots && dots != text && strspn(text, "+-*.0123456789") == strlen(text);
}

bool sweep_range_read(const char *text, sweep_range *range, char why[SWEEP_WHY_SIZE])
{
    why[0] = 0;
    if (!is_meant(text))
        return false;
    if (!read_parts(text, range) || range->low > range->high || range->low < INT32_MIN || range->high > INT32_MAX) {
        snprintf(why, SWEEP_WHY_SIZE,
                 "the range %.60s must be LOW..HIGH, LOW..HIGH+STEP or LOW..HIGH*FACTOR, LOW not above HIGH", text);
    } else if (!range->by_factor && (range->by < 1 || range->by > INT32_MAX)) {
        snprintf(why, SWEEP_WHY_SIZE, "the range %.60s must have a step of at least 1", text);
    } else if (range->by_factor && (range->low < 1 || range->by < 2 || range->by > INT32_MAX)) {
        snprintf(why, SWEEP_WHY_SIZE, "the range %.60s must begin at 1 or above and have a factor of at least 2", text);
    } else {
        int64_t last = range->low;
        int count = 1;
        while (count <= SWEEP_VALUES_MAX && sweep_range_next(range, last) <= range->high) {
            last = sweep_range_next(range, last);
            count++;
        }
        if (count > SWEEP_VALUES_MAX)
            snprintf(why, SWEEP_WHY_SIZE, "the range %.60s may have at most %d integers", text, SWEEP_VALUES_MAX);
        else if (last != range->high)
            snprintf(why, SWEEP_WHY_SIZE, "the range %.60s does not meet %lld: it has %lld, then %lld", text,
                     (long long)range->high, (long long)last, (long long)sweep_range_next(range, last));
    }
    return true;
}
