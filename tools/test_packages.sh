#!/bin/bash
# Builds, installs and uses the library as others will: static and shared, found by CMake and by pkg-config, and as a .deb unpacked beside
# the system. Ends with 0 only if all of it works.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/test_packages.sh [cmake argument...]
Works in build/static and build/shared; the packages are left in build/shared/packages.
END
}
case "${1-}" in -h|--help) usage; exit 0 ;; esac

tools/setup.sh
mkdir -p build
launcher=()
if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
for kind in static shared; do
  say "$kind library"
  folder=$root/build/$kind
  cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_SHARED_LIBS=$([ $kind = shared ] && echo ON || echo OFF) \
    -DSWARMFIT_BUILD_SAMPLES=OFF "${launcher[@]}" "$@" >"$folder-configure.log" 2>&1 || { cat "$folder-configure.log" >&2; exit 1; }
  cmake --build "$folder" --target swarmfit swarmfit_cli swarmfit_terminal_files
  ctest --test-dir "$folder" -R '^install\.' --output-on-failure --no-tests=error
done

say "Debian package"
rm -rf build/shared/packages build/shared/unpacked
(cd build/shared && cpack -G DEB >cpack.log || { cat cpack.log >&2; exit 1; })
package=$(ls build/shared/packages/*.deb)
dpkg-deb --info "$package"
contents=$(dpkg-deb --contents "$package")
awk '{print $1, $3, $6, $7, $8}' <<<"$contents"
for file in bin/swarmfit include/swarmfit/swarmfit.hpp lib/libswarmfit.so share/man/man1/swarmfit.1 share/bash-completion/completions/swarmfit; do
  grep -q " \./usr/$file" <<<"$contents" || { echo "the package lacks /usr/$file" >&2; exit 1; }
done
dpkg-deb --extract "$package" build/shared/unpacked
prefix=$root/build/shared/unpacked/usr
libraries=$(dirname "$(find "$prefix" -name libswarmfit.so)")
LD_LIBRARY_PATH=$libraries "$prefix/bin/swarmfit" --version
tests/install/pkg_config.sh pkg-config "${CXX:-c++}" "$libraries" build/shared
say "packages: all of it works"
