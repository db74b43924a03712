#!/usr/bin/env bash
# `ropsim machine`: shipped machines, files, settings, and the round trip of what it prints.
source "$(dirname "$0")/check.bash"

expect 0 "programmable" machine --list
expect 0 '| `depth_format` | z16, z24 or z32f |' machine --keys
expect 0 "depth_format: z24" machine g80
expect 0 "fixed_function: false" machine
expect 0 "depth_format: z16" machine g80 --set depth_format=z24 --set depth_format=z16
expect 1 'did you mean `tiny`?' machine tinny
expect 1 'did you mean `depth_format`?' machine tiny --set dept_format=z16
expect 1 'must be z16, z24 or z32f' machine tiny --set depth_format=z17
expect 2 'KEY=VALUE' machine tiny --set depth_format
expect 2 'one machine at a time' machine tiny g80
expect 3 'cannot be opened' machine "$work/none.yaml"

for machine in $("$ropsim" machine --list); do
    "$ropsim" machine "$machine" --set planes_max=5 >"$work/printed.yaml"
    "$ropsim" machine "$work/printed.yaml" | grep -v '^#' >"$work/again"
    grep -v '^#' "$work/printed.yaml" | cmp -s - "$work/again" || complain "$machine does not read back as it was printed"
done

sed 's/^planes_max: 5/planes_max: 5k/; s/^opcodes/opcode/' "$work/printed.yaml" >"$work/broken.yaml"
expect 1 "broken.yaml:8:1: unknown key \`opcode\`; did you mean \`opcodes\`?" machine "$work/broken.yaml"
expect 1 "broken.yaml:10:13: planes_max is \`5k\`, but must be an integer from 1 to 32 (planes)" machine "$work/broken.yaml"
expect 1 "missing key opcodes" machine "$work/broken.yaml"

# ROPSIM_DATA comes before what the command was built from.
mkdir -p "$work/data/machines"
cp "$work/printed.yaml" "$work/data/machines/mine.yaml"
ROPSIM_DATA=$work/data expect 0 "planes_max: 5" machine mine
expect 1 'no machine is called `mine`' machine mine
finish
