#!/usr/bin/env bash
# `ropsim curve` from outside: its table, its plot, its points, what it refuses.
source "$(dirname "$0")/check.bash"

cat >"$work/tw<o.rtxt" <<'END'
ropsim-trace 1
size 1 1
draw two transparent
f 0 0 0 0.4 1 0 0 0.5 0
f 0 0 0 0.2 0 1 0 0.5 1
END
sed -i 's/^f 0 0 0 /f 0 0 /' "$work/tw<o.rtxt"
programs=(--program layer_peel --program coherent_back_peel,spans=2 --program weighted_sum)
expect 0 "| 3 | coherent_back_peel,spans=2 | 576 | **2** | yes |" curve "$work/tw<o.rtxt" "${programs[@]}" -o "$work/c.svg" --csv "$work/c.csv"
expect 0 "| 352 | **5** | yes |" curve "$work/tw<o.rtxt" --program layer_peel
expect 0 "the machine refuses it" curve "$work/tw<o.rtxt" --program layer_peel --set planes_max=4
grep -q '"coherent_back_peel,spans=2",576,"tw<o",2,2,1,' "$work/c.csv" || complain "the points are $(cat "$work/c.csv")"
grep -q 'tw&lt;o' "$work/c.svg" || complain "the plot does not name its trace"
if command -v xmllint >/dev/null; then xmllint --noout "$work/c.svg" || complain "the plot is no XML"; fi
expect 1 "no program is called" curve --program no_such_program
expect 3 "no_such_trace" curve "$work/no_such_trace.ropt"
finish
