#!/usr/bin/env bash
# clang-tidy with the short list of checks in .clang-tidy; a finding fails.
#   tests/check_tidy.sh BUILD_DIR        sources that the last 5 commits or you have changed
#   tests/check_tidy.sh BUILD_DIR all    all of them (most of an hour on two cores: LibTorch's and
#                                        gRPC's headers are read anew for each)
# BUILD_DIR is configured and built: compile_commands.json and the generated messages are there.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:?usage: tests/check_tidy.sh BUILD_DIR [all]}

# A changed header is seen through the source of its name, which includes it.
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
  # clang 14 cannot read LibTorch's headers as C++20 (std::vector of an incomplete type); whether our
  # code compiles is the compiler's to say.
  if ! grep -q 'clang-diagnostic-error' "$findings" ||
    grep "^$PWD/" "$findings" | grep -qv 'clang-diagnostic-error'; then
    cat "$findings" >&2
    echo "check_tidy: mend what is named above (.clang-tidy says what is looked for)" >&2
    exit 1
  fi
  echo "check_tidy: headers that clang cannot read; sources that include them are looked at in part"
fi
echo "check_tidy: ok, $(wc -l <<<"$list") sources"
