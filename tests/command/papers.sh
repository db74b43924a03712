#!/usr/bin/env bash
# `ropsim papers`: figure 1 with fewer slices, a mesh in a model's place, results in a folder, and what is refused.
source "$(dirname "$0")/check.bash"

# An octahedron: a ray that meets it does so twice, and the sort by centroid puts its halves in order. Its longest axis is x.
cat >"$work/eight.obj" <<'OBJ'
v 2 0 0
v -2 0 0
v 0 1 0
v 0 -1 0
v 0 0 1
v 0 0 -1
f 1 3 5
f 3 2 5
f 2 4 5
f 4 1 5
f 3 1 6
f 2 3 6
f 4 2 6
f 1 4 6
OBJ
export TMPDIR=$work/traces
mkdir "$TMPDIR"
small=(--size 64x64 --figure-size 64x64 --slices 16 --buckets 64)
"$ropsim" papers "dragon=$work/eight.obj" "$work/eight.obj" scene:knot,rings=24,sides=8 "${small[@]}" -o "$work/out" \
    >"$work/page" 2>"$work/said" || complain "papers failed: $(cat "$work/said")"
[[ ! -s $work/said ]] || complain "papers said: $(cat "$work/said")"
[[ -z $(ls -A "$TMPDIR") ]] || complain "traces are left: $(ls "$TMPDIR")"

says() {
    checks=$((checks + 1))
    grep -qF -- "$1" "$work/page" || complain "the page has no line with: $1"
}
# 16 slices and two sides of the cone: 18 layers. The cone comes last, so that its sides end the spans.
says "| layer_peel | 19 | 37 | 37 | 0 | exact |"
says "| layer_peel_everitt | 19 | 19 | 19 | 19 | exact |"
says "| hybrid_layer_peel | 3 | 5 | 3 | 0 | exact |"
says "| hybrid_layer_peel_closed | 3 | 5 | 3 | 2 | exact |"
says "| coherent_layer_peel_a | 4 | 24 | 24 | 0 | exact |"
says "| coherent_layer_peel_b | 4 | 20 | 20 | 0 | exact |"
says "| ideal_coherent_layer_peel | 4 | 7 | 7 | 0 | exact |"
says "| fused_coherent_layer_peel | 4 | 4 | 4 | 4 | exact |"
says "| two_ended_coherent_layer_peel | 3 | 3 | 3 | 4 | exact |"
grep -qE '^\| sorted_blend \| 0 \| 1 \| 1 \| 0 \| [1-9][0-9]* wrong' "$work/page" || complain "sorted_blend is exact with the cone last"
says "  - 16 slices here, 256 in the paper."
says "the paper 257, here 19 with the empty iteration, 18"
says "hybrid layer peeling: the paper 3, here 3 with the empty iteration: agrees. 5 passes of the unsorted draw, 3 of the"
# The octahedron, in front-to-back order and reversed, as the columns stand: bucket, file, front, back, shuffle.
says "| dragon front | 150K | 8 | 2 | 2.00 | 3 it, 18 g | 2 it, 12 g | 3 it, 15 g | 2 it, 10 g | 14 it, 28 g | 3 it, 5 g |"
says "| eight side | – | 8 | 2 | 2.00 | – | 2 it, 12 g | – | 2 it, 10 g | – | 3 it, 5 g |"
says "| layer_peel | 3 / 5 | 3 / 5 | 3 / 5 | 3 / 5 | 3 / 5 |"
says "| lucy end | 250K | – | – | – | 3 it, 18 g | – | 3 it, 15 g | – | 22 it, 44 g | – |"
says "The mesh has 8 faces, the paper's 150K: it is another one, or reduced."
says "layer peeling: the paper 14, here 3 with the empty iteration, 2 without: differs. The deepest sample has 2 layers here."
says "Of 6 counts of table 1, 0 agree with the empty iteration, 0 without it, 6 in neither way."
says "Looks along x: \`--fov 30 --eye 5.88755,0,0 --target 0,0,0 --up 0,1,0\`."
grep -qF "### eight_end" "$work/page" && complain "a view is measured twice: the longest axis is x"

# The printed camera is the one used: a trace by hand has as many fragments.
fragments=$(grep -A2 '^### eight_side' "$work/page" | grep -oE '[0-9]+ fragments' | head -1 | cut -d' ' -f1)
"$ropsim" record "$work/eight.obj" -o "$work/side.ropt" --size 64x64 --fov 30 --eye 5.88755,0,0 --target 0,0,0 --up 0,1,0
expect 0 "\"fragments\": $fragments," info "$work/side.ropt" --json

# 3 traces of figure 1 with 11 programs; 2 + 2 + 1 views in 5 orders with the 9 that need no sorted draws.
[[ $(wc -l <"$work/out/papers.csv") == $((1 + 3 * 11 + 25 * 9)) ]] || complain "papers.csv has $(wc -l <"$work/out/papers.csv") lines"
[[ $(find "$work/out" -name '*.json' | wc -l) == $((3 * 11 + 25 * 9)) ]] || complain "not a JSON file a run"
grep -q '^figure1,sorted,hybrid_layer_peel,64,64,.*,18,3,8,5,3,0,0,1,' "$work/out/papers.csv" || complain "no such row in papers.csv"
grep -q '"trace": "dragon_side_back"' "$work/out/dragon_side_back.layer_peel.json" || complain "a result does not name its case"

expect 2 "did you mean \`dragon\`" papers "dragn=$work/eight.obj"
expect 2 "table 1 wants a mesh file" papers dragon=scene:knot
expect 2 "two meshes are called \`eight\`" papers "$work/eight.obj" "$work/eight.obj"
expect 2 "is not WxH" papers --size 64
expect 2 "--slices is" papers --slices 0
expect 3 "none.obj" papers "$work/none.obj"
expect 3 "cannot be made" papers scene:knot -o "$work/none/out"
TMPDIR=$work/none expect 3 "cannot be made" papers scene:knot
finish
