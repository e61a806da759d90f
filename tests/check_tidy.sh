#!/usr/bin/env bash
# clang-tidy with the short list of checks in .clang-tidy; a finding fails.
#   tests/check_tidy.sh BUILD_DIR [SINCE]
# Looks at every product source, or at those that changed after the commit SINCE. What was clean is
# remembered in BUILD_DIR/tidy by its contents, headers included, and not read again.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:?usage: tests/check_tidy.sh BUILD_DIR [SINCE]}
