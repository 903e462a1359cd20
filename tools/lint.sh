#!/bin/bash
# clang-format and clang-tidy over the project's own code. Ends with 0 only if both have nothing to say.
set -euo pipefail
source "$(dirname "$0")/common.sh"

usage() {
  cat <<END
usage: tools/lint.sh [--fix] [--format] [file...]
  --fix     let clang-format rewrite the files
  --format  leave clang-tidy out, which takes minutes
With no file: all that git tracks.
END
}

fix=no tidy=yes files=()
for argument in "$@"; do
  case "$argument" in
    --fix) fix=yes ;;
    --format) tidy=no ;;
    -h|--help) usage; exit 0 ;;
    -*) usage >&2; exit 2 ;;
    *) files+=("$argument") ;;
  esac
done
if [ ${#files[@]} -eq 0 ]; then mapfile -t files < <(git ls-files '*.cpp' '*.hpp' '*.inl'); fi

tools/setup.sh --lint
say "clang-format, ${#files[@]} files"
failed=0
if [ $fix = yes ]; then
  clang-format -i "${files[@]}"
else
  clang-format --dry-run --Werror "${files[@]}" || failed=1
fi

if [ $tidy = yes ]; then
  mkdir -p build
  configure release
  # The shaders' generated headers must be there before their includers can be read.
  cmake --build --preset release
  # What the release preset does not compile: the outside program, what needs nanobind or PCL.
  mapfile -t sources < <(printf '%s\n' "${files[@]}" | grep -E '\.cpp$' | grep -Ev '^(tests/install/|python/|samples/pcl_)' || true)
  say "clang-tidy, ${#sources[@]} files"
  printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy -p build/release --quiet || failed=1
fi

if [ $failed -ne 0 ]; then
  say "lint: see above"
  exit 1
fi
say "lint: nothing to say"
