#!/usr/bin/env bash
# `ropsim order` from outside: its file, its JSON, what it refuses.
source "$(dirname "$0")/check.bash"

cat >"$work/four.rtxt" <<'END'
ropsim-trace 1
size 4 1
draw four transparent 6 6
f 0 0 0.2 1 0 0 0.5 0
f 3 0 0.3 1 0 0 0.5 0
f 0 0 0.4 1 0 0 0.5 1
f 1 0 0.4 1 0 0 0.5 1
f 0 0 0.6 1 0 0 0.5 2
f 2 0 0.6 1 0 0 0.5 2
f 3 0 0.1 1 0 0 0.5 3
END
expect 0 "4 in 4 layers" order "$work/four.rtxt" -o "$work/order.txt" --json "$work/order.json"
[[ $(tr '\n' ',' <"$work/order.txt") == "3 0,0 1,1 2,2 3," ]] || complain "the order is $(cat "$work/order.txt")"
for want in '"rule": "exact"' '"layers": 4' '"pairs_wrong": 0' '"behind_cycles": \[\]'; do
    grep -q "$want" "$work/order.json" || complain "$want is not in $(cat "$work/order.json")"
done
tr -d ' \n' <"$work/order.json" | grep -q '"without_fragment":\[4,5\]' || complain "4 and 5 are not named as without a fragment"
expect 0 "1 neighbours are out of order" order "$work/four.rtxt" -o "$work/order.txt" --printed
expect 0 "3 x 3 blocks" order "$work/four.rtxt" -o "$work/order.txt" --blocks 3

# Each in front of the other at one of two pixels.
cat >"$work/cycle.rtxt" <<'END'
ropsim-trace 1
size 2 1
draw a transparent
f 0 0 0.2 1 0 0 0.5 7
f 1 0 0.3 1 0 0 0.5 7
f 1 0 0.2 1 0 0 0.5 8
f 0 0 0.3 1 0 0 0.5 8
END
expect 0 "2 primitives lie on cycles and 0 behind them" order "$work/cycle.rtxt" -o "$work/order.txt"
[[ ! -s $work/order.txt ]] || complain "a cycle was ordered: $(cat "$work/order.txt")"

rm -f "$work/order.txt"
expect 2 "give the file to write: -o FILE" order "$work/four.rtxt"
expect 2 "no trace was named" order -o "$work/order.txt"
expect 2 "--blocks is \`x\`" order "$work/four.rtxt" -o "$work/order.txt" --blocks x
expect 2 "--blocks is \`-1\`" order "$work/four.rtxt" -o "$work/order.txt" --blocks -1
expect 3 "cannot be opened" order "$work/none.ropt" -o "$work/order.txt"
expect 1 "no programmable ROP" order "$work/four.rtxt" -o "$work/order.txt" --machine g80
expect 1 "stencil of 1 bit" order "$work/four.rtxt" -o "$work/order.txt" --set stencil_bits=1
sed 's/^size 4 1/size 32768 32768/' "$work/four.rtxt" >"$work/vast.rtxt"
expect 1 "the budget is 4096 MiB" order "$work/vast.rtxt" -o "$work/order.txt"
head -c 90 "$work/four.rtxt" >"$work/cut.rtxt"
expect 1 "cut.rtxt:" order "$work/cut.rtxt" -o "$work/order.txt"
[[ ! -e $work/order.txt ]] || complain "a run that failed left a file"
expect 3 "cannot be written" order "$work/four.rtxt" -o "$work/no/folder/order.txt"
finish
