#!/usr/bin/env bash
# A library that is not there is named with the line that installs it. CMake is told not to find two of them.
rm -rf "$2/missing"
said=$(cmake -S "$1" -B "$2/missing" -G Ninja -DCMAKE_DISABLE_FIND_PACKAGE_embree=ON -DCMAKE_DISABLE_FIND_PACKAGE_OpenMesh=ON 2>&1) && {
    echo "configuring went through without two libraries"
    exit 1
}
[[ $said == *"apt-get install --no-install-recommends libopenmesh-dev libembree-dev"* ]] || { echo "$said"; exit 1; }
