#!/usr/bin/env bash
# Compiles each source of a unity build on its own (-fsyntax-only), and fails on missing includes.
#   tests/check_includes.sh BUILD_DIR        sources changed since 5 commits ago
#   tests/check_includes.sh BUILD_DIR all    all sources (slow: each reads LibTorch's headers)
# Requires: BUILD_DIR is configured, and the protos are built.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:?usage: tests/check_includes.sh BUILD_DIR [all]}

# CMake leaves files of sources that are gone.
joined=$(find "$build" -path '*/Unity/*.cxx' -exec sed -nE "s|^#include \"$PWD/([^\"]+)\".*|\1|p" {} + | sort -u |
  while read -r source; do [ ! -e "$source" ] || echo "$source"; done)
if [ "${2:-}" != all ]; then
  since=$(git rev-parse -q --verify HEAD~5 || git rev-list --max-parents=0 HEAD | tail -n 1)
  # A changed header is checked through the source of the same name, which includes it.
  changed=$({ git diff --name-only "$since"; git ls-files --others --exclude-standard; } | sed 's/\.h$/.cc/' | sort -u)
  joined=$(comm -12 <(echo "$joined") <(echo "$changed"))
fi
if [ -z "$joined" ]; then
  echo "check_includes: no source of a unity build has changed"
  exit 0
fi
# All sources get the include paths and macros of all targets.
flags=$(mktemp)
trap 'rm -f "$flags"' EXIT
tests/compile_flags.py "$build" >"$flags"
if ! xargs -P "$(nproc)" -I{} g++ -std=c++20 -I. "@$flags" -x c++ -fsyntax-only -w {} <<<"$joined"; then
  echo "check_includes: include what each source named above uses" >&2
  exit 1
fi
echo "check_includes: ok, $(wc -l <<<"$joined") sources"
