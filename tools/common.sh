# Shared by the tools: sourced, not run.
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"

say() { printf '\n== %s\n' "$*"; }

# configure PRESET [cmake argument...]: with ccache where there is one.
configure() {
  local preset=$1
  shift
  local launcher=()
  if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  cmake --preset "$preset" "${launcher[@]}" "$@" >"$root/build/$preset-configure.log" 2>&1 || {
    cat "$root/build/$preset-configure.log" >&2
    return 1
  }
}

# python_environment: build/python, a virtual environment with what building and testing the Python package takes. Says why where it
# cannot be made, and fails.
python_environment() {
  local folder=$root/build/python wanted=(nanobind numpy pytest mypy)
  if [ "$(cat "$folder/installed" 2>/dev/null)" = "${wanted[*]}" ]; then return 0; fi
  mkdir -p "$root/build"
  if { python3 -m venv --clear "$folder" && "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "${wanted[@]}"; } \
      >"$root/build/python-environment.log" 2>&1; then
    echo "${wanted[*]}" >"$folder/installed"
    # Large, and only for the tests of swarmfit.rerun, which say so where it is absent.
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check rerun-sdk >>"$root/build/python-environment.log" 2>&1 || true
  else
    echo "the Python package is left out: $(tail -n 1 "$root/build/python-environment.log")" >&2
    return 1
  fi
}

# docs_environment: build/docs/environment, a virtual environment with what the documentation's site is built with. Says why where it cannot
# be made, and fails.
docs_environment() {
  local folder=$root/build/docs/environment list=docs/site/requirements.txt log=$root/build/docs/environment.log
  if cmp --quiet "$list" "$folder/installed"; then return 0; fi
  mkdir -p "$root/build/docs"
  if { python3 -m venv --clear "$folder" && "$folder/bin/python" -m pip install --quiet --disable-pip-version-check -r "$list"; } \
      >"$log" 2>&1; then
    cp "$list" "$folder/installed"
  else
    echo "skipped: the site is not built: $(tail -n 1 "$log")" >&2
    return 1
  fi
}

# report_packages: report/node_modules, what the page of --report is bundled from. Says why where it cannot be had, and fails.
report_packages() {
  local stamp=report/node_modules/.installed wanted log=$root/build/report-packages.log
  wanted=$(cksum <report/package-lock.json)
  if [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ]; then return 0; fi
  mkdir -p "$root/build"
  if ! command -v npm >/dev/null; then
    echo "the page of --report is left out: npm is not there (tools/setup.sh --report)" >&2
    return 1
  fi
  if npm ci --prefix report --ignore-scripts --no-audit --no-fund --fetch-retries 1 >"$log" 2>&1; then
    echo "$wanted" >"$stamp"
  else
    echo "the page of --report is left out: $(grep -m 1 -i error "$log" || tail -n 1 "$log")" >&2
    return 1
  fi
}
