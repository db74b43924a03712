#!/usr/bin/env bash
# Pages that the command prints are in step with what is committed. To renew one, run the line that it opens with.
source_folder=$1 ropsim=$2/ropsim
"$ropsim" machine --keys >"$2/machine_keys.md" || exit 1
# The page is the table between prose: the lines that begin with a bar.
if ! diff <(grep '^|' "$source_folder/docs/machines.md") "$2/machine_keys.md"; then
    echo "docs/machines.md is not what \`ropsim machine --keys\` prints (above: < page, > command)"
    exit 1
fi

# Every key that a result has is explained.
"$ropsim" demo scene:knot,rings=8 --size 16 --out "$2/pages_demo" >/dev/null || exit 1
keys=$(grep -ohE '"[a-z_]+":' "$2"/pages_demo/*.json | tr -d '":' | sort -u)
[[ $keys == *geometry_passes* ]] || { echo "no keys found in the demo's JSON"; exit 1; }
for key in $keys; do
    grep -qE "[\`.]$key\`" "$source_folder/docs/results.md" ||
        [[ $key == fragments || $key == planes || $key == transparent || $key == sorted ]] ||
        { echo "docs/results.md does not explain the key $key"; exit 1; }
done
