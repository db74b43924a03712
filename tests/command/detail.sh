#!/usr/bin/env bash
# `ropsim run --detail`: what deeper levels print and write, that they leave the image alone, and what is refused.
source "$(dirname "$0")/check.bash"

cat >"$work/two.rtxt" <<'TEXT'
ropsim-trace 1
size 2 1
background 0 0 1 1
draw glass transparent
f 0 0 0.75  0 1 0 1    1
f 0 0 0.25  1 0 0 0.5  2
TEXT

run() { expect "$1" "$2" run layer_peel "$work/two.rtxt" "${@:3}"; }
has() { grep -q "$2" "$work/$1" || complain "$1 has no $2"; }
has_not() { ! grep -q "$2" "$work/$1" || complain "$1 has $2"; }

run 0 "" --image "$work/function.pfm" --json "$work/function.json"
run 0 "hit rates" --detail traffic --image "$work/traffic.pfm" --json "$work/traffic.json" --csv "$work/traffic.csv"
run 0 "until all is drained" --detail cycle --image "$work/cycle.pfm" --json "$work/cycle.json" --csv "$work/cycle.csv" \
    --timeline "$work/timeline.json" --requests "$work/requests.csv"
run 0 "bound by" --detail cycle --threads 2 --csv "$work/again.csv"

# The image is the function level's, and threads change nothing.
for level in traffic cycle; do
    cmp "$work/function.pfm" "$work/$level.pfm" || complain "--detail $level gives another image"
    has $level.json "\"detail\": \"$level\""
    has $level.json '"memory": {'
    has $level.json '"machine_keys": {'
    has $level.json '"depth_lookups"'
    head -1 "$work/$level.csv" | grep -q '^scope,index,number,kind,name,iteration,.*memory_bytes_read' ||
        complain "$level.csv has no header"
    for scope in total pass draw iteration; do has $level.csv "^$scope,"; done
    fields=$(awk -F, '{print NF}' "$work/$level.csv" | sort -u | wc -l)
    [[ $fields == 1 ]] || complain "lines of $level.csv differ in their number of columns"
done
cmp "$work/cycle.csv" "$work/again.csv" || complain "two threads give other cycles"
for key in cycles drained_cycles seconds_at_clock bound_cycles bounds; do
    has cycle.json "\"$key\""
    has_not traffic.json "\"$key\""
done
has timeline.json '"traceEvents"'
[[ -s $work/requests.csv ]] || complain "no requests were written"
# Bytes do not depend on time: both levels count the same.
bytes() { grep -A2 '"memory": {' "$work/$1.json"; }
[[ $(bytes traffic) == "$(bytes cycle)" ]] || complain "traffic and cycle count other bytes: $(bytes traffic) $(bytes cycle)"
for format in dramsim3 ramulator ramulator2; do
    run 0 "" --detail cycle --requests "$work/requests.$format" --requests-format $format
    [[ -s $work/requests.$format ]] || complain "no requests of the format $format"
done

run 2 '--detail is `cycles`, but must be function, traffic, cycle or sampled' --detail cycles
run 2 "--csv wants --detail traffic, cycle or sampled" --csv "$work/no.csv"
run 2 "--timeline wants --detail cycle" --timeline "$work/no.json"
run 2 "--timeline wants --detail cycle" --detail traffic --timeline "$work/no.json"
run 2 "--requests wants --detail cycle" --detail traffic --requests "$work/no.txt"
run 2 "there is no channel 6: the machine has 6, numbered from 0" --detail cycle --requests "$work/no.txt" --requests-channel 6
run 2 "--requests-channel wants --requests FILE" --detail cycle --requests-channel 0
run 2 "--requests-format wants --requests FILE" --detail cycle --requests-format csv
run 2 '--requests-format is `trace`, but must be dramsim3' --detail cycle --requests "$work/no.txt" --requests-format trace
run 3 "cannot be written" --detail cycle --timeline "$work/none/timeline.json"
run 3 "cannot be written" --detail traffic --csv "$work/none/two.csv"
run 3 "cannot be written" --detail cycle --json "$work/none/two.json"
run 1 "depth_cache_bytes is 1000, but must be a multiple of" --set depth_cache_bytes=1000
expect 1 "region_pixels" machine --set region_pixels=12
ls "$work"/no.* 2>/dev/null && complain "a refused run wrote a file"

expect 0 "| \`depth_misses\` | lines | traffic |" statistics
expect 0 "| \`samples_per_clock\` | samples a clock | cycle |" statistics
expect 2 "it takes no operand" statistics all
finish
