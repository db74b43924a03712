#!/usr/bin/env bash
# The frame of the command: help, version, what is off in its words, exit statuses.
source "$(dirname "$0")/check.bash"

expect 0 "usage: ropsim" --help
expect 0 "ropsim 0." --version
expect 2 "usage: ropsim"
expect 2 'there is no command `recrod`' recrod
expect 2 'did you mean `machine`?' mahcine
expect 2 'has no option `--lits`; did you mean `--list`?' machine --lits
expect 2 'has no option `-z`' machine -z
expect 2 '--list takes no value' machine --list=3
expect 2 '--set wants KEY=VALUE after it' machine --set

# Every command that --help lists explains its own options.
commands=$("$ropsim" --help | sed -n 's/^  \([a-z]\{2,\}\) .*/\1/p')
[[ $commands == *machine* ]] || complain "machine is not among: $commands"
for command in $commands; do
    expect 0 "usage: ropsim $command" "$command" --help
    expect 2 "" "$command" --no-such-option
done

# What cannot reach stdout is an input or output failure.
status=0
"$ropsim" machine tiny >/dev/full 2>"$work/said" || status=$?
[[ $status == 3 ]] || complain "a full disk gives exit status $status, not 3"

# Starting must not cost what OpenImageIO costs.
if ldd "$ropsim" | grep -q OpenImageIO; then complain "the command links OpenImageIO"; fi
finish
