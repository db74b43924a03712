#!/usr/bin/env bash
# Cycles and bytes of small runs against tests/golden/cycles.tsv, line by line. Timing is no law: it may be blessed anew, with a reason.
#
#   bash tests/command/cycles.sh . build/release --bless
#
# rewrites the file under the next number, if CHANGELOG.md has a line `Cycle counts NUMBER: why`. The number stands in the file's first line.
source "$(dirname "$0")/check.bash"
golden=$source_folder/tests/golden/cycles.tsv
changelog=$source_folder/CHANGELOG.md
programs=(layer_peel coherent_layer_peel_a ideal_coherent_layer_peel k_buffer,k=4 weighted_sum)
machines=(abuffer g80 modern programmable tiled tiny)

record() { "$ropsim" record "$2" --size 96x64 -o "$work/$1.ropt" >/dev/null 2>&1 || complain "the scene $1 cannot be recorded"; }
record knot transparent:scene:knot,rings=48,sides=8
record slices scene:slices_cone,slices=16,grid=8
record soup scene:soup,count=200

# trace, program, machine, cycles, drained, bytes read, bytes written; what the machine refuses has no line.
measure() {
    local trace program machine
    for trace in "$source_folder"/traces/*.rtxt "$work"/{knot,slices,soup}.ropt; do
        for program in "${programs[@]}"; do
            for machine in "${machines[@]}"; do
                "$ropsim" run "$program" "$trace" --machine "$machine" --detail cycle --no-reference --threads 1 --json "$work/run.json" >/dev/null 2>&1 || continue
                awk -v line="$(basename "$trace")"$'\t'"$program"$'\t'"$machine" '
                    function number() { gsub(/[^0-9]/, "", $2); return $2 }
                    $1 == "\"memory\":" { memory = 1 }
                    memory && $1 == "\"bytes_read\":" && read == "" { read = number() }
                    memory && $1 == "\"bytes_written\":" && written == "" { written = number() }
                    $1 == "\"cycles\":" && cycles == "" { cycles = number() }
                    $1 == "\"drained_cycles\":" && drained == "" { drained = number() }
                    END { print line "\t" cycles "\t" drained "\t" read "\t" written }' "$work/run.json"
            done
        done
    done
}

heading() { printf '# cycle counts %s\ttrace, program, machine, cycles, drained, bytes read, bytes written\n' "$1"; }
number=$(sed -n '1s/^# cycle counts \([0-9]*\).*/\1/p' "$golden" 2>/dev/null)
measure >"$work/rows"
checks=$(wc -l <"$work/rows")

if [[ ${3:-} == --bless ]]; then
    if [[ -n $number ]] && cmp -s <(tail -n +2 "$golden") "$work/rows"; then
        echo "nothing to bless: all $checks lines are as they were"
        finish
    fi
    next=$((${number:-0} + 1))
    if ! grep -q "Cycle counts $next: ." "$changelog"; then
        echo "CHANGELOG.md has no line \`Cycle counts $next: why\`; lines that differ:"
        diff <(tail -n +2 "$golden" 2>/dev/null) "$work/rows" | head -20
        exit 1
    fi
    { heading "$next"; cat "$work/rows"; } >"$golden"
    echo "blessed $checks lines as cycle counts $next"
    finish
fi

[[ -n $number ]] || complain "$golden has no number in its first line"
((checks > 200)) || complain "only $checks runs"
grep -q "Cycle counts $number: ." "$changelog" || complain "CHANGELOG.md does not say why: it has no line \`Cycle counts $number: why\`"
diff <(tail -n +2 "$golden") "$work/rows" >"$work/differences" ||
    complain "cycles or bytes are not those of tests/golden/cycles.tsv (< there, > now): $(head -40 "$work/differences")
If that is meant: write \`Cycle counts $((number + 1)): why\` into CHANGELOG.md and run bash tests/command/cycles.sh . BUILD --bless"
finish
