#!/usr/bin/env bash
# `ropsim run`: one pixel by hand, its files, and what is refused.
source "$(dirname "$0")/check.bash"

# Two layers over a blue background: red 0.5 in front of green 1 gives (0.5, 0.5, 0), recorded back to front.
cat >"$work/two.rtxt" <<'TEXT'
ropsim-trace 1
size 2 1
background 0 0 1 1
draw glass transparent
f 0 0 0.75  0 1 0 1    1
f 0 0 0.25  1 0 0 0.5  2
TEXT

for program in layer_peel coherent_layer_peel_a ideal_coherent_layer_peel; do
    expect 0 "geometry passes" run "$program" "$work/two.rtxt" --image "$work/$program.pfm" --json "$work/$program.json"
    # The PFM's header, then two pixels of three little-endian floats.
    pixels=$(tail -c 24 "$work/$program.pfm" | od -An -tf4 -w24 | tr -s ' ')
    [[ $pixels == " 0.5 0.5 0 0 0 1" ]] || complain "$program gives the pixels$pixels"
    grep -q '"exact": true' "$work/$program.json" || complain "$program is not exact"
    grep -q '"detail": "function"' "$work/$program.json" || complain "no level of detail in $program.json"
done

# The same bytes whatever the number of threads.
expect 0 "" run layer_peel "$work/two.rtxt" --threads 2 --image "$work/threads.pfm"
cmp "$work/layer_peel.pfm" "$work/threads.pfm" || complain "two threads give another image"
expect 0 "not computed" run layer_peel "$work/two.rtxt" --no-reference
expect 0 "" run "$source_folder/programs/layer_peel.rop" "$work/two.rtxt" --image "$work/two.png" --machine tiny
expect 0 "z24" run layer_peel "$work/two.rtxt" --machine g80
expect 0 "z16" run layer_peel "$work/two.rtxt" --machine g80 --set depth_format=z16

expect 2 "a program and a trace are wanted" run layer_peel
expect 2 "one program and one trace" run layer_peel "$work/two.rtxt" "$work/two.rtxt"
expect 2 "--threads is \`two\`, but must be an integer from 0 to" run layer_peel "$work/two.rtxt" --threads two
expect 2 "--occlusion-ratio is \`2\`, but must be a number from 0 to 1" run layer_peel "$work/two.rtxt" --occlusion-ratio 2
expect 1 "did you mean \`layer_peel\`?" run layer_pel "$work/two.rtxt"
expect 1 "did you mean \`g80\`?" run layer_peel "$work/two.rtxt" --machine g8
expect 1 "g80" run ideal_coherent_layer_peel "$work/two.rtxt" --machine g80
expect 3 "none.rtxt" run layer_peel "$work/none.rtxt"
expect 3 "none.rop" run "$work/none.rop" "$work/two.rtxt"
expect 2 ".exr, .pfm or .png" run layer_peel "$work/two.rtxt" --image "$work/two.gif"
expect 3 "cannot be written" run layer_peel "$work/two.rtxt" --image "$work/none/two.pfm"
expect 3 "cannot be written" run layer_peel "$work/two.rtxt" --json "$work/none/two.json"
finish
