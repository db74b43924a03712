#!/usr/bin/env bash
# `ropsim trade`: a row a level, the seeds' table, its JSON, what it refuses; and what a sampled run prints.
source "$(dirname "$0")/check.bash"

"$ropsim" record scene:soup,count=400 --size 96x96 -o "$work/soup.ropt" >/dev/null || complain "no trace was recorded"
"$ropsim" trade "$work/soup.ropt" --program layer_peel --machine g80 --machine tiny --sample-window 32 --sample-every 4 --seeds 3 \
    --json "$work/trade.json" >"$work/trade.md" || complain "trade failed"
for level in function traffic cycle sampled; do
    for machine in g80 tiny; do
        grep -q "| layer_peel | $machine | $level |" "$work/trade.md" || complain "no row of $level on $machine: $(cat "$work/trade.md")"
    done
done
grep -q "| layer_peel | g80 | 3 |" "$work/trade.md" || complain "no row of three seeds"
for key in '"visits_per_second"' '"again_cpu_seconds"' '"peak_mib"' '"cycles_half_width"' '"bytes_covered"' '"seed": 3' '"bias_percent"'; do
    grep -q "$key" "$work/trade.json" || complain "trade.json has no $key"
done
expect 0 "| layer_peel | programmable | sampled |" trade "$work/soup.ropt" --program layer_peel
expect 0 "left out" trade "$work/soup.ropt" --program layer_peel --program fused_coherent_layer_peel --machine g80
expect 1 "none of the programs runs" trade "$work/soup.ropt" --program fused_coherent_layer_peel --machine g80
expect 2 "a trace is wanted" trade
expect 2 "--seeds is \`0\`" trade "$work/soup.ropt" --seeds 0
expect 2 "--sample-every is \`1\`" trade "$work/soup.ropt" --sample-every 1
expect 3 "cannot be" trade "$work/none.ropt"

expect 0 "95 % confidence" run layer_peel "$work/soup.ropt" --machine g80 --detail sampled --csv "$work/sampled.csv"
grep -q '^half_width,0,' "$work/sampled.csv" || complain "no half widths in the CSV"
fields=$(awk -F, '{print NF}' "$work/sampled.csv" | sort -u | wc -l)
[[ $fields == 1 ]] || complain "lines of sampled.csv differ in their number of columns"
finish
