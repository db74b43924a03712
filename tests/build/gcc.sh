#!/usr/bin/env bash
# Everything builds with gcc, as the release does, and no warning is let through.
source_folder=$1 folder=$2/gcc
command -v g++ >/dev/null || { echo "skipped: gcc is not installed"; exit 77; }
cmake -S "$source_folder" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_COMPILE_WARNING_AS_ERROR=ON \
    -DCMAKE_C_COMPILER=gcc -DCMAKE_CXX_COMPILER=g++ >"$2/gcc.log" 2>&1 || { cat "$2/gcc.log"; exit 1; }
cmake --build "$folder" -- -k 0
