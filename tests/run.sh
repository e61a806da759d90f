#!/usr/bin/env bash
# Builds Color3D and runs its test suite. Installs what is missing (as root or with sudo).
#   tests/run.sh            everything: format, layers, documents, API, lint, then every test but chaos
#                           and soak
#   tests/run.sh -L fast    only the tests with this CTest label (fast, stability, integration, slow,
#                           process, chaos, soak)
# BUILD_DIR names another build folder (default: build). With CI=true nothing is asked or coloured.
set -euo pipefail
cd "$(dirname "$0")/.."

label_args=(-LE "chaos|soak")
while getopts "L:h" option; do
  case "$option" in
    L) label_args=(-L "$OPTARG") ;;
    h) sed -n '2,7p' "$0" | cut -c3-; exit 0 ;;
    *) exit 2 ;;
  esac
done
build=${BUILD_DIR:-build}

deploy/install-deps.sh --tests
tests/check_format.sh
tests/check_layers.sh
tests/check_docs.sh
tests/check_proto.sh "$build"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=ON
cmake --build "$build"
tests/check_tidy.sh "$build"
# One test at a time: most of them use every core.
ctest --test-dir "$build" --output-on-failure --timeout 900 "${label_args[@]}"
