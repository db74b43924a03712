#!/usr/bin/env bash
# `ropsim info`, `check` and `convert`: what they print, what they refuse, and that conversions keep what they promise.
source "$(dirname "$0")/check.bash"
traces=$source_folder/traces

for trace in "$traces"/*.rtxt; do
    expect 0 "holds" check "$trace"
    expect 0 "" convert "$trace" "$work/a.ropt"
    expect 0 "" convert "$work/a.ropt" "$work/b.rtxt"
    expect 0 "" convert "$work/b.rtxt" "$work/b.ropt"
    cmp -s "$work/a.ropt" "$work/b.ropt" || complain "$trace: text -> binary -> text -> binary gives other bytes"
    hashes=$(for file in "$trace" "$work/a.ropt" "$work/b.rtxt"; do "$ropsim" info "$file" | grep hash; done | sort -u | wc -l)
    [[ $hashes == 1 ]] || complain "$trace: its forms have $hashes hashes"
done

expect 0 "10 fragments, hash d669b3058ed4b67efb4206cdf658017d" check "$traces/figure2.rtxt"
expect 0 "44.44 % of 9 neighbours" info "$traces/figure2.rtxt"
expect 0 "10.000 a covered sample, 10 at most" info "$traces/figure2.rtxt"
expect 0 '"share_in_order": 0.44' info "$traces/figure2.rtxt" --json
expect 0 '"max": 2' info "$traces/edge_samples.rtxt" --json
expect 0 "0 fragments" check "$traces/empty.rtxt"

head -c 300 "$work/b.ropt" >"$work/cut.ropt"
expect 1 "cut.ropt: byte 236: the last 64 bytes are no trailer" check "$work/cut.ropt"
printf 'ropsim-trace 1\nsize 1 1\ndraw a glass\n' >"$work/glass.rtxt"
expect 1 "glass.rtxt:3:8: class 'glass', expected opaque, transparent or sorted" check "$work/glass.rtxt"
expect 1 "glass.rtxt:3:8" info "$work/glass.rtxt"
echo nothing >"$work/nothing.ropt"
expect 1 "byte 0: is no trace" check "$work/nothing.ropt"
expect 3 "cannot be opened" check "$work/none.ropt"
expect 3 "is not a regular file" check "$work"
expect 2 "no trace was named" check
expect 2 "the second file must end in" convert "$traces/ties.rtxt" "$work/ties.txt"
expect 2 "CSV can be written but not read" convert "$work/ties.csv" "$work/ties.ropt"
expect 1 "glass.rtxt:3:8" convert "$work/glass.rtxt" "$work/kept.ropt"
[[ ! -e $work/kept.ropt ]] || complain "a refused conversion left a file"
printf 'ropsim-trace 1\nsize 1 1\ndraw a sorted\nf 0 0 1.5 0 0 0 0 0\n' >"$work/beyond.rtxt"
expect 0 "1 fragments have a depth outside 0 to 1" check "$work/beyond.rtxt"

expect 0 "" convert "$traces/edge_samples.rtxt" "$work/edge.csv"
[[ $(sed -n 6p "$work/edge.csv") == 0,transparent,0,0,0,0.25,1,0,0,0.5,1 ]] || complain "CSV: $(cat "$work/edge.csv")"

# A deep image keeps pixels, order, samples, primitives; colours and depths here are exact in 32 bits.
expect 0 "the sample index is in channel" convert "$traces/edge_samples.rtxt" "$work/edge.exr"
expect 0 "" convert "$work/edge.exr" "$work/edge.rtxt"
cmp -s <(grep ^f "$traces/edge_samples.rtxt" | tr -s ' ') <(grep ^f "$work/edge.rtxt" | tr -s ' ') ||
    complain "the deep image gives back: $(cat "$work/edge.rtxt")"
expect 0 "" convert "$traces/figure2.rtxt" "$work/figure.exr"
expect 0 "" convert "$traces/figure2.rtxt" "$work/again.exr"
cmp -s "$work/figure.exr" "$work/again.exr" || complain "two conversions to a deep image give other bytes"
expect 0 "" convert "$work/beyond.rtxt" "$work/beyond.exr"
expect 0 "depths from 1.5 to 1.5 are mapped to 0.0625 to 0.9375" convert "$work/beyond.exr" "$work/mapped.rtxt"
head -c 200 "$work/figure.exr" >"$work/cut.exr"
expect 1 "cannot be read as a deep image" convert "$work/cut.exr" "$work/cut.rtxt"
expect 3 "cannot be opened" convert "$work/none.exr" "$work/cut.rtxt"
finish
