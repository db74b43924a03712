#!/usr/bin/env bash
# Pages that the command prints are in step with what is committed. To renew one, run the line that it opens with.
source_folder=$1 ropsim=$2/ropsim
"$ropsim" machine --keys >"$2/machine_keys.md" || exit 1
# The page is the table between prose: the lines that begin with a bar.
if ! diff <(grep '^|' "$source_folder/docs/machines.md") "$2/machine_keys.md"; then
    echo "docs/machines.md is not what \`ropsim machine --keys\` prints (above: < page, > command)"
    exit 1
fi
