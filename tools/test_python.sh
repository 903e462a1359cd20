#!/bin/bash
# pip install . into a new virtual environment, then pytest and mypy against what was installed. Ends with 0 only if all of it passes.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/test_python.sh [--python PYTHON] [pytest argument...]
  --python PYTHON  another interpreter than python3, CPython 3.9 or later
Takes packages from the index that pip is set up for; CMAKE_ARGS goes to CMake.
END
}

python=python3
case "${1-}" in
  --python) python=$2; shift 2 ;;
  -h|--help) usage; exit 0 ;;
esac

tools/setup.sh
environment=$(mktemp -d)
trap 'rm -rf "$environment"' EXIT
if command -v ccache >/dev/null; then export CMAKE_ARGS="-DCMAKE_CXX_COMPILER_LAUNCHER=ccache ${CMAKE_ARGS-}"; fi

say "pip install . ($("$python" --version))"
"$python" -m venv "$environment"
"$environment/bin/python" -m pip install --quiet --disable-pip-version-check ".[test]"
"$environment/bin/python" -m pip install --quiet --disable-pip-version-check rerun-sdk || echo "no rerun-sdk: its tests will be skipped"
"$environment/bin/python" -m pip list --disable-pip-version-check | grep -E '^(swarmfit|numpy|pytest|mypy) '

# From elsewhere: what is imported is what was installed.
tests="$root/python/tests" config="$root/pyproject.toml"
cd "$environment"
say "pytest"
bin/python -m pytest -c "$config" --rootdir "$root/python" -p no:cacheprovider "$tests" "$@"
say "mypy"
bin/python -m mypy --config-file "$config" -p swarmfit
bin/python -m mypy --config-file "$config" --cache-dir "$environment/cache" "$tests"
say "python: all of it passes"
