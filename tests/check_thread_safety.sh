#!/usr/bin/env bash
# Checks with Clang that guarded members are used only with their mutex held, in all sources with a
# Mutex (core/base/mutex.h). Takes about a minute on two cores.
#   tests/check_thread_safety.sh BUILD_DIR
# Requires: BUILD_DIR is configured, and the protos are built.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:?usage: tests/check_thread_safety.sh BUILD_DIR}
if ! command -v clang++ >/dev/null 2>&1; then
  echo "check_thread_safety: SKIPPED: clang++ is not installed" >&2
  exit 0
fi

# A header is checked through the source of the same name, or alone if there is none.
sources=$(git grep -l --untracked '#include "core/base/mutex.h"' -- '*.h' '*.cc' | while read -r file; do
  source=${file%.h}.cc
  if [ -f "$source" ]; then echo "$source"; else echo "$file"; fi
done | sort -u)
# All sources get the include paths and macros of all targets. Clang finds /usr/include by itself,
# and only in its own place.
flags=$(mktemp)
findings=$(mktemp)
trap 'rm -f "$flags" "$findings"' EXIT
tests/compile_flags.py "$build" >"$flags"
xargs -P "$(nproc)" -I{} clang++ -std=c++20 -I. "@$flags" -x c++ -fsyntax-only -Wno-everything -Wthread-safety {} \
  <<<"$sources" 2>"$findings" || true
if grep -q 'thread-safety' "$findings"; then
  grep -A3 'thread-safety' "$findings" >&2
  echo "check_thread_safety: hold the mutex there, or annotate the function (core/base/thread_annotations.h)" >&2
  exit 1
fi
# Clang 14 cannot read all headers of LibTorch as C++20.
if grep ' error: ' "$findings" | grep -vE '^[^:]*/(torch|ATen|c10)/' >&2; then
  echo "check_thread_safety: clang cannot read these sources" >&2
  exit 1
fi
echo "check_thread_safety: ok, $(wc -l <<<"$sources") sources"
