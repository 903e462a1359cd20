#!/bin/bash
# Installs every system package that building, testing and running Swarmfit needs on Debian 12. Says what it does; done in a moment
# where all is there. Needs root, or sudo.
set -euo pipefail

packages=(
  # build
  g++ cmake ninja-build ccache
  # Vulkan: headers and loader, a software device (lavapipe), validation, GLSL to SPIR-V as a command and as a library
  libvulkan-dev mesa-vulkan-drivers vulkan-validationlayers glslang-tools glslang-dev
  # libraries
  libhwy-dev libtbb-dev libeigen3-dev librandom123-dev libexpected-dev libcli11-dev nlohmann-json3-dev libfmt-dev liblzf-dev
  libnanoflann-dev
  libopencv-dev libspng-dev libturbojpeg0-dev
  # tests and benchmarks
  libgtest-dev libbenchmark-dev
  # the Python package; nanobind comes from pip
  python3-dev python3-venv
  # the documentation's site reads the headers with it; the rest of it comes from pip
  doxygen
  # finds libraries that have no CMake package, and reads the installed pkg-config file
  pkgconf
  # the Motorcycle stereo pair
  python3-skimage
)
lint_packages=(clang-format clang-tidy)
# the peers of bench/, and what plots their figures
bench_packages=(libpcl-dev libopen3d-dev libcgal-dev python3-matplotlib)

# what bundles the page of --report, and what its test opens it in
report_packages=(chromium)
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then report_packages+=(nodejs npm); fi

usage() {
  echo "usage: tools/setup.sh [--lint] [--bench] [--report]"
  echo "  --lint   also the packages of tools/lint.sh: ${lint_packages[*]}"
  echo "  --bench  also those of tools/performance.sh, some gigabytes: ${bench_packages[*]}"
  echo "  --report also what bundles and tests the page of swarmfit --report: ${report_packages[*]}"
}

for argument in "$@"; do
  case "$argument" in
    --lint) packages+=("${lint_packages[@]}") ;;
    --bench) packages+=("${bench_packages[@]}") ;;
    --report) packages+=("${report_packages[@]}") ;;
    -h|--help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
  esac
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "setup: no apt-get here; install the equivalents of: ${packages[*]}" >&2
  exit 1
fi

missing=()
for package in "${packages[@]}"; do
  status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
  [ "$status" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "setup: all ${#packages[@]} packages are installed"
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  if ! command -v sudo >/dev/null; then
    echo "setup: run as root, or install sudo; missing: ${missing[*]}" >&2
    exit 1
  fi
  as_root=(sudo)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
run_as_root() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive "$@" </dev/null >"$log" 2>&1 || {
    cat "$log" >&2
    echo "setup: failed: $*" >&2
    exit 1
  }
}

echo "setup: installing ${#missing[@]} packages and what they depend on: ${missing[*]}"
run_as_root apt-get update
run_as_root apt-get install -y --no-install-recommends -o Dpkg::Use-Pty=0 "${missing[@]}"
echo "setup: $(grep -c '^Setting up ' "$log" || true) packages set up in $SECONDS s"
