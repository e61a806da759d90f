#!/usr/bin/env bash
# Checks lint, format and compatibility of the public API with buf (from npm). Prints SKIPPED if it cannot run.
#   tests/check_proto.sh BUILD_DIR
set -euo pipefail
cd "$(dirname "$0")/.."
mkdir -p "${1:?usage: tests/check_proto.sh BUILD_DIR}/npm"
tools=$(cd "$1/npm" && pwd)
buf="$tools/node_modules/.bin/buf"

if [ ! -x "$buf" ]; then
  if ! command -v npm >/dev/null 2>&1; then
    echo "check_proto: SKIPPED: npm is not installed, so buf cannot check the API" >&2
    exit 0
  fi
  if ! npm install --prefix "$tools" --no-audit --no-fund --loglevel=error \
    @bufbuild/buf@1 >"$tools/install.log" 2>&1; then
    echo "check_proto: SKIPPED: npm could not install @bufbuild/buf (see $tools/install.log)" >&2
    exit 0
  fi
fi

(cd proto && "$buf" lint && "$buf" format --diff --exit-code)

# On the wire the API may only grow (before 1.0 names may change, field numbers never). Compares with
# the newest release, or with the previous commit.
base=$(git describe --tags --abbrev=0 --match 'v*' 2>/dev/null || git rev-parse -q --verify HEAD~1 || true)
if [ -z "$base" ] || [ -z "$(git ls-tree "$base" proto 2>/dev/null)" ]; then
  echo "check_proto: SKIPPED the compatibility check: there is no earlier API to compare with" >&2
  exit 0
fi
before=$(mktemp -d)
trap 'rm -rf "$before"' EXIT
git archive "$base" proto | tar -x -C "$before"
(cd proto && "$buf" breaking --against "$before/proto")
echo "check_proto: the API is clean and compatible with $base on the wire"
