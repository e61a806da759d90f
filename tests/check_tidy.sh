#!/usr/bin/env bash
# Runs clang-tidy with the checks in .clang-tidy, and fails on findings.
#   tests/check_tidy.sh BUILD_DIR        sources changed since 5 commits ago
#   tests/check_tidy.sh BUILD_DIR all    all sources (most of an hour on two cores: each reads the
#                                        headers of LibTorch and gRPC)
# Requires: BUILD_DIR is configured and built.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:?usage: tests/check_tidy.sh BUILD_DIR [all]}

# A changed header is checked through the source of the same name, which includes it.
changed() {
  local since
  since=$(git rev-parse -q --verify HEAD~5 || git rev-list --max-parents=0 HEAD | tail -n 1)
  git diff --name-only "$since" -- '*.cc' '*.h' | sed 's/\.h$/.cc/' | sort -u
}
# Sources that a unity build leaves out of compile_commands.json get the flags of their neighbours.
existing() {
  while read -r source; do
    [ ! -f "$source" ] || echo "$source"
  done
}

list=$(if [ "${2:-}" = all ]; then git ls-files '*.cc'; else changed; fi | existing)
if [ -z "$list" ]; then
  echo "check_tidy: nothing has changed"
  exit 0
fi
findings=$(mktemp)
trap 'rm -f "$findings"' EXIT
if ! xargs -P "$(nproc)" -n 1 clang-tidy --quiet -p "$build" \
  --extra-arg=-Wno-unknown-warning-option <<<"$list" >"$findings" 2>/dev/null; then
  # Clang 14 cannot read LibTorch's headers as C++20 (std::vector of an incomplete type), so compile
  # errors are ignored here.
  if ! grep -q 'clang-diagnostic-error' "$findings" ||
    grep "^$PWD/" "$findings" | grep -qv 'clang-diagnostic-error'; then
    cat "$findings" >&2
    echo "check_tidy: fix the findings above (.clang-tidy lists the checks)" >&2
    exit 1
  fi
  echo "check_tidy: clang cannot read these headers; sources that include them are checked in part"
fi
echo "check_tidy: ok, $(wc -l <<<"$list") sources"
