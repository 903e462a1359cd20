#!/bin/bash
# pkg_config.sh PKG_CONFIG CXX LIBDIR FOLDER: builds the outside program in FOLDER by what swarmfit.pc in LIBDIR says, and runs it.
set -euo pipefail
pkg_config=$1 compiler=$2 libraries=$3 folder=$4
export PKG_CONFIG_PATH=$libraries/pkgconfig${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
found=$("$pkg_config" --variable=pcfiledir swarmfit)
if [ "$found" != "$libraries/pkgconfig" ]; then
  echo "swarmfit.pc is found in $found, must be in $libraries/pkgconfig" >&2
  exit 1
fi
read -ra flags <<<"$("$pkg_config" --cflags --libs swarmfit)"
echo "swarmfit $("$pkg_config" --modversion swarmfit): ${flags[*]}"
source=$(dirname "$0")/outside/main.cpp
"$compiler" -std=c++20 -O1 "$source" -o "$folder/outside_pkg_config" "${flags[@]}"
LD_LIBRARY_PATH=$libraries "$folder/outside_pkg_config"
