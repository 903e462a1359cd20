#!/bin/bash
# PCL's example of planar segmentation, as PCL publishes it, and a copy with one line changed: built, run, what they print side by side.
set -euo pipefail

# The commit of PCL whose example this is; a file given instead is taken as it is.
published=https://raw.githubusercontent.com/PointCloudLibrary/pcl/009d73dbb51fcea8dbf8daeb1229dbb48e0f3870
example=doc/tutorials/content/sources/planar_segmentation/planar_segmentation.cpp

usage() {
  cat <<END
usage: tools/pcl_swap.sh PREFIX [planar_segmentation.cpp]
  PREFIX  where Swarmfit is installed; PCL (libpcl-dev), pkg-config and, without a file, Python's urllib are needed as well
END
}

case "${1-}" in
  -h|--help) usage; exit 0 ;;
  '') usage >&2; exit 2 ;;
esac
prefix=$(realpath "$1")
export PKG_CONFIG_PATH="$prefix/lib/pkgconfig:$prefix/lib/$(gcc -print-multiarch)/pkgconfig:${PKG_CONFIG_PATH-}"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if [ -n "${2-}" ]; then
  cp "$2" "$folder/pcl.cpp"
else
  python3 -c 'import sys, urllib.request; urllib.request.urlretrieve(sys.argv[1], sys.argv[2])' "$published/$example" "$folder/pcl.cpp"
fi
cd "$folder"
sed -e 's/pcl::SACSegmentation</swarmfit::SACSegmentation</' -e '1i #include <swarmfit/adapters/sac_segmentation.hpp>' pcl.cpp > swapped.cpp
diff pcl.cpp swapped.cpp || true
for program in pcl swapped; do
  # shellcheck disable=SC2046  # flags are words
  "${CXX:-g++}" -std=c++20 -O2 -w "$program.cpp" -o "$program" $(pkg-config --cflags --libs swarmfit pcl_segmentation)
  "./$program" > "$program.txt" 2>&1
done
echo
diff --side-by-side --width=80 pcl.txt swapped.txt || true
