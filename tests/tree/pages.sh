#!/usr/bin/env bash
# Pages that the command prints are in step with what is committed. To renew one, run the line that it opens with.
source_folder=$1 ropsim=$2/ropsim
"$ropsim" machine --keys >"$2/machine_keys.md" || exit 1
# The page is the table between prose: the lines that begin with a bar.
if ! diff <(grep '^|' "$source_folder/docs/machines.md") "$2/machine_keys.md"; then
    echo "docs/machines.md is not what \`ropsim machine --keys\` prints (above: < page, > command)"
    exit 1
fi

"$ropsim" statistics | grep '^|' >"$2/statistics.md" || exit 1
if ! diff <(grep '^|' "$source_folder/docs/statistics.md") "$2/statistics.md"; then
    echo "docs/statistics.md is not what \`ropsim statistics\` prints (above: < page, > command)"
    exit 1
fi

# Both tables of the instruction set stand in its page, row by row.
"$ropsim" isa | grep '^| [0-9]' >"$2/isa_rows.md" || exit 1
if ! diff <(grep -E '^\| [0-9]+ \| `' "$source_folder/docs/isa.md") "$2/isa_rows.md"; then
    echo "docs/isa.md is not what \`ropsim isa\` prints (above: < page, > command)"
    exit 1
fi
# Its worked example is a program, and every shipped program is explained.
awk '/^\*An algorithm\*/{seen=1} seen && /^    program /{on=1} on && /^    ropsim /{exit} on{sub(/^    /, ""); print}' "$source_folder/docs/isa.md" >"$2/example.rop"
"$ropsim" verify "$2/example.rop" --machine programmable || exit 1
for file in "$source_folder"/programs/*.rop; do
    name=$(basename "$file" .rop)
    grep -q "^## $name\$" "$source_folder/docs/programs.md" || { echo "docs/programs.md has no section $name"; exit 1; }
done

# Every key that a result has is explained: in the page of results, or as a row of the tables of machine keys and statistics.
"$ropsim" demo scene:knot,rings=8 --size 16 --out "$2/pages_demo" >/dev/null || exit 1
"$ropsim" run layer_peel "$2/pages_demo/knot_rings_8.ropt" --detail cycle --json "$2/pages_demo/cycle.json" >/dev/null || exit 1
"$ropsim" run layer_peel "$2/pages_demo/knot_rings_8.ropt" --detail sampled --json "$2/pages_demo/sampled.json" >/dev/null || exit 1
keys=$(grep -ohE '"[a-z_0-9]+":' "$2"/pages_demo/*.json | tr -d '":' | sort -u)
for key in geometry_passes line_bytes bound_by unit_wait_data; do
    [[ $keys == *$key* ]] || { echo "no key $key found in the JSON of results"; exit 1; }
done
for key in $keys; do
    grep -qE "[\`.]$key\`" "$source_folder/docs/results.md" ||
        grep -qE "^\| \`$key\` \|" "$2/machine_keys.md" "$2/statistics.md" ||
        [[ $key == fragments || $key == planes || $key == transparent || $key == sorted ||
            $key == passes || $key == draws || $key == by_iteration || $key == memory || $key == occupancy || $key == sampling ]] ||
        { echo "docs/results.md does not explain the key $key"; exit 1; }
done
