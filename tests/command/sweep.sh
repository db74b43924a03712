#!/usr/bin/env bash
# `ropsim sweep` from outside: what it runs, prints and writes, what it does not repeat, what it refuses.
source "$(dirname "$0")/check.bash"
mkdir "$work/elsewhere"
cat >"$work/elsewhere/four.rtxt" <<'END'
ropsim-trace 1
size 4 1
draw four transparent
f 0 0 0.2 1 0 0 0.5 0
f 0 0 0.4 0 1 0 0.5 1
f 0 0 0.6 0 0 1 0.5 2
f 3 0 0.3 1 1 0 0.5 3
END
"$ropsim" machine tiny >"$work/elsewhere/mine.yaml" || complain "no machine file"
cp "$1/programs/layer_peel.rop" "$work/elsewhere/own.rop"
cat >"$work/elsewhere/sweep.yaml" <<'END'
# Paths are relative to this file.
results: out.db
traces:
  - four.rtxt
  - record scene:knot,rings=16 size=32x32 samples=2
programs: [ideal_coherent_layer_peel, ./own.rop, "coherent_back_peel,spans=2"]
machines: [g80, programmable, mine.yaml]
set: {depth_format: [z16, z24], stencil_bits: 7..8}
END
sweep=$work/elsewhere/sweep.yaml
expect 0 "72 runs: 0 were there" sweep "$sweep" --jobs 2
expect 0 "72 runs: 72 were there, 0 done, 0 refused by the machine, 0 failed" sweep "$sweep"
expect 0 "| four.rtxt | ./own.rop | programmable | depth_format=z16 stencil_bits=7 | 7 |" sweep "$sweep" --table --no-run
expect 0 "refused: " sweep "$sweep" --table
expect 0 "| four.rtxt | coherent_back_peel,spans=2 | programmable | depth_format=z16 stencil_bits=7 | 2 | 8 |" \
    sweep "$sweep" --cheapest passes --exact --no-run
expect 0 "| record scene:knot,rings=16 size=32x32 samples=2 | " sweep "$sweep" --cheapest bytes
expect 0 "" sweep "$sweep" --csv "$work/out.csv"
[[ $(wc -l <"$work/out.csv") == 73 ]] || complain "the CSV has $(wc -l <"$work/out.csv") lines"
head -1 "$work/out.csv" | grep -q '^version,detail,trace,.*,geometry_passes,.*,wall_seconds,fragments_per_second' ||
    complain "the CSV begins with $(head -1 "$work/out.csv")"
[[ $(awk -F, '{print NF}' <(grep -v spans "$work/out.csv" | grep four.rtxt | grep '"done"') | sort -u) == 36 ]] || complain "lines of the CSV differ in length"

# A value more: only what is new runs.
sed -i 's/7\.\.8/6..8/' "$sweep"
expect 0 "108 runs: 72 were there" sweep "$sweep"
expect 2 "a sweep file is wanted" sweep
expect 2 "one sweep file at a time" sweep "$sweep" "$sweep"
expect 2 "--jobs is \`0\`" sweep "$sweep" --jobs 0
expect 2 "must be bytes or passes" sweep "$sweep" --cheapest cycles
expect 2 "--exact goes with --cheapest" sweep "$sweep" --exact
expect 3 "cannot be opened" sweep "$work/none.yaml"
expect 3 "cannot be written" sweep "$sweep" --csv "$work/no/folder/out.csv"
sed 's/^results: .*/results: four.rtxt/' "$sweep" >"$work/elsewhere/wrong.yaml"
expect 1 "is not the database of a sweep" sweep "$work/elsewhere/wrong.yaml"
grep -q '^ropsim-trace 1' "$work/elsewhere/four.rtxt" || complain "a trace was overwritten by a database"
sed 's/^machines/machine/' "$sweep" >"$work/elsewhere/wrong.yaml"
expect 1 "wrong.yaml:7:1: unknown key \`machine\`; did you mean \`machines\`?" sweep "$work/elsewhere/wrong.yaml"
finish
