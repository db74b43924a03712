#!/usr/bin/env bash
# `ropsim demo`: scenes to table, pictures and JSON, small enough to take no time.
source "$(dirname "$0")/check.bash"

expect 0 "| ideal_coherent_layer_peel" demo scene:slices_cone,slices=8 scene:knot --size 64 --out "$work/out" --threads 2
for label in slices_cone_slices_8 knot; do
    [[ -s $work/out/$label.ropt ]] || complain "no trace of $label"
    for program in layer_peel coherent_layer_peel_a ideal_coherent_layer_peel; do
        [[ -s $work/out/$label.$program.png ]] || complain "no picture of $label by $program"
        grep -q '"exact": true' "$work/out/$label.$program.json" || complain "$label by $program is not exact"
    done
    cmp "$work/out/$label.layer_peel.png" "$work/out/$label.ideal_coherent_layer_peel.png" || complain "pictures of $label differ"
done
expect 2 "--size is" demo --size 0
expect 2 "no_such_scene" demo scene:no_such_scene --out "$work/out"
expect 3 "cannot be made" demo --out "$work/none/out"
finish
