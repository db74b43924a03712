#!/usr/bin/env bash
# `ropsim asm`, `disasm` and `verify`: words and back for every shipped program, what runs where, and what is refused.
source "$(dirname "$0")/check.bash"

for file in "$source_folder"/programs/*.rop; do
    program=$(basename "$file" .rop)
    expect 0 "words" asm "$program" -o "$work/words"
    expect 0 "words" asm "$work/words" -o "$work/again.ropb"
    cmp "$work/words" "$work/again.ropb" || complain "$program: assembling words changes them"
    expect 0 "program $program" disasm "$work/words"
    "$ropsim" disasm "$work/words" >"$work/text.rop"
    "$ropsim" disasm "$program" | cmp - "$work/text.rop" || complain "$program: canonical text from text and from words differ"
    "$ropsim" disasm "$work/text.rop" | cmp - "$work/text.rop" || complain "$program: canonical text is not a fixed point"
    # A machine on which any program runs, once its passes are lowered to kernels.
    room=(--machine abuffer --set planes_max=32 --set bits_per_sample_max=4096 --set instructions_max=256)
    "$ropsim" disasm "$program" --lowered "${room[@]}" >"$work/lowered.rop" || complain "$program cannot be lowered"
    if grep -q '^pass' "$work/lowered.rop"; then complain "$program: a pass is left after lowering"; fi
    expect 0 "runs on abuffer" verify "$work/lowered.rop" "${room[@]}"
    head -c -4 "$work/words" >"$work/cut"
    expect 1 "does not fit" disasm "$work/cut"
    head -c -3 "$work/words" >"$work/cut"
    expect 1 "words of 4 bytes" disasm "$work/cut"
    [[ $(head -c 4 "$work/words") == ROPB ]] || complain "$program: the words do not begin with ROPB"
done

# A program in words runs as its text does.
printf 'ropsim-trace 1\nsize 1 1\ndraw glass transparent\nf 0 0 0.5  1 0 0 0.5  1\n' >"$work/one.rtxt"
expect 0 "" asm layer_peel -o "$work/layer.ropb"
expect 0 "" run "$work/layer.ropb" "$work/one.rtxt" --image "$work/words.pfm"
expect 0 "" run layer_peel "$work/one.rtxt" --image "$work/text.pfm"
cmp "$work/words.pfm" "$work/text.pfm" || complain "the words of layer_peel give another image than its text"

expect 0 "layer_peel runs on g80" verify layer_peel --machine g80
expect 0 "runs on g80" verify layer_peel --machine g80 --set planes_max=5
expect 1 "layer_peel.rop:11: plane 'base' is one too many: the program has 5 planes, the machine takes 4 (machine g80)" \
    verify layer_peel --machine g80 --set planes_max=4
expect 1 "ideal_coherent_layer_peel.rop:25: 'search' is a kernel; the machine has no programmable ROP" \
    verify ideal_coherent_layer_peel --machine g80
expect 0 "| ideal_coherent_layer_peel | runs | no | runs | runs |" verify
expect 0 "| layer_peel | runs | runs | runs | runs |" verify layer_peel
expect 0 "| layer_peel | no | no | no |" verify layer_peel --set planes_max=4

expect 2 "-o FILE" asm layer_peel
expect 2 "-o FILE" asm -o "$work/none"
expect 2 "one program" asm layer_peel layer_peel -o "$work/none"
expect 2 "belong to --lowered" disasm layer_peel --machine g80
expect 2 "a program is wanted" disasm
expect 2 "a program is wanted" verify --machine g80
expect 1 "did you mean \`layer_peel\`" asm layer_pel -o "$work/none"
expect 1 "did you mean \`g80\`" verify layer_peel --machine g8
expect 3 "No such file" asm "$work/none.rop" -o "$work/none"
expect 3 "could not be read" asm "$work" -o "$work/none"
expect 3 "none" asm layer_peel -o "$work/none/words"
[[ ! -e $work/none ]] || complain "a refused asm left a file"
printf 'program x\n' >"$work/x.rop"
expect 1 "x.rop: has no 'schedule'" asm "$work/x.rop" -o "$work/none"
truncate -s 2M "$work/long.rop"
expect 1 "at most 1048576 bytes" disasm "$work/long.rop"
{ printf ROPB; head -c 2M /dev/zero; } >"$work/long.ropb"
expect 1 "at most 1048576 bytes" disasm "$work/long.ropb"

expect 0 '| 0 | `ld` | r or c | plane |' isa
expect 0 '| `z24` | depth | 24 |' isa --formats
finish
