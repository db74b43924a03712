#!/usr/bin/env bash
# Memory errors, leaks and undefined behaviour: the unit tests under gcc's address and undefined behaviour sanitizers.
source_folder=$1 folder=$2/asan
cmake -S "$source_folder" --preset asan -B "$folder" >"$2/asan.log" 2>&1 || { cat "$2/asan.log"; exit 1; }
cmake --build "$folder" -- -k 0 || exit 1
# What OpenImageIO and its libraries keep is not ours to free.
export LSAN_OPTIONS="suppressions=$source_folder/tests/build/leaks.txt:print_suppressions=0"
ctest --test-dir "$folder" -LE build -R '^test_' --output-on-failure --no-tests=error -j "${JOBS:-$(nproc)}"
