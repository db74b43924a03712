#!/usr/bin/env bash
# An installation works by itself: its own machines, programs and modules, wherever it is moved.
source "$(dirname "$0")/check.bash"

cmake --install "$build_folder" --prefix "$work/first" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
mv "$work/first" "$work/moved"
for file in bin/ropsim lib/ropsim/ropsim_images.so share/ropsim/machines/g80.yaml share/ropsim/programs; do
    [[ -e $work/moved/$file ]] || complain "$file is not installed"
done
[[ ! -e $build_folder/ropsim_mpi.so || -e $work/moved/lib/ropsim/ropsim_mpi.so ]] || complain "the MPI module is not installed"
# A machine that exists in the installation alone shows where the command looks first.
sed 's/^planes_max: .*/planes_max: 3/' "$work/moved/share/ropsim/machines/tiny.yaml" >"$work/moved/share/ropsim/machines/local.yaml"
ropsim=$work/moved/bin/ropsim
expect 0 "planes_max: 3" machine local
finish
