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

# Times: the card's three programs on table 1's rows beside its frame rates, hybrid peeling on the slices alone.
times=(--size 32x32 --figure-size 32x32 --slices 8 --buckets 64)
"$ropsim" papers --time "dragon=$work/eight.obj" "${times[@]}" -o "$work/time" >"$work/page" 2>"$work/said" ||
    complain "papers --time failed: $(cat "$work/said")"
[[ ! -s $work/said ]] || complain "papers --time said: $(cat "$work/said")"
says "Slices at 32 x 32 pixels, meshes at 32 x 32"
says "| 2 | hybrid_layer_peel |  | 3 | 5 / 3 |"
says "| 8 | layer_peel |  | 11 | 21 / 21 |"
says "The paper, of 256 slices: section 8: 52 to 1; figure 1: 62x."
says "| 35 | 147 | 1.00 | 1.00 | +0 % |"   # 150 000 faces x 28 passes x 35 frames a second, in millions
says "| 51 | 138 | 1.46 | 1.56 |"
says "| 53 | 119 | 1.51 | 1.87 |"
says "4 of 4 ratios of table 1."            # two layers have nothing to gain from coherence
grep -qE '^\| dragon_front \| coherent_layer_peel_a \|  \| 2 \| 12 \|' "$work/page" || complain "no row of A"
# 3 counts of slices with 4 programs, 2 views with 3. What a row says, its JSON says.
[[ $(wc -l <"$work/time/time.csv") == $((1 + 3 * 4 + 2 * 3)) ]] || complain "time.csv has $(wc -l <"$work/time/time.csv") lines"
cycles=$(grep -E '^\| dragon_side \| layer_peel ' "$work/page" | cut -d'|' -f7 | tr -d ' ')
grep -q "\"drained_cycles\": $cycles\b" "$work/time/dragon_side.layer_peel.card.json" || complain "the JSON has not $cycles cycles"
"$ropsim" run layer_peel "$work/side.ropt" --machine g80 --detail cycle >/dev/null || complain "g80 does not run layer_peel"

# Where 24 bits let depths fall together, a float depth buffer is timed as well: two triangles of one 24-bit depth, one behind.
printf 'v %s\n' '-1 -1 0' '1 -1 0' '0 1 0' '-1 -1 -3e-9' '1 -1 -3e-9' '0 1 -3e-9' '-1 -1 -1' '1 -1 -1' '0 1 -1' >"$work/near.obj"
printf 'f %s\n' '1 2 3' '4 5 6' '7 8 9' >>"$work/near.obj"
"$ropsim" papers --time "$work/near.obj" "${times[@]}" >"$work/page" 2>"$work/said" || complain "papers --time failed: $(cat "$work/said")"
says "| near_front | layer_peel |  | 3 | 5 |"
says "| near_front | layer_peel | z32f | 4 | 7 |"
grep -qE 'near_side.*z32f' "$work/page" && complain "a float depth buffer is timed that changes nothing"

# The gain: more slots never cost time, and without guarded slots a kernel is never slower.
"$ropsim" papers --gain scene:knot,rings=12,sides=6 "${times[@]}" --svg "$work/gain.svg" -o "$work/gain" >"$work/page" 2>"$work/said" ||
    complain "papers --gain failed: $(cat "$work/said")"
says "## knot_rings_12_sides_6_front"
says "## slices_8"
says "- \`two_ended_lean_peel\`: from both ends"
awk -F'|' '/^\| [a-z_,=0-9]+ \| [01] \| [0-9]+ \|/ {
    for (i = 6; i <= 10; i++) if ($i !~ /=/ && $i + 0 > $(i - 1) * 1.02) { print "more slots, more time: " $0; exit 1 }
    if ($3 + 0 == 1) first = $5; else if ($5 + 0 > first + 0) { print "free guarded instructions cost time: " $0; exit 1 } }' "$work/page" || complain "$(tail -1 "$work/page")"
grep -q "</svg>" "$work/gain.svg" || complain "no plot"
grep -q 'stroke-dasharray="5 3"' "$work/gain.svg" || complain "the plot has no dashed line"
grep -q '^slices_8,"coherent_back_peel,spans=1",programmable,z24_guarded_1_slots_6,z24,rgba8,6,1,' "$work/gain/gain.csv" || complain "no such row in gain.csv"
expect 2 "--svg wants --gain" papers --time --svg "$work/x.svg" scene:knot
expect 2 "--grid is" papers --time --grid 0

expect 2 "did you mean \`dragon\`" papers "dragn=$work/eight.obj"
expect 2 "table 1 wants a mesh file" papers dragon=scene:knot
expect 2 "two meshes are called \`eight\`" papers "$work/eight.obj" "$work/eight.obj"
expect 2 "is not WxH" papers --size 64
expect 2 "--slices is" papers --slices 0
expect 3 "none.obj" papers "$work/none.obj"
expect 3 "cannot be made" papers scene:knot -o "$work/none/out"
TMPDIR=$work/none expect 3 "cannot be made" papers scene:knot
finish
