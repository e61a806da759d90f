#!/usr/bin/env bash
# Builds Color3D and runs its test suite. Installs what is missing (as root or with sudo).
#   tests/run.sh            everything: format, layers, documents, API, lint, then every test but chaos,
#                           soak and load
#   tests/run.sh -L fast    only the tests with this CTest label (fast, stability, integration, slow,
#                           process, chaos, soak, load); fuzz: nothing else, in a Clang build of its own
# BUILD_DIR names another build folder (default: build; build-fuzz for the label fuzz). With CI=true
# nothing is asked or coloured.
set -euo pipefail
cd "$(dirname "$0")/.."

label=""
while getopts "L:h" option; do
  case "$option" in
    L) label=$OPTARG ;;
    h) sed -n '2,8p' "$0" | cut -c3-; exit 0 ;;
    *) exit 2 ;;
  esac
done

# A label without a test is an error. One test at a time: most of them use every core.
run_tests() {
  local result=0
  ctest --test-dir "$build" --output-on-failure --no-tests=error --timeout 900 "$@" || result=$?
  # Programs of many cases pass though some were skipped.
  grep -hE '^\[  SKIPPED \] .*\(' "$build/Testing/Temporary/LastTest.log" | sort -u || true
  return "$result"
}

if [ "$label" = fuzz ]; then
  build=${BUILD_DIR:-build-fuzz}
  deploy/install-deps.sh --fuzz
  cmake -S . -B "$build" -G Ninja -DCMAKE_C_COMPILER=clang -DCMAKE_CXX_COMPILER=clang++ \
    -DCOLOR3D_FUZZ=ON -DCOLOR3D_WERROR=OFF
  cmake --build "$build" --target fuzz_targets
  run_tests -L '^fuzz$'
  exit
fi

build=${BUILD_DIR:-build}
deploy/install-deps.sh --tests
tests/check_format.sh
tests/check_layers.sh
tests/check_docs.sh
tests/check_proto.sh "$build"
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCOLOR3D_TESTS=ON
cmake --build "$build"
tests/check_tidy.sh "$build"
tests/check_thread_safety.sh "$build"
if [ -n "$label" ]; then
  run_tests -L "$label"
else
  run_tests -LE "chaos|soak|load"
fi
