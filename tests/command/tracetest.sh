#!/usr/bin/env bash
# `ropsim test`: its exit codes, its last line, its options.
source "$(dirname "$0")/check.bash"

mkdir "$work/tests" "$work/none"
cat >"$work/tests/good.rtest" <<'TEXT'
trace
    size 1 1
    draw glass transparent
    f 0 0 0.5  1 0 0 0.5  1
end trace
program layer_peel ideal_coherent_layer_peel
expect pixel 0 0  0.5 0 0
TEXT
sed 's/0.5 0 0/0.25 0 0/' "$work/tests/good.rtest" >"$work/bad.rtest"
# Names of files are seen from the test, wherever the command runs.
printf 'ropsim-trace 1\nsize 1 1\ndraw glass transparent\nf 0 0 0.5  1 0 0 0.5  1\n' >"$work/tests/one.rtxt"
printf 'fixed_function: true\n' >"$work/tests/short.yaml"
cp "$source_folder/programs/layer_peel.rop" "$work/tests/mine.rop"
cat >"$work/tests/beside.rtest" <<'TEXT'
trace one.rtxt
program mine.rop
expect exact
program mine.rop
machine short.yaml
expect error "short.yaml"
TEXT

expect 0 "4 passed, 0 failed" test "$work/tests"
expect 0 "1..4" test "$work/tests" --tap
expect 1 "0 passed, 2 failed" test "$work/bad.rtest"
expect 1 "2 passed, 2 failed" test "$work/bad.rtest" "$work/tests/good.rtest"
expect 1 "expected figures replaced by those seen: 1" test "$work/bad.rtest" --bless
expect 0 "2 passed, 0 failed" test "$work/bad.rtest" --junit "$work/out.xml"
grep -q '<testsuites tests="2" failures="0"' "$work/out.xml" || complain "no JUnit totals"
expect 0 "expect iterations" test --expectations
expect 1 "holds no file that ends in .rtest" test "$work/none"
expect 2 "test files or folders of them are wanted" test
expect 2 "has no option" test "$work/tests" --blss
expect 3 "cannot be opened" test "$work/nowhere"
expect 3 "cannot be written" test "$work/tests" --junit "$work/nowhere/out.xml"
finish
