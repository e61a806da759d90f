#!/usr/bin/env bash
# Checks that clang-format (version 14, as in Debian 12; .clang-format) would change no C++ source.
#   tests/check_format.sh [--fix]
set -euo pipefail
cd "$(dirname "$0")/.."
mode=(--dry-run -Werror)
[ "${1:-}" != --fix ] || mode=(-i)
git ls-files -z --cached --others --exclude-standard '*.h' '*.cc' | xargs -0 -P "$(nproc)" -n 40 clang-format "${mode[@]}" || {
  echo "check_format: run tests/check_format.sh --fix" >&2
  exit 1
}
echo "check_format: ok"
