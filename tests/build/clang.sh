#!/usr/bin/env bash
# The other compiler: everything builds with clang without a warning, and the unit tests pass.
source_folder=$1 folder=$2/clang
command -v clang++ >/dev/null || { echo "skipped: clang is not installed"; exit 77; }
cmake -S "$source_folder" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_COMPILE_WARNING_AS_ERROR=ON \
    -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ >"$2/clang.log" 2>&1 || { cat "$2/clang.log"; exit 1; }
cmake --build "$folder" -- -k 0 || exit 1
ctest --test-dir "$folder" -LE build -R '^test_' --output-on-failure --no-tests=error
