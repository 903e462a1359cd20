#!/bin/bash
# Builds the documentation's site into build/site. A link to a page, a heading, a file or an image that is not there is an error.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/docs.sh [--test]
  --test  install nothing by apt; without Doxygen, or packages that pip cannot fetch, say so and end with 77
Read it with: python3 -m http.server --directory build/site
END
}

test=no
case "${1-}" in
  --test) test=yes ;;
  -h|--help) usage; exit 0 ;;
  "") ;;
  *) usage >&2; exit 2 ;;
esac

build=$root/build/docs
mkdir -p "$build"
if [ $test = no ]; then
  tools/setup.sh
elif ! command -v doxygen >/dev/null; then
  echo "skipped: the site is not built, Doxygen is not there (tools/setup.sh)"
  exit 77
fi
docs_environment || exit 77

say "reading the headers"
rm -rf "$build/xml"
{
  cat docs/site/Doxyfile
  echo "INPUT = $root/host/include"
  echo "STRIP_FROM_PATH = $root/host/include"
  echo "STRIP_FROM_INC_PATH = $root/host/include"
  echo "OUTPUT_DIRECTORY = $build"
} >"$build/Doxyfile"
doxygen "$build/Doxyfile"

say "building the site"
export SWARMFIT_ROOT=$root SWARMFIT_DOCS_BUILD=$build PYTHONDONTWRITEBYTECODE=1
python=$build/environment/bin/python
"$python" docs/site/prepare.py "$root" "$build"
rm -rf "$root/build/site"
"$python" -m sphinx --quiet -b html -E -W --keep-going -d "$build/doctrees" -c docs/site "$build/source" "$root/build/site"
rm -f "$root/build/site/.buildinfo"
"$python" docs/site/check_site.py "$root/build/site"
say "docs: build/site/index.html"
