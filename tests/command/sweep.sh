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
head -1 "$work/out.csv" | grep -q '^version,detail,trace,.*,geometry_passes,.*,fragments_per_second,cycles,.*,statistic_cycles,.*,row_hit_rate' ||
    complain "the CSV begins with $(head -1 "$work/out.csv")"
[[ $(awk -F, '{print NF}' <(head -1 "$work/out.csv"; grep -v spans "$work/out.csv" | grep four.rtxt | grep '"done"') | sort -u | wc -l) == 1 ]] || complain "lines of the CSV differ in length"

# A value more: only what is new runs.
sed -i 's/7\.\.8/6..8/' "$sweep"
expect 0 "108 runs: 72 were there" sweep "$sweep"
expect 2 "a sweep file is wanted" sweep
expect 2 "one sweep file at a time" sweep "$sweep" "$sweep"
expect 2 "--jobs is \`0\`" sweep "$sweep" --jobs 0
expect 2 "--exact goes with --cheapest or --best" sweep "$sweep" --exact
expect 2 "--bound goes with" sweep "$sweep" --bound "exact>=1"
expect 2 "--detail goes with" sweep "$sweep" --detail cycle
expect 2 "--top goes with --best" sweep "$sweep" --cheapest bytes --top 3
expect 2 "--top is \`0\`" sweep "$sweep" --best bytes --top 0
expect 2 "did you mean \`geometry_passes\`?" sweep "$sweep" --cheapest geometry_pases
expect 2 "did you mean \`depth_cache_bytes\`?" sweep "$sweep" --best plane_bytes --bound "depth_cache_byte<=1"
expect 2 "\`bound_by\` is a word" sweep "$sweep" --cheapest bound_by
expect 2 "\`depth_format\` is a word" sweep "$sweep" --best depth_format
for bound in "plane_bytes<5" "plane_bytes=5" "<=5" "plane_bytes" "plane_bytes<=" "plane_bytes<=5 MB" "plane_bytes<=0x10" "plane_bytes<=inf"; do
    expect 2 "the bound \`$bound\` must" sweep "$sweep" --cheapest bytes --bound "$bound"
done
# Before anything runs, and under the name that says what to do.
expect 2 "\`cycles\` is known from the level cycle on, but runs of the level function are compared; give \`detail: cycle\`" \
    sweep "$sweep" --cheapest cycles
expect 2 "\`memory_bytes\` is known from the level traffic on" sweep "$sweep" --best geometry_passes --bound "memory_bytes>=0"
expect 2 "--detail is \`cycles\`" sweep "$sweep" --cheapest bytes --detail cycles
expect 2 "has no runs of the level traffic" sweep "$sweep" --cheapest bytes --detail traffic
expect 3 "cannot be opened" sweep "$work/none.yaml"
expect 3 "cannot be written" sweep "$sweep" --csv "$work/no/folder/out.csv"
sed 's/^results: .*/results: four.rtxt/' "$sweep" >"$work/elsewhere/wrong.yaml"
expect 1 "is not the database of a sweep" sweep "$work/elsewhere/wrong.yaml"
grep -q '^ropsim-trace 1' "$work/elsewhere/four.rtxt" || complain "a trace was overwritten by a database"
sed 's/^machines/machine/' "$sweep" >"$work/elsewhere/wrong.yaml"
expect 1 "wrong.yaml:7:1: unknown key \`machine\`; did you mean \`machines\`?" sweep "$work/elsewhere/wrong.yaml"

# Levels of detail. Two records that both levels have, but only one is compared.
cat >"$work/levels.yaml" <<'END'
results: levels.db
traces: elsewhere/four.rtxt
programs: [layer_peel, ideal_coherent_layer_peel]
machines: tiny
detail: [function, cycle]
set: {memory_mhz: 1..4*2, memory_bytes_per_clock: [1, 8]}
END
levels=$work/levels.yaml
expect 0 "24 runs: 0 were there, 24 done" sweep "$levels" --jobs 2
expect 0 " | cycle | " sweep "$levels" --table --no-run
expect 0 " | function | - | - | - | done |" sweep "$levels" --table --no-run
# rows FILE: the rows of the last table that the command printed, without its heading.
rows() { "$ropsim" sweep "$levels" --no-run "$@" | grep '^| elsewhere'; }
column() { awk -F'|' -v n="$1" '{gsub(/ /, "", $n); print $n}'; }
[[ $(rows --best cycles --top 100 | wc -l) == 12 ]] || complain "--best lists $(rows --best cycles --top 100 | wc -l) of 12 runs"
[[ $(rows --best cycles | wc -l) == 10 ]] || complain "--best lists $(rows --best cycles | wc -l) runs, not ten"
[[ $(rows --best cycles --top 100 | column 10) == "$(rows --best cycles --top 100 | column 10 | sort -n)" ]] || complain "--best is not in order"
[[ $(rows --best cycles:most --top 100 | column 10) == "$(rows --best cycles --top 100 | column 10 | sort -nr)" ]] || complain "--best :most is not in order"
least=$(rows --best cycles --top 1 | column 10) most=$(rows --best cycles:most --top 1 | column 10)
((least < most)) || complain "all runs take $least cycles"
[[ $(rows --cheapest cycles | column 10) == "$least" ]] || complain "--cheapest differs from the first of --best"
# The cheapest machine that meets a bound: the narrowest channel that is fast enough, by the table of all.
rows --best memory_mhz --bound "memory_bytes_per_clock<=1" --bound "cycles>=0" --top 100 | grep ' layer_peel ' >"$work/narrow"
middle=$(sed -n 2p "$work/narrow" | column 12)
[[ $(column 10 <"$work/narrow" | xargs) == "1 2 4" ]] || complain "costs that are machine keys: $(<"$work/narrow")"
[[ $(rows --cheapest memory_mhz --bound "cycles<=$middle" --bound "memory_bytes_per_clock<=1" | column 10) -le 2 ]] || complain "a bound of $middle cycles: $(rows --cheapest memory_mhz --bound "cycles<=$middle")"
expect 0 "| elsewhere/four.rtxt | no run meets all bounds |" sweep "$levels" --no-run --cheapest memory_mhz --bound "cycles<=$((least - 1))"
expect 0 "no run is exact and meets all bounds" sweep "$levels" --no-run --cheapest bytes --exact --bound "cycles<=1e0"
expect 0 "| seconds_at_clock | memory_bytes | exact |" sweep "$levels" --no-run --best seconds_at_clock --bound "memory_bytes>=1" --bound "exact>=1"
[[ $(rows --best bytes --bound "passes<=8" --top 100) == "$(rows --best plane_bytes --bound "geometry_passes<=8" --top 100)" ]] || complain "bytes and passes"
[[ $(rows --best plane_bytes --detail function --top 100 | wc -l) == 12 ]] || complain "--detail function"
# A level that has not run yet: nothing is compared, and it is said.
sed -i 's/^detail.*/detail: [function, traffic, cycle]/; s/1\.\.4/1..8/' "$levels"
expect 0 "4 runs of the level cycle are not there yet." sweep "$levels" --no-run --cheapest cycles
expect 0 "no run |" sweep "$levels" --no-run --cheapest bytes --detail traffic
finish
