#!/bin/bash
# Sets up, builds, and passes the tests. Ends with ctest's summary and its exit code.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/test.sh [--sanitize] [ctest argument...]
  --sanitize  build with AddressSanitizer and UndefinedBehaviorSanitizer, in a folder of its own
The Python package is built and tested, too, where pip can fetch nanobind, numpy, pytest and mypy; not with --sanitize.
The page of --report is bundled where npm can fetch its packages, and opened in a browser where there is Chromium (tools/setup.sh --report).
Vulkan must work: Debian's software device will do, and tools/setup.sh installs it.
SWARMFIT_DATA_DIR names a folder of captured data; tests that need it skip, and say so, where it is unset.
END
}

preset=ci
case "${1-}" in
  --sanitize) preset=asan; shift ;;
  -h|--help) usage; exit 0 ;;
esac

tools/setup.sh
mkdir -p build
python=(-DSWARMFIT_BUILD_PYTHON=OFF)
if [ "$preset" = ci ] && python_environment; then
  python=(-DSWARMFIT_BUILD_PYTHON=ON "-DPython_EXECUTABLE=$root/build/python/bin/python")
fi
report_packages || true  # the build says what it leaves out
say "building ($preset)"
configure "$preset" "${python[@]}"
cmake --build --preset "$preset"
say "testing"
if [ "$preset" = asan ]; then
  # Drivers and the Vulkan loader keep what they allocate until the process ends.
  export LSAN_OPTIONS="suppressions=$root/tools/lsan.supp:print_suppressions=0${LSAN_OPTIONS:+:$LSAN_OPTIONS}"
  export UBSAN_OPTIONS="print_stacktrace=1${UBSAN_OPTIONS:+:$UBSAN_OPTIONS}"
fi
exec ctest --preset "$preset" -j "$(nproc)" "$@"
