#!/usr/bin/env bash
# The tree's own rules: file stems unique, no file above 500 lines, a comment on top, headers that compile alone.
cd "$1" || exit 1
broken=0
complain() { echo "$1"; broken=1; }
sources() { find isa sim tests -name '*.c' -o -name '*.cpp' -o -name '*.h' -o -name '*.def' -o -name '*.inc' | sort; }

# A .c and a .h or .def of one name in one stage belong together; anything else is two things with one name.
stems() { sources | grep -v '^tests/' | sed -E 's,^(isa|sim/[a-z]+/|sim/)(.*/)?([^/]*)\.(c|cpp|h|def|inc)$,\3 \1 \4,' | sort -u; }
while read -r stem; do
    complain "the stem $stem names files of two stages, or two sources of one: $(stems | awk -v s="$stem" '$1 == s' | tr '\n' ';')"
done < <({ stems | awk '{print $1, $2}' | sort -u | cut -d' ' -f1 | uniq -d
           stems | awk '$3 == "c" || $3 == "cpp" {print $1}' | sort | uniq -d; } | sort -u)

for file in $(sources) setup .ci/run $(find programs -name '*.rop') $(find tests -name '*.sh'); do
    lines=$(wc -l <"$file")
    ((lines <= 500)) || complain "$file has $lines lines; 500 are the most"
done
for file in $(sources); do
    [[ $(head -c 2 "$file") == // ]] || complain "$file does not open with a // comment that says what it is"
done

for header in $(find isa sim -name '*.h'); do
    "${CC:-cc}" -std=c17 -D_GNU_SOURCE -Wall -Wextra -Werror -fsyntax-only -x c "$header" 2>/dev/null ||
        complain "$header does not compile alone (text that needs its includer's macros ends in .inc)"
done
exit $broken
