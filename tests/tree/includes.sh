#!/usr/bin/env bash
# Who includes whom: stages meet in sim/sim.h and isa/isa.h alone. Prints each line that breaks the rule.
cd "$1" || exit 1
broken=0
complain() { echo "$1"; broken=1; }

# The headers and tables in quotes of one file, as paths from the root.
included() {
    grep -hoE '^[[:space:]]*#[[:space:]]*include[[:space:]]*"[^"]*"' "$1" | sed 's/.*"\(.*\)"/\1/' |
        while read -r name; do realpath -m --relative-to=. "$(dirname "$1")/$name"; done
}

# Files of folder $1 may include what matches the pattern $2.
check() {
    local file name
    for file in $(find "$1" -maxdepth "$3" -name '*.[ch]' -o -maxdepth "$3" -name '*.cpp' -o -maxdepth "$3" -name '*.def'); do
        for name in $(included "$file"); do
            [[ $name =~ $2 ]] || complain "$file includes $name; allowed: $2"
            [[ -e $name ]] || complain "$file includes $name, which is not there"
        done
    done
}

check isa '^isa/[a-z_0-9]*\.(h|def|inc)$' 1
check sim '^(isa/isa\.h|sim/[a-z_0-9]*\.(h|def|inc))$' 1
for stage in $(find sim -mindepth 1 -maxdepth 1 -type d -printf '%f\n'); do
    check "sim/$stage" "^(isa/isa\\.h|sim/(sim|levels|sweeps)\\.h|sim/$stage/.*\\.(h|def|inc))\$" 2
done
exit $broken
