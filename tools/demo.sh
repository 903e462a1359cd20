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

motorcycle=no
case "${1-}" in
  --motorcycle) motorcycle=yes; shift ;;
  -h|--help) usage; exit 0 ;;
esac

tools/setup.sh
mkdir -p build
say "building"
configure release
cmake --build --preset release --target swarmfit_cli
swarmfit=build/release/host/cli/swarmfit

if [ $motorcycle = no ]; then
  say "swarmfit demo --out out/demo $*"
  $swarmfit demo --out out/demo "$@"
  say "result: out/demo/overlay.png, out/demo/result.json"
  exit 0
fi

pair=/usr/lib/python3/dist-packages/skimage/data
mkdir -p out/motorcycle
# scikit-image gives the pair a quarter of its size; Middlebury's calibration with it.
cat >out/motorcycle/calib.txt <<END
cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]
cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]
doffs=31.086
baseline=193.001
width=741
height=500
ndisp=64
END
command=("$swarmfit" perceive --left $pair/motorcycle_left.png --right $pair/motorcycle_right.png
         --calib out/motorcycle/calib.txt --out out/motorcycle "$@")
say "${command[*]}"
"${command[@]}"
say "result: out/motorcycle/overlay.png, out/motorcycle/result.json"
