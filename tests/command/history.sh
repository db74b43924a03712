#!/usr/bin/env bash
# `ropsim history`: text and JSON of one sample, less of it, files, and what is refused.
source "$(dirname "$0")/check.bash"
trace=$source_folder/traces/finished_sample.rtxt

expect 0 "pass 1 (iteration 1, its pass 1): draw transparent with search" history ideal_coherent_layer_peel "$trace" --sample 0,0
expect 0 "if changed: 1 here, 4 over the image: yes" history ideal_coherent_layer_peel "$trace" --sample 0,0
expect 0 "colour 0.125 0.25 0.5" history ideal_coherent_layer_peel "$trace" --sample 1,0,0
# What is printed wrong, seen: a finished sample's layer is composited again in the third iteration.
expect 0 "z 0.5 = z_peel 0.5: yes; composited" history ideal_coherent_layer_peel_printed "$trace" --sample 0,0 --iteration 3
expect 0 "0.5 (8388608)" history layer_peel "$trace" --sample 0,0 --machine g80
expect 0 "0.500008 (32768)" history layer_peel "$trace" --sample 0,0 --set depth_format=z16

# Less of it: a pass of the run, a pass of an iteration.
"$ropsim" history layer_peel "$trace" --sample 1,0 --pass 3 >"$work/pass"
"$ropsim" history layer_peel "$trace" --sample 1,0 --iteration 2 --pass 1 | cmp - "$work/pass" || complain "pass 3 is not pass 1 of iteration 2"
[[ $(grep -c '^pass' "$work/pass") == 1 ]] || complain "--pass 3 shows more than one pass: $(cat "$work/pass")"
expect 0 "ends" history layer_peel "$trace" --sample 1,0 --max-iterations 1
[[ $("$ropsim" history layer_peel "$trace" --sample 1,0 --max-iterations 1 | grep -c '^iteration') == 1 ]] || complain "--max-iterations 1 runs more"
expect 0 "1 here, 1 over the image: ends" history layer_peel "$trace" --sample 1,0 --occlusion-ratio 0.5

# JSON, to stdout and to a file; what comes out does not depend on threads.
expect 0 '"event": "clip"' history layer_peel "$trace" --sample 1,0 --json
expect 0 "" history layer_peel "$trace" --sample 1,0 --json -o "$work/h.json"
"$ropsim" history layer_peel "$trace" --sample 1,0 --json --threads 2 | cmp - "$work/h.json" || complain "file and stdout differ"
if command -v python3 >/dev/null; then
    python3 -m json.tool "$work/h.json" >/dev/null || complain "--json prints no JSON"
fi
# Every key is explained.
for key in $(grep -oE '"[a-z_]+":' "$work/h.json" | tr -d '":' | sort -u); do
    grep -q "\`$key\`" "$source_folder/docs/history.md" || complain "docs/history.md does not explain the key $key"
done

expect 2 "x is 0 to 1, y is 0 to 0, the sample is 0" history layer_peel "$trace" --sample 2,0
expect 2 "x is 0 to 0, y is 0 to 0, the sample is 0 to 3" history layer_peel "$source_folder/traces/edge_samples.rtxt" --sample 0,0,4
for text in 1 1, ,1 1,x 1,0,0,0 -1,0 "" 99999999999,0; do
    expect 2 "must be X,Y or X,Y,S" history layer_peel "$trace" "--sample=$text"
done
expect 2 "--sample X,Y[,S] is wanted" history layer_peel "$trace"
expect 2 "a program and a trace are wanted" history layer_peel --sample 0,0
expect 2 "one program and one trace" history layer_peel "$trace" "$trace" --sample 0,0
expect 1 "there is no pass 99: the schedule ran 7 passes in 4 iterations" history layer_peel "$trace" --sample 0,0 --pass 99
expect 1 "there is no iteration 9" history layer_peel "$trace" --sample 0,0 --iteration 9
expect 1 "did you mean \`layer_peel\`" history layer_pel "$trace" --sample 0,0
expect 1 "no programmable ROP" history ideal_coherent_layer_peel "$trace" --sample 0,0 --machine g80
expect 3 "none.rtxt" history layer_peel "$work/none.rtxt" --sample 0,0
expect 3 "cannot be written" history layer_peel "$trace" --sample 0,0 -o "$work/none/h.txt"
expect 1 "there is no pass 99" history layer_peel "$trace" --sample 0,0 --pass 99 -o "$work/refused"
[[ ! -e $work/refused ]] || complain "a refused history left a file"
finish
