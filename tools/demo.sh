#!/bin/bash
# Sets up, builds, and runs the whole chain on the built-in scene, or on a real stereo pair.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/demo.sh [--motorcycle] [swarmfit option...]
  no option     the built-in RGB-D scene, its truth beside what was found
  --motorcycle  Middlebury's Motorcycle stereo pair, from Debian's python3-skimage
Results go to out/demo or out/motorcycle: look at overlay.png.
END
}

folder=demo
case "${1-}" in
  --motorcycle) folder=motorcycle; set -- --motorcycle "${@:2}" ;;
  -h|--help) usage; exit 0 ;;
esac

tools/setup.sh
mkdir -p build
report_packages || true  # the build says what it leaves out
say "building"
configure release
cmake --build --preset release --target swarmfit_cli

command=(build/release/host/cli/swarmfit demo --out "out/$folder" "$@")
say "${command[*]}"
"${command[@]}"
say "look at out/$folder/overlay.png"
